"""Where a target may be: beside densities, spreads and Bayes' rule by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from optics.layout import Layout
from rigs import Rig
from tracking.control.belief import (
    ANYWHERE,
    ELSEWHERE,
    FOUND,
    HOP_DEG,
    HOPS_PER_S,
    LEVEL_DEG,
    STILL_OR_MOVING,
    Belief,
    Directions,
    likely_directions,
)
from tracking.control.gaze_view import GazeView
from tracking.estimation.gimbal import Gimbal
from tracking.estimation.lines_of_sight import LinesOfSight
from tracking.perception import Crop, ExactCorners

RIG = Rig.load("aqua2")
GIMBAL = Gimbal(Layout.from_rig(RIG))
CORNERS = ExactCorners(RIG)
SHOWN = GazeView(GIMBAL, LinesOfSight(RIG), lambda q: Crop.of(CORNERS.corners(q)))
THERE = likely_directions(GIMBAL, SHOWN)
AHEAD = np.array([[1.0, 0.0, 0.0]])


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


def test_in_the_long_run_it_is_where_targets_are_often():
    """Also from one place; and there it stays, however long."""
    belief = Belief(THERE, SHOWN)
    belief.note_places(AHEAD, np.ones(1))
    belief.pass_time(3000.0)
    moving = belief.state[1]
    np.testing.assert_allclose(moving / moving.sum(), THERE.probability_later, rtol=1e-3)


def test_what_stands_still_stays_where_it_is():
    belief = Belief(THERE, SHOWN)
    belief.note_unseen(GIMBAL.middle)
    still = belief.state[0].copy()
    belief.pass_time(20.0)
    np.testing.assert_array_equal(belief.state[0], still)


def test_it_spreads_as_hops_at_random_do():
    """Over the whole sphere, where nothing is likelier: a hop within a disc goes half of its radius' square."""
    rng = np.random.default_rng(0)
    direction = rng.normal(size=(6000, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, np.newaxis]
    even = np.full(6000, 1 / 6000)
    there = Directions(direction=direction, solid_angle=4 * math.pi * even, probability=even, probability_later=even)
    belief = Belief(there, SHOWN)
    belief.note_places(AHEAD, np.ones(1))
    apart = np.degrees(np.arccos(direction @ AHEAD[0]))
    before = belief.state[1] @ apart**2
    belief.pass_time(3.0)
    grown = (belief.state[1] @ apart**2 - before) / (STILL_OR_MOVING[1] * (1 - ELSEWHERE))
    assert grown == pytest.approx(3 * HOPS_PER_S * HOP_DEG**2 / 2, rel=0.1)


def test_a_lost_target_is_where_it_can_have_gone_or_elsewhere():
    """One place ahead, and one straight down to the rear, beyond reach: it counts where that is nearest."""
    belief = Belief(THERE, SHOWN)
    down = np.array([[-math.cos(math.radians(80)), 0.0, -math.sin(math.radians(80))]])
    belief.note_places(np.vstack([AHEAD, down]), np.array([3.0, 1.0]))
    grown = belief.probability - ELSEWHERE * THERE.probability
    most = np.argsort(-grown)[:2]
    np.testing.assert_allclose(grown[most], [0.75 * (1 - ELSEWHERE), 0.25 * (1 - ELSEWHERE)])
    assert most.tolist() == [(THERE.direction @ each).argmax() for each in (AHEAD[0], down[0])]
