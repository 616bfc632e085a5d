"""Where a target may be: beside densities, spreads and Bayes' rule by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from rigs import Rig
from tracking.control.belief import (
    ANYWHERE,
    CELL_DEG,
    ELSEWHERE,
    FOUND,
    HOP_DEG,
    HOPS_PER_S,
    LEVEL_DEG,
    LOST_LEVEL_DEG,
    LOST_STILL_OR_MOVING,
    STILL_OR_MOVING,
    TURNED_S,
    Belief,
    Directions,
    likely_directions,
)
from tracking.control.gaze_view import GazeView
from tracking.estimation.bearing import Bearing
from tracking.estimation.clutter import ClutterPlace
from tracking.estimation.gimbal import Gimbal
from tracking.estimation.lines_of_sight import LinesOfSight
from tracking.estimation.lost_places import LostPlaces
from tracking.perception import Crop, ExactCorners

RIG = Rig.load("aqua2")
GIMBAL = Gimbal(Layout.from_rig(RIG))
CORNERS = ExactCorners(RIG)
SHOWN = GazeView(GIMBAL, LinesOfSight(RIG), lambda q: Crop.of(CORNERS.corners(q)))
THERE = likely_directions(GIMBAL, SHOWN)
AHEAD = np.array([[1.0, 0.0, 0.0]])


def even(directions: int) -> Directions:
    """All of the sphere, nowhere likelier: on a spiral, as far apart everywhere."""
    place = np.arange(directions) + 0.5
    z, around = 1 - 2 * place / directions, math.pi * (1 + math.sqrt(5)) * place
    direction = np.stack([np.sqrt(1 - z**2) * np.cos(around), np.sqrt(1 - z**2) * np.sin(around), z], axis=-1)
    each = np.full(directions, 1 / directions)
    return Directions(
        direction=direction, solid_angle=4 * math.pi * each, elevation=np.zeros(directions), probability=each
    )


EVEN = even(4000)


def test_what_is_within_reach_is_what_the_joints_get_to():
    """aqua2's gaze gets 65 degrees down, where its mirror, seen aslant, shows 2.5 degrees more (traced by hand)."""
    elevation = np.degrees(np.arcsin(THERE.direction[:, 2]))
    assert elevation.min() == pytest.approx(-65 - 2.5, abs=6)
    assert THERE.probability.sum() == pytest.approx(1.0)
    density = THERE.probability / THERE.solid_angle
    level, high = np.abs(elevation) < 4, np.abs(elevation - 2 * LEVEL_DEG) < 4
    expected = (ANYWHERE + np.exp(-2.0)) / (ANYWHERE + 1.0)
    assert density[high].mean() / density[level].mean() == pytest.approx(expected, rel=0.15)


def test_an_image_without_the_target_counts_by_bayes_rule():
    """What it shows is told in single precision."""
    belief, shown = Belief(THERE, SHOWN), SHOWN.shown_at(GIMBAL.joint_values(0.0, 0.0), THERE.direction)
    assert shown.max() == 1
    belief.note_unseen(GIMBAL.joint_values(0.0, 0.0))
    unseen = THERE.probability * (1 - FOUND * shown)
    np.testing.assert_allclose(belief.probability, unseen / (1 - FOUND * shown @ THERE.probability), rtol=1e-7)


def test_a_sweep_that_has_ended_has_looked_at_what_it_was_to_show():
    """Also where no image did: else what only a hair's breadth shows is swept again and again. Not twice, though."""
    belief, found = Belief(THERE, SHOWN), np.zeros(len(THERE.direction))
    found[:2] = 0.8, 0.3
    belief.note_swept(found)
    left = THERE.probability * (1 - found)
    np.testing.assert_allclose(belief.probability, left / left.sum(), rtol=1e-12)
    belief.note_unseen(GIMBAL.middle)
    seen = belief.probability
    belief.note_swept(1 - belief.missed)
    np.testing.assert_allclose(belief.probability, seen, rtol=1e-12)


