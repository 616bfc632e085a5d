"""Steady axes: bodies that turn in a known way, and a target that stays in the world."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tracking.estimation.attitude import COAST_S, RATE_S, SteadyAxes
from tracking.estimation.bearing import Bearing
from tracking.estimation.direction_filter import DirectionFilter, DirectionNoise
from tracking.protocols import AttitudeReport

STEP_S = 1 / 30

TARGET = np.array([0.6, 0.0, 0.8])
"""Unit vector in the world."""

ROUNDING = 1e-9
"""Of turns to and from quaternions, over a hundred images."""


def turning(body_rate, time_s, start=None):
    """World from body of a body that turns evenly about its own axes, rad/s."""
    return (Rotation.identity() if start is None else start) * Rotation.from_rotvec(np.multiply(time_s, body_rate))


def swaying(time_s):
    """World from body: 5 degrees of roll, pitch and yaw in 4 to 5 s."""
    angles = [5 * math.sin(2 * math.pi * time_s / period_s + phase) for period_s, phase in ((4, 0), (5, 1), (4.5, 2))]
    return Rotation.from_euler("ZYX", angles[::-1], degrees=True)


def report(world_from_body, time_s):
    return AttitudeReport(quaternion=world_from_body.as_quat(), time_s=time_s)


def followed(pose, *, told, images=120):
    """Largest error of the direction in the body frame over the last second, radians, of a target that stays."""
    axes, tracked, errors = SteadyAxes(), DirectionFilter(DirectionNoise()), []
    for time_s in np.arange(images) * STEP_S:
        seen = pose(time_s).inv().apply(TARGET)
        axes.note(report(pose(time_s), time_s) if told else None, time_s)
        tracked.predict(time_s)
        if tracked.bearing is not None:
            errors.append(np.linalg.norm(axes.to_body(tracked.bearing.direction) - seen))
        tracked.update(axes.to_steady(seen))
    return axes, tracked.bearing, max(errors[-30:])


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 1.0))
def test_a_target_that_stays_has_no_rate_and_no_lag_beside_a_body_that_turns(seed, ahead_s):
    """Closed form: in steady axes it stands still, and ahead of time it is where the body will have turned from."""
    rng = np.random.default_rng(seed)
    start, body_rate = Rotation.random(random_state=seed), rng.normal(scale=0.3, size=3)
    axes, bearing, error = followed(lambda time_s: turning(body_rate, time_s, start), told=True, images=40)
    assert error < ROUNDING
    assert np.linalg.norm(bearing.rate) < ROUNDING / STEP_S
    later = axes.bearing_ahead(bearing, ahead_s).after(ahead_s).direction
    expected = turning(body_rate, 39 * STEP_S + ahead_s, start).inv().apply(TARGET)
    np.testing.assert_allclose(later, expected, atol=1e-7)


def test_a_body_that_sways_makes_no_lag():
    """Expected: none with its attitude; without, that of an acceleration of 0.2 rad/s^2 over the filter's 0.1 s."""
    assert followed(swaying, told=True)[2] < ROUNDING
    assert followed(swaying, told=False)[2] > math.radians(0.05)


def test_the_body_turns_on_no_longer_than_it_is_asked_for():
    axes, bearing, _ = followed(lambda time_s: turning([0.0, 0.0, 0.5], time_s), told=True)
    ahead = axes.bearing_ahead(bearing, 0.1)
    np.testing.assert_allclose(ahead.after(2.0).direction, ahead.after(0.1).direction, atol=ROUNDING)
    each = [ahead.after(seconds).direction for seconds in (0.05, 0.1, 2.0)]
    np.testing.assert_array_equal(ahead.directions_after([0.05, 0.1, 2.0]), each)


def test_an_own_rate_of_the_target_is_carried_into_the_body():
    """It swims by 0.2 rad/s about the world's z, the body turns by 0.5 the other way: 0.7 in the body."""
    axes = SteadyAxes()
    for time_s in (0.0, 0.1):
        axes.note(report(turning([0.0, 0.0, -0.5], time_s), time_s), time_s)
    bearing = Bearing(direction=np.array([1.0, 0.0, 0.0]), rate=np.array([0.0, 0.2, 0.0]))
    later = axes.bearing_ahead(bearing, 0.3).after(0.3).direction
    angle = 0.2 * 0.3 + 0.5 * 0.4
    np.testing.assert_allclose(later, [math.cos(angle), math.sin(angle), 0.0], atol=ROUNDING)


