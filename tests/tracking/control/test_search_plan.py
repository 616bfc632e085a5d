"""The search that looks where a target is likely first: it sees everything, and sooner on average than a raster."""

from __future__ import annotations

import math

import numpy as np
import pytest

from optics.gaze.motion import JointSpeeds
from optics.layout import Layout
from rigs import Rig
from tracking.control.gaze_view import GazeView
from tracking.control.joint_paths import JointPath, raster_path
from tracking.control.search import OVERLAP, Search
from tracking.control.search_plan import (
    ANYWHERE,
    FOUND,
    LEVEL_DEG,
    Directions,
    first_seen_s,
    likely_directions,
    likely_paths,
    slowed,
)
from tracking.estimation.gimbal import Gimbal
from tracking.estimation.lines_of_sight import LinesOfSight
from tracking.perception import Crop, ExactCorners
from tracking.perception.robot_view import RobotView

RIG = Rig.load("aqua2")
GIMBAL = Gimbal(Layout.from_rig(RIG))
SPEEDS = JointSpeeds.from_rig(RIG)
VIEW = np.radians([22.0, 20.0])
STEP = (1 - OVERLAP) * VIEW
INTERVAL_S = 1 / 30
CORNERS = ExactCorners(RIG)


def gaze_view(robot_view: RobotView | None = None) -> GazeView:
    return GazeView(GIMBAL, LinesOfSight(RIG), lambda q: Crop.of(CORNERS.corners(q)), robot_view)


SHOWN = gaze_view()


@pytest.fixture(scope="module")
def there() -> Directions:
    return likely_directions(GIMBAL, SHOWN)


@pytest.fixture(scope="module")
def path() -> JointPath:
    return likely_paths(GIMBAL, SHOWN, STEP, SPEEDS, INTERVAL_S)[0]


def expected_s(path: JointPath, there: Directions) -> float:
    """Mean time to the first look at a target; one that is never looked at counts as twice the path's duration."""
    first = first_seen_s(path, there, SHOWN)
    return float(np.where(np.isfinite(first), first, 2 * path.duration_s) @ there.probability)


def test_what_is_within_reach_is_what_the_joints_get_to(there):
    """aqua2's gaze gets 65 degrees down, where its mirror, seen aslant, shows 2.5 degrees more (traced by hand)."""
    elevation = np.degrees(np.arcsin(there.direction[:, 2]))
    assert elevation.min() == pytest.approx(-65 - 2.5, abs=6)
    assert there.probability.sum() == pytest.approx(1.0)
    density = there.probability / there.solid_angle
    level, high = np.abs(elevation) < 4, np.abs(elevation - 2 * LEVEL_DEG) < 4
    expected = (ANYWHERE + np.exp(-2.0)) / (ANYWHERE + 1.0)
    assert density[high].mean() / density[level].mean() == pytest.approx(expected, rel=0.15)


def test_it_sees_everything(path, there):
    first = first_seen_s(path, there, SHOWN)
    assert there.probability[~np.isfinite(first)].sum() < 0.005


def test_it_takes_less_time_than_a_raster(path, there):
    """Expected 9 s instead of 16, from the middle of the joints' ranges to the first look at a target that stands."""
    raster = raster_path(GIMBAL, SPEEDS, STEP)
    begun = JointPath.through(np.vstack([GIMBAL.middle, raster.q]), SPEEDS)
    assert expected_s(path, there) < 0.75 * expected_s(begun, there)


def test_images_find_it_soon(path, there):
    """Each image finds it with probability 1/2; sweeps of one joint at a time needed 22 s for as much."""
    images = np.zeros(len(there.probability))
    for time_s in np.arange(0.0, 16.0, INTERVAL_S).tolist():
        images += SHOWN.shown_at(path.at(time_s), there.direction)
    assert (1 - FOUND**images) @ there.probability > 0.8
    assert (np.abs(np.diff(path.q, axis=0)) > 0).all(axis=1).any()


def test_a_target_ahead_is_in_view_soon_and_one_below_much_later(path, there):
    first = first_seen_s(path, there, SHOWN)
    ahead = there.direction @ [1.0, 0.0, 0.0] > np.cos(np.radians(8))
    below = there.direction[:, 2] < -0.85
    assert first[ahead].max() < np.median(first)
    assert first[below].min() > np.median(first)


def test_a_search_begins_again_at_its_beginning(path):
    search = Search(GIMBAL, SPEEDS, VIEW, likely=SHOWN)
    search.begin(GIMBAL.middle)
    seen = np.array([search.advance(0.1, GIMBAL.middle) for _ in range(round(path.duration_s / 0.1) + 60)])
    np.testing.assert_allclose(seen[0], path.at(0.1), atol=1e-9)
    # The last command of the path, the way back to its beginning, and the path again.
    assert (np.abs(np.diff(seen, axis=0)).max(axis=1) <= 0.1 * SPEEDS.pan + 1e-9).sum() >= len(seen) - 2
    assert any(np.allclose(each, path.q[0], atol=0.11) for each in seen[-60:])


def test_only_the_first_search_goes_ahead_first():
    """What was lost elsewhere, or not found ahead, is as likely anywhere about the robot."""
    first, again = likely_paths(GIMBAL, SHOWN, STEP, SPEEDS, INTERVAL_S)
    search = Search(GIMBAL, SPEEDS, VIEW, likely=SHOWN)
    for planned in (first, again, again):
        search.begin(GIMBAL.middle)
        asked = [search.advance(0.1, GIMBAL.middle) for _ in range(50)]
        np.testing.assert_allclose(asked, [planned.at(0.1 * (each + 1)) for each in range(50)], atol=1e-9)


def test_a_fast_servo_sweeps_so_that_images_show_what_it_passes():
    """By hand: half of 18 degrees in each of 30 images a second is 270 degrees/s of pan, and half of that of tilt."""
    step = np.radians([18.0, 18.0])
    sweeping = slowed(JointSpeeds(pan=math.radians(300), tilt=math.radians(300)), step, INTERVAL_S)
    assert np.degrees([sweeping.pan, sweeping.tilt]) == pytest.approx([270, 135])
    sweeping = slowed(JointSpeeds(pan=math.radians(60), tilt=math.radians(60)), step, INTERVAL_S)
    assert np.degrees([sweeping.pan, sweeping.tilt]) == pytest.approx([60, 60])


def test_where_the_robot_is_seen_nothing_is_searched():
    """A robot that fills the crop over the zenith: of a gaze to the back nothing is left, of those ahead all."""
    q1, q2 = (np.array([low, high]) for low, high in zip(GIMBAL.lowest, GIMBAL.highest, strict=True))
    tilts = np.linspace(*q2, 101)
    depth = np.where(tilts > math.radians(45), 5.0, -40.0)[:, np.newaxis, np.newaxis] * np.ones((30, 40))
    hidden = RobotView(q1=q1, q2=tilts, depth=np.stack([depth, depth]).astype(np.float16))
    shown = gaze_view(hidden)
    there = likely_directions(GIMBAL, shown)
    azimuth = np.degrees(np.arctan2(there.direction[:, 1], there.direction[:, 0]))
    level = np.abs(there.direction[:, 2]) < 0.2
    assert np.abs(azimuth[level]).max() < 77.5 + 12
    path = likely_paths(GIMBAL, shown, STEP, SPEEDS, INTERVAL_S)[0]
    assert np.isfinite(first_seen_s(path, there, shown)).mean() > 0.95
    # Half of the range, and not twice as long as a search of all of it.
    assert path.duration_s < 40
