"""Mirrors by distance: for each pair of d1 and d2 the smallest M1 and M2 that do what is wanted of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.search.limits import CONSTRAINTS, rooms_mm
from optics.sizing.footprint import centred_extents
from optics.sizing.gaze_range import GazeRange, pose_grid
from optics.sizing.limits import ROUNDING_MM, Request
from optics.sizing.window import fraction_window
from optics.train import OpticalTrain
from rigs import Rig

D1_MM = np.arange(60.0, 201.0, 10.0)
D2_MM = np.arange(80.0, 421.0, 10.0)
"""Distances that are tried."""
FIELD = 0.6
"""M1 passes this share of the image's sides: what is beside M1 stays a direct view ahead."""
SIZING_STEPS = 21
RAYS_PER_SIDE = 8


@dataclass(frozen=True, kw_only=True)
class MirrorTable:
    """Pairs of distances at which both mirrors clear each other, the port and the printer's bed.

    Attributes
    ----------
    designs : array, shape (n, 6)
        Columns of `optics.search.objectives.PARAMETERS`, millimetres.
    rejected : dict of str to float
        For each constraint that threw pairs out, how many millimetres the best of them lacked.
    """

    designs: FloatArray
    rejected: dict[str, float]


def mirror_table(rig: Rig, request: Request) -> MirrorTable:
    """Mirrors for a rig's camera, port and joints at every pair of distances.

    M2 passes the request's window over its whole range of gazes; M1 passes that, and `FIELD` of the image.

    Parameters
    ----------
    rig : Rig
        With mirrors; where its camera is and how large its mirrors are does not matter.
    request : Request
    """
    layout, train, mount = Layout.from_rig(rig), OpticalTrain.bare(rig), rig.require_gaze().mount
    d1, d2 = (values.ravel() for values in np.meshgrid(D1_MM, D2_MM, indexing="ij"))
    grid = pose_grid(layout, request.gaze, SIZING_STEPS)
    rest = GazeRange(first=(0.0, 0.0), second=(0.0, 0.0), in_joints=True)
    q_rest = rest.poses(layout, *rest.values(1))
    halves = []
    for window, q1, q2 in (
        (request.window, grid.q1[grid.reached], grid.q2[grid.reached]),
        (fraction_window(train.camera, FIELD), *q_rest),
    ):
        rays = train.trace(window.boundary(RAYS_PER_SIDE))
        halves.append(
            centred_extents(
                rig,
                rays[rays.passed],
                d1_m=d1 / 1000,
                d2_m=d2 / 1000,
                q1=q1,
                q2=q2,
                margin_m=request.margin_m,
                angle_tolerance=request.angle_tolerance,
            )
        )
    core, field = halves
    m1 = np.maximum(core.m1_m, field.m1_m)
    sizes = np.ceil(2000 * np.hstack([m1, core.m2_m]) / ROUNDING_MM - 1e-6) * ROUNDING_MM
    finite = np.isfinite(sizes).all(axis=1)
    designs = np.column_stack([d1, d2, sizes])[finite]
    rooms = rooms_mm(rig, designs)
    needed = np.array([mount.clearance_mm if "clear of" in name else 0.0 for name in CONSTRAINTS])
    short = needed - rooms
    rejected = {
        name: float(short[:, number].min())
        for number, name in enumerate(CONSTRAINTS)
        if len(designs) and short[:, number].min() > 0
    }
    return MirrorTable(designs=designs[(short <= 0).all(axis=1)], rejected=rejected)
