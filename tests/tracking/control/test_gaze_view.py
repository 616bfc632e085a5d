"""What each pose of the mirror shows: beside the exact train, and with a robot that is drawn into the crop."""

from __future__ import annotations

import math

import numpy as np
import pytest

from optics.layout import Layout
from rigs import Rig
from tracking.control.gaze_view import CELL_PX, CELLS, GazeView
from tracking.estimation.gimbal import Gimbal
from tracking.estimation.lines_of_sight import LinesOfSight
from tracking.perception import Crop, ExactCorners
from tracking.perception.robot_view import DEEPEST_PX, RobotView

RIG = Rig.load("aqua2")
GIMBAL = Gimbal(Layout.from_rig(RIG))
SIGHT_LINES = LinesOfSight(RIG)
CORNERS = ExactCorners(RIG)

REFRACTION_CELLS = 3 / 8
"""Three pixels of the crop by which a flat port bends what a homography keeps straight (docs, perception)."""


def crop_at(q):
    return Crop.of(CORNERS.corners(q))


def view(depth=None):
    """With a robot that covers the same cells at every pose: how many cells each lies inside of it."""
    if depth is None:
        return GazeView(GIMBAL, SIGHT_LINES, crop_at)
    q1, q2 = (np.array([low, high]) for low, high in zip(GIMBAL.lowest, GIMBAL.highest, strict=True))
    depth_px = np.clip(CELL_PX * depth, -DEEPEST_PX, DEEPEST_PX)
    everywhere = np.broadcast_to(depth_px, (2, 2, *CELLS[::-1])).astype(np.int8)
    return GazeView(GIMBAL, SIGHT_LINES, crop_at, RobotView(q1=q1, q2=q2, depth=everywhere))


def clearance(shown, q, direction):
    pan, tilt = GIMBAL.angles(q)
    return float(shown.clearance(GIMBAL.in_gimbal(direction)[np.newaxis], np.array([pan]), np.array([tilt]))[0, 0, 0])


def test_distances_from_the_crops_edge_are_the_exact_trains():
    """Sixty directions up to 14 degrees from the gaze of poses all over the range."""
    rng, shown, compared = np.random.default_rng(3), view(), 0
    for _ in range(60):
        q = rng.uniform(GIMBAL.lowest, GIMBAL.highest)
        direction = GIMBAL.from_gaze(*GIMBAL.angles(q), *np.tan(np.radians(rng.uniform(-14, 14, 2))))
        pixel = SIGHT_LINES.pixel(direction, q)
        if pixel is None:
            continue
        place = (crop_at(q).from_image([pixel])[0] + 0.5) / 8
        exact = np.minimum(place, CELLS - place).min()
        # Beyond the edge the port bends more, and nobody asks how far it is.
        if exact > 0:
            assert clearance(shown, q, direction) == pytest.approx(exact, abs=REFRACTION_CELLS)
            compared += 1
    assert compared > 15


def test_a_mirror_seen_aslant_shows_less():
    """Ten degrees above the axis: in view of a gaze straight up, not of one 65 degrees down (aqua2's tilt limit)."""
    above = math.tan(math.radians(-10))
    shown = view()
    for tilt_deg, in_view in ((45, True), (-32.5, False)):
        tilt = math.radians(tilt_deg)
        direction = GIMBAL.from_gaze(0.0, tilt, 0.0, above)
        q = GIMBAL.joint_values(0.0, tilt)
        assert shown.shows_at(q, GIMBAL.in_gimbal(direction)[np.newaxis])[0] == in_view


def test_what_lies_behind_the_gaze_is_not_shown():
    assert clearance(view(), GIMBAL.joint_values(0.0, 0.0), [-1.0, 0.0, 0.0]) == -math.inf


def right_of(column):
    """A robot that covers the crop from a column on."""
    return np.arange(CELLS[0]) + 0.5 - column


def test_a_robot_hides_what_is_less_than_a_balls_half_beside_it():
    """A gaze ahead, the robot right of the crop's middle: 20 cells of about half a degree are left of it."""
    shown, q = view(right_of(20)), GIMBAL.joint_values(0.0, 0.0)
    ahead = np.array([1.0, 0.0, 0.0])
    assert clearance(shown, q, ahead) == pytest.approx(0.0, abs=1.0)
    left = [GIMBAL.from_gaze(0.0, 0.0, -math.tan(math.radians(angle)), 0.0) for angle in (1.0, 4.0)]
    share = shown.shown_at(q, GIMBAL.in_gimbal(np.array([ahead, *left])))
    assert share == pytest.approx([0.0, 2 / 3, 1.0], abs=0.3)
    assert 0 < share[1] < 1 == share[2]


def test_a_gaze_turns_aside_when_the_robot_is_in_its_middle():
    """The gaze goes to the right, so that the target stands left of the robot: by three cells, and no more."""
    shown, q = view(right_of(20)), GIMBAL.joint_values(0.0, 0.0)
    ahead = np.array([1.0, 0.0, 0.0])
    aside = shown.past_robot(q, ahead)
    assert shown.shows_at(aside, GIMBAL.in_gimbal(ahead)[np.newaxis])[0]
    off_deg = math.degrees(math.acos(GIMBAL.gaze(aside) @ ahead))
    assert 1.0 < off_deg < 4.0
    assert GIMBAL.gaze(aside)[1] < 0


def test_a_gaze_goes_where_most_is_left_between_bars():
    """Four cells are clear, six right of the crop's middle: with the target between the bars, two to each side are."""
    shown, q = view(np.abs(np.arange(CELLS[0]) + 0.5 - 26) - 2), GIMBAL.joint_values(0.0, 0.0)
    ahead = np.array([1.0, 0.0, 0.0])
    assert clearance(shown, q, ahead) < 0
    assert clearance(shown, shown.past_robot(q, ahead), ahead) == pytest.approx(2.0, abs=0.6)


@pytest.mark.parametrize("robot", [None, np.full(CELLS[0], 5.0)])
def test_a_gaze_with_nothing_in_its_middle_or_no_way_past_it_stays(robot):
    q = GIMBAL.joint_values(0.3, 0.1)
    np.testing.assert_array_equal(view(robot).past_robot(q, GIMBAL.gaze(q)), q)
