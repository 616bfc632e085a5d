"""Images of a target that the default follower is shown: what several tests of it draw."""

import math
from dataclasses import replace

import numpy as np

from optics.gaze.motion import JointSpeeds
from optics.layout import Layout
from rigs import Rig
from tracking.control.follower import Observation
from tracking.control.gaze_follower import GazeFollower
from tracking.control.gaze_view import GazeView
from tracking.control.pointing import Pointing
from tracking.estimation.gimbal import Gimbal
from tracking.estimation.lines_of_sight import LinesOfSight
from tracking.loop.variants import VARIANTS
from tracking.perception import Crop, ExactCorners
from tracking.records import Blob

RIG = Rig.load("aqua2")
GIMBAL = Gimbal(Layout.from_rig(RIG))
SIGHT_LINES = LinesOfSight(RIG)
CORNERS = ExactCorners(RIG)
ROW_TIME_S = 29.6e-6
INTERVAL_S = 1 / 30
IMAGES = 10
PAN_RATE = math.radians(60)
"""As fast as the servos turn."""

MIDDLE = np.array([math.cos(math.radians(10)), 0.0, math.sin(math.radians(10))])
"""Unit vector, body frame: what the middle of the view shows in the fifth image."""

SHOWN = GazeView(GIMBAL, SIGHT_LINES, lambda q: Crop.of(CORNERS.corners(q)))


def follower(row_time_s, view=SHOWN, *, overhead=True):
    """The default's, in water that leaves the target its colour."""
    pointing = Pointing(GIMBAL, JointSpeeds.from_rig(RIG), half_view=math.radians(10))
    noise = VARIANTS["default"].direction_noise
    timing = {"latency_s": 0.05, "row_time_s": row_time_s}
    return GazeFollower(SIGHT_LINES, pointing, view, np.full(2, 1e-3), noise, **timing, plain=1.0, overhead=overhead)


def observation(image, target, row_time_s):
    """A target that does not move, in an image while pan turns at its servo's speed, row by row."""
    time_s = image * INTERVAL_S
    q = np.array([PAN_RATE * (time_s - IMAGES / 2 * INTERVAL_S), math.radians(5)])
    later_s = 0.0
    for _ in range(20):
        pixel = SIGHT_LINES.pixel(target, q + np.array([PAN_RATE * later_s, 0.0]))
        later_s = (pixel[1] - SIGHT_LINES.middle_row_px) * row_time_s
    crop = Crop.of(CORNERS.corners(q))
    x, y = crop.from_image([pixel])[0]
    blob = Blob(centroid_px=(float(x), float(y)), area_px=500.0, box_px=(0, 0, 25, 25), circularity=1.0)
    return Observation(time_s=time_s, interval_s=INTERVAL_S, q=q, q_command=q, crop=crop, blobs=(blob,)), later_s


def of_area(blob, area_px):
    """A disc of another area about the same middle."""
    x, y = blob.centroid_px
    radius = math.sqrt(area_px / math.pi)
    box_px = (round(x - radius), round(y - radius), round(2 * radius), round(2 * radius))
    return replace(blob, area_px=area_px, box_px=box_px)