def test_what_was_dropped_is_the_target_with_its_probability_and_moves_on():
    belief = Belief(THERE, SHOWN)
    belief.note_dropped(AHEAD[0], 0.4)
    nearest = (THERE.direction @ AHEAD[0]).argmax()
    expected = 0.6 * THERE.probability
    expected[nearest] += 0.4
    np.testing.assert_allclose(belief.probability, expected)
    belief.pass_time(1.0)
    assert belief.probability.sum() == pytest.approx(1.0)
    assert belief.probability[nearest] < 0.2


def test_images_tell_nothing_of_what_is_passed_by():
    """Nor of half a cell about it. What is farther from it was looked at five times, as far as the view shows it."""
    belief = Belief(THERE, SHOWN)
    belief.note_dropped(AHEAD[0], 0.4)
    level = GIMBAL.joint_values(0.0, 0.0)
    clutter = [ClutterPlace(direction=AHEAD[0], within_rad=math.radians(3.0), until_s=math.inf)]
    before = belief.probability
    for _ in range(5):
        belief.note_unseen(level, clutter)
    about = THERE.direction @ AHEAD[0] > math.cos(math.radians(3.0 + CELL_DEG / 2))
    shown = np.where(about, 0.0, SHOWN.shown_at(level, THERE.direction))
    assert about.sum() >= 1
    assert shown.max() > 0.4
    gained = belief.probability / before
    np.testing.assert_allclose(gained / gained[about][0], (1 - FOUND * shown) ** 5, rtol=1e-5)


def test_in_the_long_run_it_is_where_targets_are_often():
    """Of which nothing else is known: what was ahead at first no longer is."""
    belief = Belief(THERE, SHOWN)
    belief.pass_time(3000.0)
    moving = belief.state[1, 0]
    often = (ANYWHERE + np.exp(-0.5 * (THERE.elevation / math.radians(LEVEL_DEG)) ** 2)) * THERE.solid_angle
    np.testing.assert_allclose(moving / moving.sum(), often / often.sum(), rtol=1e-3)


def test_in_the_long_run_what_was_lost_is_about_as_high_as_it_was():
    """30 degrees up, anywhere about the robot; and there it stays, however long."""
    belief = Belief(THERE, SHOWN)
    belief.note_lost(lost(AHEAD, elevation_deg=30.0, deg_per_s=10.0))
    belief.pass_time(3000.0)
    moving = belief.state[1, 0]
    off = (THERE.elevation - math.radians(30.0)) / math.radians(LOST_LEVEL_DEG)
    often = (ANYWHERE + np.exp(-0.5 * off**2)) * THERE.solid_angle
    np.testing.assert_allclose(moving / moving.sum(), often / often.sum(), rtol=1e-3)


def test_what_stands_still_stays_where_it_is():
    belief = Belief(THERE, SHOWN)
    belief.note_unseen(GIMBAL.middle)
    still = belief.state[0, 0].copy()
    belief.pass_time(20.0)
    np.testing.assert_array_equal(belief.state[0, 0], still)


def test_one_that_nobody_has_seen_spreads_as_hops_at_random_do():
    """A hop within a disc goes half of its radius' square."""
    assert way_of_unseen_deg2(1.0) == pytest.approx(HOPS_PER_S * HOP_DEG**2 / 2, rel=0.1)


@pytest.mark.parametrize("deg_per_s", [5.0, 10.0, 15.0])
def test_what_was_lost_spreads_as_fast_as_it_went(deg_per_s):
    """2 v^2 times the time after which the velocity has changed, each second; beside hops on the same cells."""
    belief, apart = Belief(EVEN, SHOWN), apart_deg(AHEAD[0])
    belief.note_lost(lost(AHEAD, deg_per_s=deg_per_s))
    before = belief.state[1, 0] @ apart**2
    belief.pass_time(0.5)
    way = (belief.state[1, 0] @ apart**2 - before) / (LOST_STILL_OR_MOVING[1] * (1 - ELSEWHERE))
    expected = deg_per_s**2 * TURNED_S / (HOPS_PER_S * HOP_DEG**2 / 2)
    assert way == pytest.approx(expected * way_of_unseen_deg2(1.0), rel=0.05)


