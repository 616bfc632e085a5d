"""What a search knows of a lost target when what was followed in its place turns out to be something else."""

from __future__ import annotations

import math

import numpy as np
import pytest

from optics.layout import Layout
from rigs import Rig
from tracking.estimation.gimbal import Gimbal
from tracking.estimation.lines_of_sight import LinesOfSight
from tracking.loop.loop import TrackingLoop
from tracking.loop.variants import VARIANTS
from tracking.perception import Crop, ExactCorners
from tracking.protocols import CameraFrame, MirrorReport
from tracking.records import Blob, Detection, Mode

RIG = Rig.load("aqua2")
GIMBAL, SIGHT_LINES, CORNERS = Gimbal(Layout.from_rig(RIG)), LinesOfSight(RIG), ExactCorners(RIG)
IMAGE = np.full((RIG.camera.height_px, RIG.camera.width_px, 3), 90, dtype=np.uint8)
INTERVAL_S = 1 / 30
BALL_PX2 = 500.0


def level(azimuth_deg):
    azimuth = math.radians(azimuth_deg)
    return np.array([math.cos(azimuth), math.sin(azimuth), 0.0])


class Watched:
    """A loop whose mirror is at once where it is asked to be, and whose detector is told what there is."""

    def __init__(self):
        self.blobs = ()
        self.loop = TrackingLoop(RIG, VARIANTS["default"].without_check(), detector=self.detect)
        self.q, self.time_s, self.modes = GIMBAL.middle, 0.0, []

    def detect(self, image, robot, expected):
        return Detection(mask=np.zeros(image.shape[:2], np.uint8), blobs=self.blobs, centroid_px=None)

    def show(self, seconds, azimuth_deg=None, *, area_px=BALL_PX2, log_odds=5.0, ellipse_share=1.0):
        """Show a thing for some time in every image that has its direction in the crop, or nothing."""
        for _ in range(round(seconds / INTERVAL_S)):
            crop = Crop.of(CORNERS.corners(self.q))
            pixel = None if azimuth_deg is None else SIGHT_LINES.pixel(level(azimuth_deg), self.q)
            x, y = (math.nan, math.nan) if pixel is None else crop.from_image(np.array([pixel]))[0].tolist()
            side = round(math.sqrt(area_px))
            within = side / 2 < x < crop.width_px - side / 2 and side / 2 < y < crop.height_px - side / 2
            box_px = (round(x - side / 2), round(y - side / 2), side, side) if within else (0, 0, 0, 0)
            blob = Blob(
                area_px=area_px,
                centroid_px=(x, y),
                box_px=box_px,
                circularity=1.0,
                log_odds=log_odds,
                ellipse_share=ellipse_share,
            )
            self.blobs = (blob,) if within else ()
            report = MirrorReport(q=self.q, time_s=self.time_s, measured=True)
            step = self.loop.step(CameraFrame(image=IMAGE, time_s=self.time_s), report)
            self.modes.append(step.mode)
            self.q, self.time_s = step.q_command, self.time_s + INTERVAL_S

    @property
    def lost_at(self):
        """Azimuth about which a target that was lost is sought, degrees; None when everything is."""
        lost = self.loop.snapshot()["search"]["lost"]
        return None if lost is None else math.degrees(math.atan2(lost["direction"][1], lost["direction"][0]))


def followed():
    """After a second of tracking a ball 10 degrees to the left."""
    watched = Watched()
    while watched.modes.count(Mode.TRACK) < 30:
        watched.show(INTERVAL_S, 10.0)
        assert watched.time_s < 20
    return watched


def test_what_grew_into_something_larger_is_sought_where_it_was_before():
    """It is dropped after two seconds without a look of its own, and its place is none of what is passed by."""
    watched = followed()
    watched.show(2.3, 14.0, area_px=12 * BALL_PX2, log_odds=0.2)
    watched.show(0.1)
    assert watched.modes[-1] is Mode.SCAN
    assert watched.lost_at == pytest.approx(10.0, abs=0.5)
    assert watched.loop.snapshot()["follower"]["evidence"]["clutter"] == []


def test_what_was_taken_for_a_lost_target_says_nothing_of_where_that_is():
    """A ragged thing near where it is expected is dropped after half a second: the search around the loss goes on."""
    watched = followed()
    watched.show(0.3)
    watched.show(0.6, 10.0, log_odds=0.5, ellipse_share=0.9)
    assert watched.modes[-1] is Mode.SCAN
    assert watched.lost_at == pytest.approx(10.0, abs=0.5)
