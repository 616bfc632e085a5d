"""Where a target will be: along its great circle, and swaying about it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tracking.estimation.bearing import Bearing, SwayingBearing
from tracking.estimation.sway import Sway

TURNS = st.integers(0, 2**32 - 1).map(lambda seed: Rotation.random(random_state=seed))


def swaying(turn: Rotation, speed: float) -> SwayingBearing:
    """A bearing 3 degrees beside its path, to which it is on its way back."""
    path = Bearing(direction=turn.apply([1.0, 0.0, 0.0]), rate=turn.apply([0.0, speed, 0.0]))
    return SwayingBearing.about(path, turn.apply([0.0, 0.02, 0.05]), turn.apply([0.0, 0.0, -0.04]), Sway())


@given(TURNS, st.floats(0.0, 3.0), st.floats(0.0, 2.0))
def test_a_bearing_runs_along_its_great_circle(turn, speed, seconds):
    bearing = Bearing(direction=turn.apply([1.0, 0.0, 0.0]), rate=turn.apply([0.0, speed, 0.0]))
    later = bearing.after(seconds)
    angle = speed * seconds
    np.testing.assert_allclose(later.direction, turn.apply([math.cos(angle), math.sin(angle), 0.0]), atol=1e-14)
    np.testing.assert_array_equal(bearing.directions_after([0.0, seconds]), [bearing.direction, later.direction])
    assert later.rate @ later.direction == pytest.approx(0, abs=1e-14)
    assert np.linalg.norm(later.rate) == pytest.approx(speed, abs=1e-14)


@given(TURNS, st.floats(0.0, 1.0), st.floats(0.0, 2.0), st.floats(0.0, 2.0))
def test_one_that_sways_goes_on_in_one_step_as_in_two(turn, speed, first_s, then_s):
    bearing = swaying(turn, speed)
    at_once, in_two = bearing.after(first_s + then_s), bearing.after(first_s).after(then_s)
    for one, other in ((at_once.direction, in_two.direction), (at_once.rate, in_two.rate)):
        np.testing.assert_allclose(one, other, atol=1e-12)
    np.testing.assert_allclose(
        bearing.directions_after([first_s, first_s + then_s]),
        [bearing.after(first_s).direction, at_once.direction],
        atol=1e-12,
    )


def test_its_rate_is_that_of_its_direction():
    """By central differences, through a swing."""
    bearing, step = swaying(Rotation.identity(), 0.3), 1e-5
    for seconds in np.linspace(0.1, 6, 20):
        before, after = bearing.directions_after([seconds - step, seconds + step])
        # Path and sway are added before the sum is brought to the sphere: 0.05 rad of sway change its rate by 1 %.
        np.testing.assert_allclose(bearing.after(seconds).rate, (after - before) / (2 * step), atol=3e-3)


def test_its_sway_dies_away():
    bearing = swaying(Rotation.identity(), 0.1)
    apart = np.linalg.norm(bearing.after(30.0).direction - bearing.path.after(30.0).direction)
    assert np.linalg.norm(bearing.direction - bearing.path.direction) > math.radians(2)
    assert apart < math.radians(0.1)


@given(TURNS, TURNS, st.floats(0.0, 2.0))
def test_it_does_not_know_the_axes(turn, other, seconds):
    bearing, matrix = swaying(turn, 0.4), other.as_matrix()
    np.testing.assert_allclose(
        bearing.turned(matrix).after(seconds).direction, matrix @ bearing.after(seconds).direction, atol=1e-13
    )