def test_late_reports_are_carried_on_to_the_image():
    """A body that turns evenly, reports 60 ms old: from the second one on the axes are those of the image's time."""
    axes, body_rate, late_s = SteadyAxes(), [0.1, -0.2, 0.3], 0.06
    for time_s in np.arange(10) * STEP_S:
        axes.note(report(turning(body_rate, time_s - late_s), time_s - late_s), time_s)
    first = axes.to_steady(turning(body_rate, time_s).inv().apply(TARGET))
    axes.note(report(turning(body_rate, time_s + STEP_S - late_s), time_s + STEP_S - late_s), time_s + STEP_S)
    again = axes.to_steady(turning(body_rate, time_s + STEP_S).inv().apply(TARGET))
    np.testing.assert_allclose(again, first, atol=ROUNDING)


def test_noise_of_the_reports_makes_little_rate():
    """Closed form: two independent errors over three images, 0.05 sqrt 2 / 0.1 = 0.7 degrees/s on each axis."""
    rng, rates = np.random.default_rng(4), []
    axes = SteadyAxes()
    for time_s in np.arange(2000) * STEP_S:
        axes.note(report(Rotation.from_rotvec(rng.normal(scale=0.05, size=3), degrees=True), time_s), time_s)
        rates.append(axes.snapshot()["body_rate"])
    assert RATE_S < 3 * STEP_S
    # Of the spread of 6000 numbers, overlapping by threes, 3 %.
    assert np.degrees(np.std(rates)) == pytest.approx(0.05 * math.sqrt(2) / 0.1, rel=0.05)


def test_without_reports_axes_are_the_bodys():
    """The same vectors, not equal ones."""
    axes = SteadyAxes()
    axes.note(None, 0.0)
    axes.note(AttitudeReport(quaternion=np.full(4, math.nan), time_s=0.1), 0.1)
    assert axes.to_steady(TARGET) is TARGET
    assert axes.to_body(TARGET) is TARGET


BODY_RATE = [0.2, 0.1, -0.4]


def told(until_s):
    """Axes after a second of reports that end at a time, and images that go on until a second later."""
    axes = SteadyAxes()
    for time_s in np.arange(31) * STEP_S:
        axes.note(report(turning(BODY_RATE, time_s), time_s) if time_s <= until_s else None, time_s)
    return axes


def turn_of(axes):
    """Steady axes from the body."""
    return np.array(axes.snapshot()["turn"])


def test_missing_reports_leave_the_body_turning_for_half_a_second():
    np.testing.assert_allclose(turn_of(told(0.55)), turn_of(told(1.0)), atol=ROUNDING)


def test_then_the_axes_go_with_the_body_and_go_on_from_there():
    """No jump when reports come back: what happened meanwhile nobody knows."""
    axes = told(0.2)
    kept = turn_of(axes)
    np.testing.assert_allclose(kept, turning(BODY_RATE, 0.2 + COAST_S).as_matrix(), atol=STEP_S)
    assert not np.any(axes.snapshot()["body_rate"])
    axes.note(None, 2.0)
    np.testing.assert_array_equal(turn_of(axes), kept)
    for time_s in (3.0, 3.1):
        axes.note(report(turning(BODY_RATE, time_s), time_s), time_s)
    np.testing.assert_allclose(turn_of(axes), kept @ turning(BODY_RATE, 0.1).as_matrix(), atol=ROUNDING)


@pytest.mark.parametrize(
    "bad",
    [
        {"quaternion": np.array([0.0, math.nan, 0.0, 1.0])},
        {"quaternion": np.array([0.0, math.inf, 0.0, 1.0])},
        {"quaternion": np.zeros(4)},
        {"quaternion": np.array([0.0, 0.0, 1.0, 1.0])},
        {"time_s": math.nan},
        {"time_s": 1.7e9},
        {"time_s": 0.3},
        {"time_s": 1.0 - STEP_S},
    ],
)
def test_what_is_no_report_is_passed_over(bad):
    """The axes are as if none had come: of another clock, older than the last, or no rotation."""
    good = report(turning(BODY_RATE, 1.0 - STEP_S), 1.0 - STEP_S)
    axes, without = told(1.0 - 0.5 * STEP_S), told(1.0 - 0.5 * STEP_S)
    axes.note(replace(good, **bad), 1.02)
    without.note(None, 1.02)
    assert axes.snapshot() == without.snapshot()


def test_a_snapshot_goes_through_json_and_on_to_the_same_bits():
    axes, other = told(0.7), SteadyAxes()
    other.restore(json.loads(json.dumps(axes.snapshot())))
    for time_s in (1.1, 1.2):
        for each in (axes, other):
            each.note(report(turning(BODY_RATE, time_s), time_s - 0.01), time_s)
    assert axes.snapshot() == other.snapshot()
    np.testing.assert_array_equal(axes.to_steady(TARGET), other.to_steady(TARGET))
