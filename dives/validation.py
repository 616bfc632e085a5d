"""The dive that a design is validated with: the preset `spiral`, at a distance and for a size that fit the rig."""

from __future__ import annotations

import math

import numpy as np

from cad.assembly.meshes import rig_meshes
from dives.dive import Dive
from dives.motions import Spiral
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mesh import Role, merge
from rigs import Rig
from scenes.stage.targets import Ball, target_named
from tracking.control.crop_scale import crop_scale, level_pose
from tracking.estimation.gimbal import Gimbal
from tracking.estimation.lines_of_sight import LinesOfSight
from tracking.loop.variants import VARIANTS
from tracking.perception import Crop, ExactCorners

PRESET = "spiral"

OFF_THE_HULL_M = 0.5
"""Of the ball's centre, at its nearest: the robot sways, and the ball has a radius."""

LEAST_SHARE = 0.6
"""Of the ball's area where it is farthest: a smaller blob is something else of its colour."""


def validation_dive(rig: Rig) -> Dive:
    """The preset `spiral` for a rig.

    The ball starts farther off where the hull is large, and the least area of a blob is that of most of the ball at the
    path's end: who built the target knows its size, and on a reef it is the size that tells it from red corals.

    Raises
    ------
    ValueError
        For a rig without mirrors or servos, or one whose camera does not see the gaze mirror at a level gaze.
    """
    dive = Dive.load(PRESET)
    path, shape = dive.target.path, target_named(dive.target.shape)
    assert isinstance(path, Spiral) and isinstance(shape, Ball)  # the preset is ours
    path = path.model_copy(update={"start_radius_m": max(path.start_radius_m, _hull_radius_m(rig) + OFF_THE_HULL_M)})
    lasting = dive.duration_s - path.wait_s
    farthest = math.hypot(
        path.start_radius_m + path.receding_m_per_s * lasting, path.start_height_m + path.rising_m_per_s * lasting
    )
    area = math.pi * (shape.radius_m / farthest) ** 2 / float(_scale(rig).prod())
    return dive.model_copy(
        update={
            "rig": rig.name,
            "target": dive.target.model_copy(update={"path": path}),
            "detector": dive.detector.model_copy(update={"area_min_px": float(round(LEAST_SHARE * area))}),
        }
    )


def _hull_radius_m(rig: Rig) -> float:
    """Horizontal distance of the hull's farthest point from the body's origin; 0 without a hull."""
    hull = [part for part in rig_meshes(rig) if part.role == Role.HULL]
    return float(np.linalg.norm(merge(hull)[0][:, :2], axis=1).max()) if hull else 0.0


def _scale(rig: Rig) -> FloatArray:
    """Radians to a pixel of the crop, at a level gaze."""
    corners = ExactCorners(rig)
    lines_of_sight = LinesOfSight(rig, VARIANTS["default"].target_distance_m)
    scale = crop_scale(lines_of_sight, lambda q: Crop.of(corners.corners(q)), level_pose(Gimbal(Layout.from_rig(rig))))
    if not np.isfinite(scale).all():
        raise ValueError(f"expected a camera that sees the gaze mirror at a level gaze, got rig {rig.name!r}")
    return scale
