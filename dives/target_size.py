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
from tracking.perception.detectors import weighs_contrast

LEAST_SHARE = 0.6
"""Of the ball's area where it is farthest: a smaller blob in a window of colours is something else of that colour."""

LEAST_WEIGHED_SHARE = 0.15
"""The same of a blob whose odds say what it is, and which may be the rest of a ball that robot or crop's edge cuts. Of
stills of the arena's dives 100 to 189 log odds from 2 and this share find 91 % of the pieces of targets, and 2.7
other things in 100 images; log odds from 1 and 0.6 find 84 %, and 2.8."""

FARTHEST_M = 3.0
"""At which a dive's ball is looked for unless the dive says how small it may be: beyond, less than half of it keeps a
colour that tells it from the water (docs/explanation/perception.md)."""


def least_area_px(rig: Rig, ball: Ball, share: float) -> float:
    """Pixels of the crop, at a level gaze, of a share of a ball's area where it is farthest from the gaze mirror.

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
    return float(round(share * math.pi * (ball.radius_m / FARTHEST_M) ** 2 / float(scale.prod())))


def sized(dive: Dive, rig: Rig) -> Dive:
    """The dive with the least area of a blob in its `[detector]`: from a ball's size where the dive says none."""
    shape = dive.target.load_shape()
    if dive.detector.area_min_px is not None or not isinstance(shape, Ball):
        return dive
    weighed = weighs_contrast(dive.detector_settings(), contrast=dive.loop_variant().contrast)
    share = LEAST_WEIGHED_SHARE if weighed else LEAST_SHARE
    detector = dive.detector.model_copy(update={"area_min_px": least_area_px(rig, shape, share)})
    return dive.model_copy(update={"detector": detector})
