"""The target's path and the body's sway about it."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from tracking.estimation.direction_filter import DirectionFilter, DirectionNoise
from tracking.estimation.steady_filter import SteadyFilter
from tracking.estimation.sway import Sway

STEP_S = 1 / 30


def followed(direction_at, seconds, tracked=None):
    """A filter that has measured a direction, without noise, for some seconds."""
    tracked = tracked or SteadyFilter(DirectionNoise(), Sway())
    for frame in range(round(seconds / STEP_S)):
        tracked.predict(frame * STEP_S)
        tracked.update(direction_at(frame * STEP_S))
    return tracked


def off_deg(bearing, direction):
    return math.degrees(math.acos(min(1.0, float(bearing.direction @ direction))))


@pytest.mark.parametrize("seed", range(4))
def test_an_even_path_is_followed_without_lag(seed):
    """On any great circle: after half a minute nothing is left of the first guesses of rate and sway."""
    turn, speed = Rotation.random(random_state=seed), math.radians(25)

    def even(time_s):
        return turn.apply([math.cos(speed * time_s), math.sin(speed * time_s), 0.0])

    tracked = followed(even, 30.0)
    assert tracked.bearing is not None
    assert off_deg(tracked.bearing.after(2.0), even(30.0 - STEP_S + 2.0)) < 0.05
    assert np.linalg.norm(tracked.bearing.path.rate) == pytest.approx(speed, rel=1e-3)


@pytest.mark.parametrize(("period_s", "share"), [(5.0, 0.65), (6.0, 0.6), (8.0, 1.05)])
def test_a_target_that_stays_beside_a_body_that_sways_is_expected_to_turn_back(period_s, share):
    """5 degrees up and down; a filter of constant rate goes on at the rate of the swing: 7, 6 and 3 degrees off."""

    def swung(time_s):
        elevation = math.radians(5) * math.sin(2 * math.pi * time_s / period_s)
        return np.array([math.cos(elevation), 0.0, math.sin(elevation)])

    errors = {"sway": [], "constant rate": []}
    for lasts_s in np.arange(12.0, 12.0 + period_s, 0.5):
        last_s = (round(lasts_s / STEP_S) - 1) * STEP_S
        constant = DirectionFilter(DirectionNoise(acceleration_deg=3.0))
        for name, tracked in (
            ("sway", followed(swung, lasts_s)),
            ("constant rate", followed(swung, lasts_s, constant)),
        ):
            errors[name].append(off_deg(tracked.bearing.after(1.5), swung(last_s + 1.5)))
    rms = {name: math.sqrt(np.mean(np.square(each))) for name, each in errors.items()}
    assert rms["sway"] < share * rms["constant rate"]


def test_what_it_does_not_know_is_as_large_as_it_says():
    """Truth drawn from its model: squares of what a second's prediction misses, over its variance, are chi-square.

    Two of 150 draws each, within the central 99.9 %; all angles a tenth of the usual ones, so that the sphere is flat.
    """
    noise = DirectionNoise(measurement_deg=0.05, steady_acceleration_deg=0.25, first_rate_deg_per_s=2.0)
    sway, rng = Sway(deviation_deg=0.25), np.random.default_rng(2)
    deviation, density = math.radians(noise.measurement_deg), math.radians(noise.steady_acceleration_deg) ** 2
    white = density * np.array([[STEP_S**3 / 3, STEP_S**2 / 2], [STEP_S**2 / 2, STEP_S]])
    swing, kicks = sway.transition(STEP_S), sway.process_noise(STEP_S)
    total, count = 0.0, 150
    for _ in range(count):
        path, about = np.zeros((2, 2)), rng.multivariate_normal(np.zeros(2), sway.covariance, size=2).T
        path[1] = rng.normal(scale=math.radians(noise.first_rate_deg_per_s), size=2)
        tracked = SteadyFilter(noise, sway)
        for frame in range(120):
            path = np.array([path[0] + STEP_S * path[1], path[1]]) + rng.multivariate_normal([0, 0], white, size=2).T
            about = swing @ about + rng.multivariate_normal([0, 0], kicks, size=2).T
            tracked.predict(frame * STEP_S)
            if frame < 90:
                seen = np.array([1.0, *(path[0] + about[0] + rng.normal(scale=deviation, size=2))])
                tracked.update(seen / np.linalg.norm(seen))
        off = tracked.bearing.direction[1:] / tracked.bearing.direction[0] - path[0] - about[0]
        total += off @ off / tracked.covariance[0, 0]
    assert chi2.ppf(0.0005, 2 * count) < total < chi2.ppf(0.9995, 2 * count)


def test_lost_images_only_widen_it():
    """A jump in time is one longer prediction."""
    singly, at_once = (followed(lambda time_s: np.array([1.0, 0.0, 0.0]), 2.0) for _ in range(2))
    for frame in range(60, 70):
        singly.predict(frame * STEP_S)
    at_once.predict(69 * STEP_S)
    np.testing.assert_allclose(singly.bearing.direction, at_once.bearing.direction, atol=1e-12)
    np.testing.assert_allclose(singly.covariance, at_once.covariance, rtol=1e-9)


def test_what_lasts_is_the_rate_of_the_path():
    tracked = followed(lambda time_s: np.array([math.cos(0.2 * time_s), math.sin(0.2 * time_s), 0.0]), 10.0)
    np.testing.assert_array_equal(tracked.lasting.direction, tracked.bearing.direction)
    np.testing.assert_array_equal(tracked.lasting.rate, tracked.bearing.path.rate)


def test_it_goes_on_from_a_snapshot_to_the_same_bytes():
    whole, resumed = SteadyFilter(DirectionNoise(), Sway()), SteadyFilter(DirectionNoise(), Sway())
    resumed.restore(json.loads(json.dumps(whole.snapshot())))
    assert resumed.bearing is None
    assert resumed.lasting is None
    with pytest.raises(ValueError, match="expected a measurement first"):
        _ = resumed.covariance
    followed(lambda time_s: np.array([math.cos(time_s), math.sin(time_s), 0.0]), 0.3, whole)
    resumed.restore(json.loads(json.dumps(whole.snapshot())))
    for tracked in (whole, resumed):
        tracked.predict(0.5)
        tracked.update([0.0, 1.0, 0.0])
    assert whole.snapshot() == resumed.snapshot()
    whole.forget()
    assert whole.bearing is None
