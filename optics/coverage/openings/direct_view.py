"""Directions that the camera sees past all mirrors, with M1 stowed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from optics.coverage.field import SKIN_M
from optics.kernels.arrays import FloatArray
from optics.kernels.ray_scene import first_faces, mesh_scene
from optics.layout import Layout
from optics.mesh import Group, PartMesh, merge
from optics.status import Status
from optics.train import OpticalTrain, Rays
from rigs import Rig

FAR_M = 1e6
POSES = 5
"""Tilts over the range, in the middle of the pan, at which what moves may be put aside; the best counts."""


def seen_directly(rig: Rig, stowed: Sequence[PartMesh], directions: FloatArray) -> NDArray[np.bool_]:
    """Whether the camera sees far points in some directions, (n, 3), body frame, with no mirror in its way.

    Parameters
    ----------
    rig : Rig
        With mirrors.
    stowed : sequence of PartMesh
        Parts with M1 stowed.
    directions : array, shape (n, 3)
        Unit vectors.
    """
    layout, train = Layout.from_rig(rig), OpticalTrain.bare(rig)
    image = train.project(FAR_M * layout.body_from_camera.inv().rotation.apply(directions))
    inside = np.flatnonzero(image.status == Status.OK)
    rays = train.trace(image.pixels[inside]).moved(layout.body_from_camera)
    free = np.zeros(len(inside), dtype=bool)
    for q2 in layout.tilt.values(POSES):
        blocked = np.zeros(len(inside), dtype=bool)
        for group in Group:
            pose = _body_from(layout, group, float(np.mean(layout.pan.limits)), float(q2))
            blocked |= _blocked([part for part in stowed if part.group is group], rays.moved(pose.inv()))
        free |= ~blocked
    seen = np.zeros(len(directions), dtype=bool)
    seen[inside[free]] = True
    return seen


def _blocked(parts: Sequence[PartMesh], rays: Rays) -> NDArray[np.bool_]:
    """Which rays, in the frame of the parts, hit one of them."""
    vertices, faces, _ = merge(parts)
    if not len(faces) or not len(rays.status):
        return np.zeros(len(rays.status), dtype=bool)
    distance, _ = first_faces(mesh_scene(vertices, faces), rays.origin_m + SKIN_M * rays.direction, rays.direction)
    return np.isfinite(distance)


def _body_from(layout: Layout, group: Group, q1: float, q2: float) -> RigidTransform:
    if group is Group.FIXED:
        return RigidTransform.identity()
    return layout.body_from_pan(q1) if group is Group.PAN else layout.body_from_m2(q1, q2)
