"""Where a lost target is sought: where it can have gone, not where images have shown that it is not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from optics.gaze.motion import JointSpeeds
from optics.layout import Layout
from rigs import Rig
from tracking.control.gaze_view import GazeView
from tracking.control.lost_target import GIVEN_UP_S, LostTarget
from tracking.control.poses import in_view
from tracking.control.search import OVERLAP, Search
from tracking.estimation.bearing import Bearing, Sight
from tracking.estimation.gimbal import Gimbal
from tracking.estimation.lines_of_sight import LinesOfSight
from tracking.perception import Crop, ExactCorners
from tracking.perception.robot_view import RobotView

RIG = Rig.load("aqua2")
GIMBAL = Gimbal(Layout.from_rig(RIG))
SPEEDS = JointSpeeds.from_rig(RIG)
VIEW = np.radians([22.0, 17.0])
STEP = (1 - OVERLAP) * VIEW
INTERVAL_S = 1 / 30
CORNERS = ExactCorners(RIG)
SHOWN = GazeView(GIMBAL, LinesOfSight(RIG), lambda q: Crop.of(CORNERS.corners(q)))


def direction(azimuth_deg, elevation_deg):
    azimuth, elevation = math.radians(azimuth_deg), math.radians(elevation_deg)
    level = math.cos(elevation)
    return np.array([level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation)])


def last_seen(azimuth_deg, elevation_deg, rate_deg_per_s):
    """A target that went round to the left when it was last seen."""
    there = direction(azimuth_deg, elevation_deg)
    return Bearing(direction=there, rate=math.radians(rate_deg_per_s) * np.cross([0.0, 0.0, 1.0], there))


def sight(*last, hidden=False):
    """The same, at time 0."""
    return Sight(bearing=last_seen(*last), time_s=0.0, hidden=hidden)


def found_after_s(searched, truth, q, longest_s=20.0, images=3):
    """When some images running have the target in view, of servos that turn at their speed; None when never."""
    seen = 0
    for image in range(round(longest_s / INTERVAL_S)):
        there = GIMBAL.in_gimbal(truth(image * INTERVAL_S))[np.newaxis]
        seen = seen + 1 if in_view(GIMBAL, q, there, STEP)[0] else 0
        if seen == images:
            return image * INTERVAL_S
        most = np.array([SPEEDS.pan, SPEEDS.tilt]) * INTERVAL_S
        q = q + np.clip(searched.advance(INTERVAL_S, q) - q, -most, most)
    return None


@pytest.mark.parametrize(
    ("turned_to_deg", "soonest"),
    [
        # Last seen at 10 degrees, 20 degrees/s to the left, 1 s ago: it is where it was expected, has stopped
        # or has turned back.
        ((30, 0), 0.5),
        ((10, 0), 1.5),
        ((-10, 0), 2.0),
    ],
)
def test_what_a_lost_target_can_have_done_is_looked_at_soon(turned_to_deg, soonest):
    search = Search(GIMBAL, SPEEDS, VIEW, likely=SHOWN)
    search.begin_lost(sight(10, 0, 20), 1.0)
    begin = GIMBAL.joint_values(math.radians(30), 0.0)
    assert found_after_s(search, lambda time_s: direction(*turned_to_deg), begin) < soonest


@pytest.mark.parametrize(("hidden_s", "images", "soonest"), [(1.0, 3, 1.0), (3.0, 1, 4.0), (6.0, 1, 6.0)])
def test_what_comes_out_from_behind_something_is_met_where_it_went_in(hidden_s, images, soonest):
    """It was hidden while it stood: the places that did not show it are looked at again.

    Soon and for three images while it is sought there alone, in passing afterwards; the median of 13 azimuths.
    """
    found_s = []
    for azimuth in range(-60, 61, 10):
        search = Search(GIMBAL, SPEEDS, VIEW, likely=SHOWN)
        search.begin_lost(sight(azimuth, 0, 0), 1.0)
        hidden, shown = direction(180, -80), direction(azimuth, 0)
        truth = lambda time_s, hidden=hidden, shown=shown: shown if time_s > hidden_s else hidden  # noqa: E731
        found = found_after_s(search, truth, GIMBAL.joint_values(math.radians(azimuth), 0.0), images=images)
        found_s.append(math.inf if found is None else found - hidden_s)
    assert np.median(found_s) < soonest


@pytest.mark.parametrize("turning", [0.1, 0.5, 0.9])
def test_what_turns_often_has_come_back_further(turning):
    """Lost two seconds ago at 0 degrees, going left at 40 degrees/s, it is at 80 by now, unless it has turned.

    That it has done at any time of 3 s alike, and keeps -1 to 0.5 of its rate, -0.25 in the mean: in the mean it went
    on for 2/3 * 1 + 1/3 * 2 = 4/3 s, and is where 4/3 - 0.25 * 2/3 s have taken it.
    """
    search = LostTarget(GIMBAL, SPEEDS, STEP, last_seen(0, 0, 40), 2.0, turning=turning)
    places = search.places
    azimuth_deg = np.degrees(np.arctan2(places.direction[:, 1], places.direction[:, 0]))
    assert places.weight.sum() == pytest.approx(len(places.weight))
    turned_s = 4 / 3 - 0.25 * 2 / 3
    expected_deg = 40 * (turning * turned_s + (1 - turning) * 2.0)
    assert np.average(azimuth_deg, weights=places.weight) == pytest.approx(expected_deg, abs=1.5)
    again = LostTarget.restored(search.snapshot(), GIMBAL, SPEEDS, STEP)
    for each in (search, again):
        each.note_unseen(GIMBAL.middle, 10.0)
    np.testing.assert_array_equal(again.places.weight, search.places.weight)


def test_a_gaze_leaves_what_it_has_seen_without_the_target():
    """The first gaze is where the target was expected; a second later pan or tilt has gone to see elsewhere."""
    lost = LostTarget(GIMBAL, SPEEDS, STEP, last_seen(0, 0, 0), 0.5)
    first = lost.next_pose(GIMBAL.middle, 0.0)
    np.testing.assert_allclose(GIMBAL.gaze(first), [1, 0, 0], atol=0.15)
    later = []
    for _ in range(30):
        lost.pass_time(INTERVAL_S)
        later.append(lost.next_pose(first, INTERVAL_S))
    assert max(math.acos(GIMBAL.gaze(each) @ GIMBAL.gaze(first)) for each in later) > STEP[1] / 2


def test_images_count_while_it_is_waited_for_where_it_is_predicted():
    """A second of images of where it should have gone on to all but rules out most places, not those far from there."""
    search = Search(GIMBAL, SPEEDS, VIEW, likely=SHOWN)
    search.begin_lost(sight(10, 0, 30), 0.0)
    for image in range(30):
        search.pause(INTERVAL_S, found=False)
        search.note_unseen(INTERVAL_S, GIMBAL.joint_values(math.radians(10 + 30 * image * INTERVAL_S), 0.0))
    weights = search.snapshot()["lost"]["weights"]
    assert np.median(weights) < 0.05
    assert max(weights) > 0.1


def test_what_something_may_hide_is_not_counted_as_seen():
    """Ten images of where a target was that stands still: places that something may hide keep their weight.

    In that third of a second all of them are within the smallest radius, 8 degrees.
    """
    search = LostTarget(GIMBAL, SPEEDS, STEP, last_seen(10, 0, 0), 0.0, hidden=True)
    q = GIMBAL.joint_values(math.radians(10), 0.0)
    for _ in range(10):
        search.note_unseen(q, INTERVAL_S)
    places = search.places
    kept = places.weight > 0.9
    assert not kept[places.radius == 0].any()
    assert kept[places.radius > 0].all()


def test_what_is_hidden_is_waited_for_around_what_hides_it():
    """Behind a disc of 24 degrees, crossed in 6 s: found in less than 0.7 of the time of one sought as if it had gone.

    In the mean of five azimuths, at most 20 s each.
    """

    def mean_s(hidden):
        took = []
        for azimuth in range(-60, 61, 30):
            search = Search(GIMBAL, SPEEDS, VIEW, likely=SHOWN)
            search.begin_lost(sight(azimuth, 0, 4, hidden=hidden), 0.0)
            behind, begin = direction(180, -80), GIMBAL.joint_values(math.radians(azimuth), 0.0)
            truth = lambda time_s, azimuth=azimuth, behind=behind: (  # noqa: E731
                direction(azimuth + 4 * time_s, 0) if time_s > 6 else behind
            )
            found = found_after_s(search, truth, begin, longest_s=26, images=1)
            took.append(20 if found is None else found - 6)
        return np.mean(took)

    assert mean_s(hidden=True) < 0.7 * mean_s(hidden=False)


@pytest.mark.parametrize(("depth_px", "kept"), [(-100, 0.02), (100, 1.0)])
def test_what_the_robot_hides_is_not_counted_as_seen(depth_px, kept):
    """Ten images that show the water, or only the robot, where a target was that stands still."""
    q1, q2 = (np.array([low, high]) for low, high in zip(GIMBAL.lowest, GIMBAL.highest, strict=True))
    robot = RobotView(q1=q1, q2=q2, depth=np.full((2, 2, 60, 80), depth_px, dtype=np.int8))
    shown = GazeView(GIMBAL, LinesOfSight(RIG), lambda q: Crop.of(CORNERS.corners(q)), robot)
    search = LostTarget(GIMBAL, SPEEDS, STEP, last_seen(10, 0, 0), 0.0, shown=shown)
    q = GIMBAL.joint_values(math.radians(10), 0.0)
    for _ in range(10):
        search.note_unseen(q, INTERVAL_S)
    assert np.median(search.snapshot()["weights"]) == pytest.approx(kept, abs=0.04)


def test_after_a_while_everything_is_searched_about_where_it_can_have_gone():
    """Lost 60 degrees to the left, where it stood: what is ahead, and is looked at first else, waits."""
    search = Search(GIMBAL, SPEEDS, VIEW, likely=SHOWN)
    search.begin(GIMBAL.middle)
    search.begin_lost(sight(60, 20, 0), GIVEN_UP_S)
    assert found_after_s(search, lambda _: direction(60, 20), GIMBAL.middle, images=1) < 2.0
    ahead = Search(GIMBAL, SPEEDS, VIEW, likely=SHOWN)
    ahead.begin(GIMBAL.middle)
    assert found_after_s(ahead, lambda _: direction(60, 20), GIMBAL.middle, images=1) > 3.0


@pytest.mark.parametrize("last", [(0, 60, 10), (-75, 62, 8), (40, 10, 15), (-60, -10, 0)])
def test_a_search_goes_on_from_every_pose(last):
    """What a pose was looked at for is gone once images have shown it: no gaze stays for a second without a target."""
    search = Search(GIMBAL, SPEEDS, VIEW, likely=SHOWN)
    search.begin_lost(sight(*last), 0.0)
    q, stayed, longest = GIMBAL.middle, 0, 0
    for _ in range(round(10 / INTERVAL_S)):
        most = np.array([SPEEDS.pan, SPEEDS.tilt]) * INTERVAL_S
        step = np.clip(search.advance(INTERVAL_S, q) - q, -most, most)
        stayed = stayed + 1 if np.allclose(step, 0, atol=1e-6) else 0
        q, longest = q + step, max(longest, stayed)
    assert longest * INTERVAL_S < 1.0
