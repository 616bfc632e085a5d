"""The direct view with the fold mirror stowed: what of it the mount still takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from optics.kernels.arrays import to_columns
from optics.kernels.backend import Array3f64, Float32, dr
from optics.layout import Layout, camera_pose
from optics.mesh import Group, PartMesh, Role
from optics.occlusion import Occluder, blocks
from optics.train import OpticalTrain, pixel_grid
from rigs import Rig


def parts_in_body(layout: Layout, parts: Sequence[PartMesh], q1: float, q2: float) -> list[PartMesh]:
    """Parts where they are at joint values in radians, all in the body frame and so of the fixed group."""
    poses = {Group.PAN: layout.body_from_pan(q1), Group.TILT: layout.body_from_m2(q1, q2)}
    return [
        replace(part, group=Group.FIXED, vertices_m=poses[part.group].apply(part.vertices_m))
        if part.group in poses
        else part
        for part in parts
    ]


def direct_view_loss(
    rig: Rig, parts: Sequence[PartMesh], *, q1: float = 0.0, q2: float = 0.0, columns: int = 320, rows: int = 240
) -> float:
    """Share of the camera's view through its port that mount, servos and mirrors take with the fold mirror stowed.

    Parameters
    ----------
    rig : Rig
        With `joints.stow`.
    parts : sequence of PartMesh
        Its parts with the fold mirror stowed (`cad.assembly.meshes.rig_meshes`); what the hull hides is not counted.
    q1, q2 : float
        Where the gaze mirror is, radians.
    columns, rows : int
        Rays that stand for the view.

    Returns
    -------
    float
        Among the rays that leave the port, 0 when none is stopped.
    """
    train = OpticalTrain.from_rig(rig, q1=q1, q2=q2, stowed=True)
    rays = train.trace(pixel_grid(train.camera, columns, rows))
    rays = rays[rays.passed].moved(camera_pose(rig.camera))
    placed = parts_in_body(Layout.from_rig(rig), parts, q1, q2)
    occluder = Occluder([part for part in placed if part.role is not Role.HULL])
    stopped = blocks(
        occluder.parameters(),
        Array3f64(*to_columns(rays.origin_m)),
        Array3f64(*to_columns(rays.direction)),
        Float32(dr.inf),
        True,
    )
    return float(np.mean(np.array(stopped)))
