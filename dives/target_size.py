"""How large a target is in the crop: who built it knows its size, and on a reef its size tells it from red corals."""

from __future__ import annotations

import math

import numpy as np

from dives.dive import Dive
from optics.layout import Layout
from rigs import Rig
from scenes.stage.targets import Ball
from tracking.control.crop_scale import crop_scale, level_pose
from tracking.estimation.gimbal import Gimbal
from tracking.estimation.lines_of_sight import LinesOfSight
from tracking.loop.variants import VARIANTS
from tracking.perception import Crop, ExactCorners

LEAST_SHARE = 0.6
"""Of the ball's area where it is farthest: a smaller blob is something else of its colour."""

FARTHEST_M = 3.0
"""At which a dive's ball is looked for unless the dive says how small it may be: beyond, less than half of it keeps a
colour that tells it from the water (docs/explanation/perception.md)."""


def least_area_px(rig: Rig, ball: Ball, distance_m: float) -> float:
    """Pixels of the crop, at a level gaze, that a blob needs to be a ball up to a distance from the gaze mirror.

    Raises
    ------
    ValueError
        For a rig without mirrors, or one whose camera does not see the gaze mirror at a level gaze.
    """
    corners = ExactCorners(rig)
    lines_of_sight = LinesOfSight(rig, VARIANTS["default"].target_distance_m)
    scale = crop_scale(lines_of_sight, lambda q: Crop.of(corners.corners(q)), level_pose(Gimbal(Layout.from_rig(rig))))
    if not np.isfinite(scale).all():
        raise ValueError(f"expected a camera that sees the gaze mirror at a level gaze, got rig {rig.name!r}")
    return float(round(LEAST_SHARE * math.pi * (ball.radius_m / distance_m) ** 2 / float(scale.prod())))


def sized(dive: Dive, rig: Rig) -> Dive:
    """The dive with the least area of a blob in its `[detector]`: from a ball's size where the dive says none."""
    shape = dive.target.load_shape()
    if dive.detector.area_min_px is not None or not isinstance(shape, Ball):
        return dive
    detector = dive.detector.model_copy(update={"area_min_px": least_area_px(rig, shape, FARTHEST_M)})
    return dive.model_copy(update={"detector": detector})
