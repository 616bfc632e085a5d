"""Searches of everything: likely places first sees all, and sooner on average than a raster."""

from __future__ import annotations

import math

import numpy as np
import pytest

from optics.gaze.motion import JointSpeeds
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from rigs import Rig
from tracking.control.belief import FOUND, likely_directions
from tracking.control.everywhere import LikelyFirst
from tracking.control.gaze_view import GazeView
from tracking.control.joint_paths import JointPath, raster_path
from tracking.control.search import OVERLAP
from tracking.control.search_plan import slowed
from tracking.estimation.bearing import Bearing
from tracking.estimation.gimbal import Gimbal
from tracking.estimation.lines_of_sight import LinesOfSight
from tracking.estimation.lost_places import LostPlaces
from tracking.perception import Crop, ExactCorners
from tracking.perception.robot_view import RobotView

RIG = Rig.load("aqua2")
GIMBAL = Gimbal(Layout.from_rig(RIG))
SPEEDS = JointSpeeds.from_rig(RIG)
STEP = (1 - OVERLAP) * np.radians([22.0, 20.0])
INTERVAL_S = 1 / 30
CORNERS = ExactCorners(RIG)
SEARCHED_S = 60.0


def gaze_view(robot_view: RobotView | None = None) -> GazeView:
    return GazeView(GIMBAL, LinesOfSight(RIG), lambda q: Crop.of(CORNERS.corners(q)), robot_view)


SHOWN = gaze_view()
THERE = likely_directions(GIMBAL, SHOWN)


def searching(view: GazeView = SHOWN) -> LikelyFirst:
    return LikelyFirst(GIMBAL, SPEEDS, STEP, view, INTERVAL_S)


def gazes(search: LikelyFirst, seconds: float, q: FloatArray = GIMBAL.middle) -> FloatArray:
    """Joint values of a search that finds nothing, by servos that are where they are asked to be, shape (n, 2)."""
    asked = [q]
    search.begin(q)
    for _ in range(round(seconds / INTERVAL_S)):
        search.pass_time(INTERVAL_S)
        search.note_unseen(asked[-1])
        asked.append(search.advance(INTERVAL_S, asked[-1]))
    return np.array(asked)


def first_seen_s(asked: FloatArray, direction: FloatArray, view: GazeView = SHOWN) -> FloatArray:
    """When joint values first show each direction well enough to be looked at; infinite where never."""
    shows = np.array([view.shows_at(q, direction) for q in asked])
    return np.where(shows.any(axis=0), shows.argmax(axis=0) * INTERVAL_S, np.inf)


@pytest.fixture(scope="module")
def searched() -> FloatArray:
    return gazes(searching(), SEARCHED_S)


def test_it_sees_everything(searched):
    first = first_seen_s(searched, THERE.direction)
    assert THERE.probability[~np.isfinite(first)].sum() < 0.005
    assert THERE.solid_angle[first < 30].sum() > 0.8 * THERE.solid_angle.sum()


def test_it_takes_less_time_than_a_raster(searched):
    """From the middle of the joints' ranges to the first look at a target that stands still."""
    raster = raster_path(GIMBAL, SPEEDS, STEP)
    begun = JointPath.through(np.vstack([GIMBAL.middle, raster.q]), SPEEDS)
    times_s = np.arange(0.0, begun.duration_s, INTERVAL_S).tolist()
    likely, strips = (
        np.minimum(first_seen_s(asked, THERE.direction), SEARCHED_S) @ THERE.probability
        for asked in (searched, np.array([begun.at(time_s) for time_s in times_s]))
    )
    assert likely < 0.75 * strips


def test_images_find_it_soon(searched):
    """Each image finds it with probability 1/2; sweeps of one joint at a time needed 22 s for as much."""
    images = np.zeros(len(THERE.probability))
    for q in searched[: round(16 / INTERVAL_S)]:
        images += SHOWN.shown_at(q, THERE.direction)
    assert (1 - FOUND**images) @ THERE.probability > 0.8
    assert (np.abs(np.diff(searched, axis=0)) > 1e-3).all(axis=1).any()


def test_a_target_ahead_is_in_view_soon_and_one_below_much_later(searched):
    first = first_seen_s(searched, THERE.direction)
    ahead = THERE.direction @ [1.0, 0.0, 0.0] > np.cos(np.radians(8))
    below = THERE.direction[:, 2] < -0.85
    assert first[ahead].max() < np.median(first)
    assert first[below].min() > np.median(first)


def test_servos_can_follow_it(searched):
    """Sweep after sweep, no jump: a turn at an end is no longer than the images are apart."""
    most = np.array([SPEEDS.pan, SPEEDS.tilt]) * INTERVAL_S
    assert (np.abs(np.diff(searched, axis=0)) <= most + 1e-9).all()


def test_what_was_looked_at_is_looked_at_again(searched):
    """Straight ahead is seen three times and more in a minute, seconds apart."""
    ahead = np.array([SHOWN.shows_at(q, np.array([[1.0, 0.0, 0.0]]))[0] for q in searched])
    seen = np.flatnonzero(ahead)
    assert (np.diff(seen) * INTERVAL_S > 2.0).sum() >= 2


def test_it_goes_on_where_a_lost_target_can_have_gone():
    """To the left and 45 degrees up, from a search that would look ahead: within what the servos need, and 2 s."""
    bearing = Bearing(direction=np.array([0.0, 1.0, 1.0]) / math.sqrt(2), rate=np.zeros(3))
    there = GIMBAL.in_gimbal(bearing.direction)[np.newaxis]
    search = searching()
    search.note_lost(
        LostPlaces(direction=there, weight=np.ones(1), radius=np.zeros(1), hidden_at=there[0], bearing=bearing)
    )
    assert first_seen_s(gazes(search, 5.0), there)[0] < 3.0


def test_it_is_broken_off_and_goes_on_without_what_it_has_looked_at():
    """Half a second later, from the same place, it does not begin as at first."""
    search = searching()
    begun = gazes(search, 4.0)
    search.pass_time(0.5)
    assert np.abs(gazes(search, 4.0) - begun).max() > math.radians(20)


def test_it_goes_on_from_a_snapshot():
    whole = searching()
    gazes(whole, 2.0)
    resumed = searching()
    resumed.restore(whole.snapshot())
    for _ in range(60):
        np.testing.assert_array_equal(*(each.advance(INTERVAL_S, GIMBAL.middle) for each in (whole, resumed)))


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
    depth = np.where(tilts > math.radians(45), 40, -120)[:, np.newaxis, np.newaxis] * np.ones((60, 80))
    hidden = RobotView(q1=q1, q2=tilts, depth=np.stack([depth, depth]).astype(np.int8))
    shown = gaze_view(hidden)
    there = likely_directions(GIMBAL, shown)
    azimuth = np.degrees(np.arctan2(there.direction[:, 1], there.direction[:, 0]))
    level = np.abs(there.direction[:, 2]) < 0.2
    assert np.abs(azimuth[level]).max() < 77.5 + 12
    asked = gazes(searching(shown), 20.0)
    assert there.probability[np.isfinite(first_seen_s(asked, there.direction, shown))].sum() > 0.95
