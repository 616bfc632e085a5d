"""When the target of a dive can be seen at all.

*Available* is it where some joint values show its direction past hull and mount (`optics.coverage`), and nothing of the
world and no decoy lies between the gaze mirror's centre and its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dives.dive import Dive
from dives.metrics.frames import BoolArray
from dives.paths import body_pose, decoy_pose, target_pose
from dives.rendered_camera import dive_scene
from optics.coverage.coverage import compute_coverage
from optics.coverage.sphere import cells_of
from optics.kernels.arrays import FloatArray
from optics.kernels.backend import Array3f32, Bool, Float32, mi
from optics.kernels.cache import load_or_make, result_key
from optics.kernels.ray_scene import mesh_scene
from optics.layout import Layout
from optics.mesh import PartMesh
from rigs import Rig
from scenes.stage.targets import Ball

COVERED_VERSION = 1
"""Raised when the same rig is found to show other directions."""

NSIDE, POSES = 32, 41
"""Cells of 1.8 degrees, and poses along each joint's range, at most 5 degrees apart: a view is 20 wide."""


@dataclass(frozen=True, kw_only=True)
class Availability:
    """Where the target of a dive truly is, and what shows or hides it.

    Attributes
    ----------
    time_s : array, shape (n,)
    direction : array, shape (n, 3)
        Unit vectors from the gaze mirror's centre to the target, body frame.
    distance_m : array, shape (n,)
        Along them.
    shown : array, shape (n,)
        Whether some joint values show the direction past hull and mount.
    behind_world, behind_decoy : arrays, shape (n,)
        Whether the world, or a decoy, lies between.
    """

    time_s: FloatArray
    direction: FloatArray
    distance_m: FloatArray
    shown: BoolArray
    behind_world: BoolArray
    behind_decoy: BoolArray

    @property
    def available(self) -> BoolArray:
        """Whether a loop could hold the target, shape (n,)."""
        return self.shown & ~self.behind_world & ~self.behind_decoy


def availability(dive: Dive, rig: Rig, parts: Sequence[PartMesh], times_s: FloatArray) -> Availability:
    """When a loop could hold the target.

    Parameters
    ----------
    dive : Dive
    rig : Rig
        That it is dived with.
    parts : sequence of PartMesh
        Hull and mount.
    times_s : array, shape (n,)
        From the dive's beginning.
    """
    body = body_pose(dive, times_s)
    eye = body.apply(Layout.from_rig(rig).body_from_gimbal.translation)
    target = target_pose(dive, times_s).translation
    away = target - eye
    distance_m = np.linalg.norm(away, axis=1)
    direction = body.rotation.inv().apply(away / distance_m[:, np.newaxis])
    behind_decoy = np.zeros(len(times_s), dtype=bool)
    for decoy in dive.decoys:
        shape = decoy.load_shape()
        if isinstance(shape, Ball):
            behind_decoy |= crosses_ball(eye, target, decoy_pose(dive, decoy, times_s).translation, shape.radius_m)
    return Availability(
        time_s=np.asarray(times_s, dtype=np.float64),
        direction=direction,
        distance_m=distance_m,
        shown=covered_cells(rig, parts)[cells_of(direction, NSIDE)],
        behind_world=_behind_world(dive, rig, eye, target),
        behind_decoy=behind_decoy,
    )


def covered_cells(rig: Rig, parts: Sequence[PartMesh]) -> BoolArray:
    """Cells of the sphere of directions (HEALPix, `NSIDE`) that some joint values show; from the cache when it can."""

    def covered() -> BoolArray:
        q1, q2 = (np.linspace(*joint.limits, POSES) for joint in (layout.pan, layout.tilt))
        return compute_coverage(rig, parts, q1=q1, q2=q2, nside=NSIDE).covered

    layout = Layout.from_rig(rig)
    numbers = rig.model_dump(mode="json", include={"camera", "port", "water", "gaze"})
    shapes = [[part.group.value, part.vertices_m, part.faces] for part in parts]
    return load_or_make(
        "covered directions",
        result_key("covered directions", COVERED_VERSION, numbers, shapes, NSIDE, POSES),
        covered,
        pack=lambda cells: {"cells": cells},
        unpack=lambda stored: stored["cells"],
    )


def crosses_ball(start: FloatArray, end: FloatArray, centre: FloatArray, radius_m: float) -> BoolArray:
    """Whether segments pass through balls, each of shape (n, 3)."""
    along = end - start
    share_of_it = np.clip(((centre - start) * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1)
    nearest = start + share_of_it[:, np.newaxis] * along
    return np.asarray(np.linalg.norm(centre - nearest, axis=1) < radius_m)


def _behind_world(dive: Dive, rig: Rig, eye: FloatArray, target: FloatArray) -> BoolArray:
    world = dive_scene(dive, rig).world
    if len(world.faces) == 0:
        return np.zeros(len(eye), dtype=bool)
    away = np.linalg.norm(target - eye, axis=1)
    origin, direction = (Array3f32(*each.T.astype(np.float32)) for each in (eye, (target - eye) / away[:, np.newaxis]))
    ray = mi.Ray3f(origin, direction, Float32(away.astype(np.float32)), 0.0, [])
    return np.asarray(mesh_scene(world.vertices_m, world.faces).ray_test(ray, coherent=True, active=Bool(True)).numpy())
