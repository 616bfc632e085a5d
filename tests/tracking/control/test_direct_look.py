"""Where a search turns when something shows past the mirrors, and when it gives that up."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from optics.gaze.motion import JointSpeeds
from optics.layout import Layout
from rigs import Rig
from tracking.control.direct_look import INTERVAL_S, LONGEST_S, LOOK_S, REMEMBERED_S, DirectLook
from tracking.control.gaze_view import GazeView
from tracking.estimation.clutter import Clutter
from tracking.estimation.gimbal import Gimbal
from tracking.estimation.lines_of_sight import LinesOfSight
from tracking.perception import ACQUIRED_LOG_ODDS, Crop, ExactCorners
from tracking.perception.direct_view import DirectView
from tracking.records import Blob, Detection

RIG = Rig.load("aqua2")
GIMBAL = Gimbal(Layout.from_rig(RIG))
SPEEDS = JointSpeeds.from_rig(RIG)
CORNERS = ExactCorners(RIG)
SHOWN = GazeView(GIMBAL, LinesOfSight(RIG), lambda q: Crop.of(CORNERS.corners(q)))
FRAME_S = 1 / 30

LEFT, RIGHT = np.array([0.8, 0.6, 0.0]), np.array([0.8, -0.6, 0.0])
VIEW = DirectView(water=np.ones((1, 2), dtype=bool), direction=np.array([[LEFT, RIGHT]], dtype=np.float32))
"""Its left half looks 37 degrees to the left, its right half as much to the right."""

IMAGE = np.zeros((10, 20, 3), dtype=np.uint8)


class Detector:
    """Finds what it is told to: pairs of a column of `IMAGE` and log odds."""

    def __init__(self) -> None:
        self.found: list[tuple[float, float]] = []

    def __call__(self, crop, ignored, expected_px) -> Detection:
        blobs = tuple(
            Blob(
                area_px=9.0,
                centroid_px=(x, 5.0),
                box_px=(int(x), 4, 3, 3),
                circularity=1.0,
                log_odds=log_odds,
                ellipse_share=1.0,
            )
            for x, log_odds in self.found
        )
        return Detection(mask=np.zeros(crop.shape[:2], dtype=np.uint8), blobs=blobs, centroid_px=None)


@pytest.fixture
def detector() -> Detector:
    return Detector()


@pytest.fixture
def look(detector) -> DirectLook:
    return DirectLook(VIEW, detector, GIMBAL, SPEEDS, SHOWN)


def off_deg(q: np.ndarray, direction: np.ndarray) -> float:
    return math.degrees(math.acos(float(GIMBAL.gaze(q) @ direction)))


def test_it_looks_a_few_times_a_second(look):
    assert look.is_due(0.0)
    look.take(IMAGE, 0.0, GIMBAL.middle)
    assert not look.is_due(INTERVAL_S - FRAME_S)
    assert look.is_due(INTERVAL_S)


def test_the_gaze_is_turned_to_what_shows(look, detector):
    detector.found = [(15.0, ACQUIRED_LOG_ODDS + 1)]
    look.take(IMAGE, 0.0, GIMBAL.middle)
    assert look.turned
    goal = look.pose(FRAME_S, GIMBAL.middle)
    assert off_deg(goal, RIGHT) < 8
    # It has swum to the other side while the mirror turns.
    detector.found = [(5.0, ACQUIRED_LOG_ODDS + 1)]
    look.take(IMAGE, INTERVAL_S, GIMBAL.middle)
    assert off_deg(look.pose(FRAME_S, goal), LEFT) < 8


def test_what_does_not_look_like_the_target_is_left_alone(look, detector):
    detector.found = [(15.0, ACQUIRED_LOG_ODDS - 0.1)]
    look.take(IMAGE, 0.0, GIMBAL.middle)
    assert not look.turned


def test_where_nothing_is_found_it_looks_no_longer_and_not_again_for_a_while(look, detector):
    detector.found = [(15.0, ACQUIRED_LOG_ODDS + 1)]
    look.take(IMAGE, 0.0, GIMBAL.middle)
    goal, images = look.pose(FRAME_S, GIMBAL.middle), 0
    time_s = 0.5
    while look.pose(FRAME_S, goal) is not None:
        images, time_s = images + 1, time_s + FRAME_S
    assert images == pytest.approx(LOOK_S / FRAME_S, abs=1)
    look.take(IMAGE, time_s + INTERVAL_S, goal)
    assert not look.turned
    # The other thing is new.
    detector.found += [(5.0, ACQUIRED_LOG_ODDS + 0.5)]
    look.take(IMAGE, time_s + 2 * INTERVAL_S, goal)
    assert look.turned
    look.end()
    detector.found = [(15.0, ACQUIRED_LOG_ODDS + 1)]
    look.take(IMAGE, time_s + REMEMBERED_S + INTERVAL_S, goal)
    assert look.turned


def test_a_gaze_that_does_not_get_there_is_not_waited_for(look, detector):
    detector.found = [(15.0, ACQUIRED_LOG_ODDS + 1)]
    look.take(IMAGE, 0.0, GIMBAL.middle)
    assert look.pose(LONGEST_S, GIMBAL.lowest) is not None
    assert look.pose(FRAME_S, GIMBAL.lowest) is None
    assert not look.turned


def test_it_goes_on_from_a_snapshot(look, detector):
    detector.found = [(15.0, ACQUIRED_LOG_ODDS + 1), (5.0, ACQUIRED_LOG_ODDS + 0.5)]
    fresh = look.snapshot()
    look.take(IMAGE, 0.0, GIMBAL.middle)
    look.end()
    look.take(IMAGE, INTERVAL_S, GIMBAL.middle)
    look.pose(FRAME_S, look._goal)
    other = DirectLook(VIEW, detector, GIMBAL, SPEEDS, SHOWN)
    other.restore(json.loads(json.dumps(look.snapshot())))
    assert other.snapshot() == look.snapshot()
    assert other.pose(FRAME_S, GIMBAL.middle).tolist() == look.pose(FRAME_S, GIMBAL.middle).tolist()
    other.restore(json.loads(json.dumps(fresh)))
    assert other.snapshot() == fresh
    assert other.is_due(0.0)


@pytest.mark.parametrize(("until_s", "turned"), [(5.0, False), (0.0, True)])
def test_what_is_passed_by_is_passed_by_past_the_mirrors_too(look, detector, until_s, turned):
    """A direction of which the wrong distance has turned 6 degrees is still that of clutter 3 degrees wide."""
    near = np.array([math.cos(math.radians(28.9)), -math.sin(math.radians(28.9)), 0.0])
    clutter = Clutter()
    clutter.add(near, math.radians(3.0), until_s)
    detector.found = [(15.0, ACQUIRED_LOG_ODDS + 1)]
    look.take(IMAGE, 0.0, GIMBAL.middle, clutter.at(0.0))
    assert look.turned is turned
    detector.found = [(5.0, ACQUIRED_LOG_ODDS + 1)]
    look.take(IMAGE, INTERVAL_S, GIMBAL.middle, clutter.at(0.0))
    assert look.turned
