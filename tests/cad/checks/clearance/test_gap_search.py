"""The bounded search: closed forms, bounds that hold against brute force, and what it costs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cad.checks.clearance.gap_search import CLOSE_MM, CLOSEST_MM, Cell, smallest_gap

BOX = Cell.between(np.array([-1.0, -0.5]), np.array([2.0, 1.0]))


def cone(q0, slope):
    """A gap that grows in proportion to the turn away from `q0`, the steepest there can be."""
    return lambda q: 2.0 + float(np.abs(q - q0) @ slope)


@given(st.floats(-1, 2), st.floats(-0.5, 1), st.floats(1, 100), st.floats(1, 100))
@settings(max_examples=30)
def test_the_smallest_gap_of_a_cone_is_its_tip(q1, q2, r1, r2):
    """Closed form: the tip has 2 mm, whatever the slopes; with a limit just below it the bound closes in on 2 mm."""
    reach = np.array([r1, r2])
    found = smallest_gap(cone(np.array([q1, q2]), reach), BOX, reach, 1.95, 1.95)
    assert found.bound_mm >= 1.95
    assert found.bound_mm <= 2.0 <= found.gap_mm


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 3.0))
@settings(max_examples=30)
def test_the_bound_holds_everywhere(seed, limit):
    """Sums of cosines with slopes of at most the reach, against a grid of 40 000 joint values."""
    rng = np.random.default_rng(seed)
    frequency, phase = rng.uniform(0.5, 4, (3, 2)), rng.uniform(0, 6, 3)

    def gap(q):
        return 3.0 + np.cos(q @ frequency.T + phase).sum(axis=-1)

    reach = np.abs(frequency).sum(axis=0)
    found = smallest_gap(lambda q: max(float(gap(q)), 0.0), BOX, reach, limit, limit)
    grid = np.stack(np.meshgrid(np.linspace(-1, 2, 200), np.linspace(-0.5, 1, 200)), axis=-1)
    assert found.bound_mm <= gap(grid).min() + 1e-12
    assert found.gap_mm >= found.bound_mm
    if found.bound_mm < limit <= found.gap_mm:
        assert found.gap_mm - found.bound_mm <= CLOSEST_MM


def test_a_meeting_at_one_corner_is_found():
    """The gap is 0 within 0.02 rad of one corner only, which no 5 x 5 grid without the ends has; slope 50 mm/rad."""
    corner = np.array([2.0, 1.0])
    found = smallest_gap(
        lambda q: max(50 * (float(np.abs(q - corner).sum()) - 0.02), 0.0), BOX, np.array([50.0, 50.0]), 1.0, 1.0
    )
    assert found.gap_mm == 0.0
    assert np.abs(found.q - corner).sum() <= 0.02


def test_a_joint_that_does_not_matter_is_not_divided():
    found = smallest_gap(lambda q: 1.0 + abs(float(q[0])), BOX, np.array([1.0, 0.0]), 0.0, 0.0)
    assert found.q[1] == BOX.middle[1]
    assert found.gap_mm - found.bound_mm <= max(CLOSE_MM, 0.35 * found.gap_mm)


def test_a_wide_gap_costs_one_look():
    assert smallest_gap(lambda q: 100.0, BOX, np.array([10.0, 10.0]), 3.0, 3.0).poses == 1


def test_halves_make_up_the_cell():
    parts = list(BOX.halves(np.array([1.0, 10.0])))
    assert [part.half.tolist() for part in parts] == [[1.5, 0.375]] * 2
    assert np.mean([part.middle for part in parts], axis=0) == pytest.approx(BOX.middle)