def test_it_goes_on_from_a_snapshot():
    """Also as what was lost does."""
    whole, resumed = Belief(THERE, SHOWN), Belief(THERE, SHOWN)
    whole.note_lost(lost(AHEAD, deg_per_s=20.0, radius_deg=15.0))
    whole.note_unseen(GIMBAL.middle)
    resumed.restore(whole.snapshot())
    for each in (whole, resumed):
        each.pass_time(1.0)
        each.note_swept(np.full(len(THERE.direction), 0.1))
    np.testing.assert_array_equal(whole.state, resumed.state)


def test_a_lost_target_is_where_it_can_have_gone_or_elsewhere():
    """One place ahead, and one straight down to the rear, beyond reach: it counts where that is nearest."""
    belief = Belief(THERE, SHOWN)
    down = np.array([[-math.cos(math.radians(80)), 0.0, -math.sin(math.radians(80))]])
    belief.note_lost(lost(np.vstack([AHEAD, down]), weight=(3.0, 1.0)))
    grown = belief.probability - ELSEWHERE * THERE.probability
    most = np.argsort(-grown)[:2]
    np.testing.assert_allclose(grown[most], [0.75 * (1 - ELSEWHERE), 0.25 * (1 - ELSEWHERE)])
    assert most.tolist() == [(THERE.direction @ each).argmax() for each in (AHEAD[0], down[0])]


@pytest.mark.parametrize(("radius_deg", "left"), [(0.0, 0.0), (25.0, 1.0)])
def test_images_take_nothing_from_where_something_may_hide_it(radius_deg, left):
    """Thirty of where it was lost, 10 degrees from the edge of what hides it there."""
    belief, q = Belief(THERE, SHOWN), GIMBAL.joint_values(0.0, 0.0)
    belief.note_lost(lost(AHEAD, radius_deg=radius_deg))
    for _ in range(30):
        belief.note_unseen(q)
    ahead = (THERE.direction @ AHEAD[0]).argmax()
    assert belief.probability[ahead] == pytest.approx(left, abs=0.12)
    assert belief.probability_in_the_open[ahead] < 0.01


def test_what_is_hidden_comes_out():
    """At the edge: within a second of one that goes 5 degrees/s, more is in the open there than anywhere else."""
    belief = Belief(THERE, SHOWN)
    belief.note_lost(lost(AHEAD, deg_per_s=5.0, radius_deg=15.0))
    before = belief.probability_in_the_open
    belief.pass_time(3.0)
    apart = np.degrees(np.arccos(np.clip(THERE.direction @ AHEAD[0], -1.0, 1.0)))
    come_out = belief.probability_in_the_open - before
    assert come_out[apart < 15].max() < 1e-3
    assert 15 < apart[come_out.argmax()] < 30
    assert come_out[(apart > 15) & (apart < 30)].sum() > 0.05


def lost(direction, *, weight=(1.0,), radius_deg=0.0, elevation_deg=0.0, deg_per_s=0.0) -> LostPlaces:
    """Places in the gimbal's frame of one that was ahead, so high, and went to the left."""
    up = math.radians(elevation_deg)
    return LostPlaces(
        direction=direction,
        weight=np.array(weight),
        radius=np.full(len(direction), math.radians(radius_deg)),
        hidden_at=AHEAD[0],
        bearing=Bearing(
            direction=np.array([math.cos(up), 0.0, math.sin(up)]), rate=np.array([0.0, math.radians(deg_per_s), 0.0])
        ),
    )


def apart_deg(direction: FloatArray) -> FloatArray:
    """How far each direction of the whole sphere is from one, degrees."""
    return np.degrees(np.arccos(np.clip(EVEN.direction @ direction, -1.0, 1.0)))


def way_of_unseen_deg2(seconds: float) -> float:
    """Mean square way of one that nobody has seen, from one place ahead, degrees squared."""
    belief, apart = Belief(EVEN, SHOWN), apart_deg(AHEAD[0])
    belief.state[:, 0] = np.outer(STILL_OR_MOVING, np.arange(len(apart)) == apart.argmin())
    belief.pass_time(seconds)
    return float(belief.state[1, 0] @ apart**2) / STILL_OR_MOVING[1]
