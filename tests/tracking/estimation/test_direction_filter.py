"""The target's direction at a constant rate."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from tracking.estimation.bearing import Bearing
from tracking.estimation.direction_filter import DirectionFilter, DirectionNoise

STEP_S = 1 / 30


def great_circle(turn: Rotation, speed: float, time_s: float) -> np.ndarray:
    angle = speed * time_s
    return turn.apply([math.cos(angle), math.sin(angle), 0.0])


@pytest.mark.parametrize("seed", range(4))
def test_a_target_at_a_constant_rate_is_followed_without_lag(seed):
    """Measured without noise, on any great circle: the error falls to rounding, the rate is found, no pole disturbs."""
    turn = Rotation.random(random_state=seed)
    tracked, speed = DirectionFilter(DirectionNoise()), math.radians(40)
    for frame in range(150):
        tracked.predict(frame * STEP_S)
        tracked.update(great_circle(turn, speed, frame * STEP_S))
    tracked.predict(149 * STEP_S + 1.0)
    expected = great_circle(turn, speed, 149 * STEP_S + 1.0)
    # What is left of the first guess of the rate, zero: it decays with the filter's bandwidth, e-fold in 0.1 s.
    assert np.linalg.norm(tracked.bearing.direction - expected) < 1e-6
    assert np.linalg.norm(tracked.bearing.rate) == pytest.approx(speed, rel=1e-6)


def test_it_does_not_know_the_axes():
    """Turning all measurements turns the estimate."""
    rng = np.random.default_rng(1)
    measured = np.array([1.0, 0.0, 0.0]) + rng.normal(scale=0.02, size=(20, 3))
    measured /= np.linalg.norm(measured, axis=1, keepdims=True)
    turn = Rotation.random(random_state=7)
    plain, turned = DirectionFilter(DirectionNoise()), DirectionFilter(DirectionNoise())
    for frame, direction in enumerate(measured):
        for tracked, seen in ((plain, direction), (turned, turn.apply(direction))):
            tracked.predict(frame * STEP_S)
            tracked.update(seen)
    np.testing.assert_allclose(turn.apply(plain.bearing.direction), turned.bearing.direction, atol=1e-13)
    np.testing.assert_allclose(turn.apply(plain.bearing.rate), turned.bearing.rate, atol=1e-12)


def test_its_innovations_are_chi_square_distributed():
    """Truth drawn from the model on the sphere: the sum of 4000 innovations squared has 2 degrees of freedom each.

    It lies within the central 99.9 %: the sphere's curvature over a frame costs nothing that can be seen.
    """
    rng = np.random.default_rng(4)
    noise = DirectionNoise()
    deviation, density = math.radians(noise.measurement_deg), math.radians(noise.acceleration_deg) ** 2
    process = density * np.array([[STEP_S**3 / 3, STEP_S**2 / 2], [STEP_S**2 / 2, STEP_S]])
    total, count = 0.0, 0
    for _ in range(40):
        tracked = DirectionFilter(noise)
        truth = Bearing(direction=np.array([1.0, 0.0, 0.0]), rate=np.zeros(3))
        for frame in range(110):
            across = _tangent(truth.direction)
            truth = truth.after(STEP_S)
            step, change = rng.multivariate_normal([0.0, 0.0], process, size=2).T
            truth = _moved(truth, _tangent(truth.direction) @ step, _tangent(truth.direction) @ change)
            tracked.predict(frame * STEP_S)
            seen = truth.direction + across @ rng.normal(scale=deviation, size=2)
            correction = tracked.update(seen / np.linalg.norm(seen))
            if frame >= 10:
                total, count = total + correction.innovation_squared, count + 1
    assert count == 4000
    assert chi2.ppf(0.0005, 2 * count) < total < chi2.ppf(0.9995, 2 * count)


def _tangent(direction: np.ndarray) -> np.ndarray:
    """Two unit vectors across a direction, shape (3, 2)."""
    _, _, axes = np.linalg.svd(direction[np.newaxis])
    return axes[1:].T


def _moved(bearing: Bearing, step: np.ndarray, change: np.ndarray) -> Bearing:
    direction = bearing.direction + step
    direction = direction / np.linalg.norm(direction)
    rate = bearing.rate + change
    return Bearing(direction=direction, rate=rate - (rate @ direction) * direction)


def test_lost_images_only_widen_it():
    """A jump in time is one longer prediction: three single steps or one of three times the length are the same."""
    singly, at_once = DirectionFilter(DirectionNoise()), DirectionFilter(DirectionNoise())
    for tracked in (singly, at_once):
        for frame in range(20):
            tracked.predict(frame * STEP_S)
            tracked.update(great_circle(Rotation.identity(), 0.5, frame * STEP_S))
    for frame in (20, 21, 22):
        singly.predict(frame * STEP_S)
    at_once.predict(22 * STEP_S)
    for one, other in zip(singly.snapshot()["mean"], at_once.snapshot()["mean"], strict=True):
        np.testing.assert_allclose(one, other, atol=1e-14)
    np.testing.assert_allclose(singly.snapshot()["covariance"], at_once.snapshot()["covariance"], rtol=1e-12)


def test_it_goes_on_from_a_snapshot_to_the_same_bytes():
    whole, resumed = DirectionFilter(DirectionNoise()), DirectionFilter(DirectionNoise())
    resumed.restore(json.loads(json.dumps(whole.snapshot())))
    assert resumed.bearing is None
    for frame in range(5):
        whole.predict(frame / 30)
        whole.update(great_circle(Rotation.identity(), 0.4, frame / 29))
    resumed.restore(json.loads(json.dumps(whole.snapshot())))
    for tracked in (whole, resumed):
        tracked.predict(0.2)
        tracked.update([0.0, 1.0, 0.0])
    assert whole.snapshot() == resumed.snapshot()
    whole.forget()
    assert whole.bearing is None


def test_it_says_which_noise_it_cannot_use():
    with pytest.raises(ValueError, match="expected measurement_deg above 0, got 0"):
        DirectionNoise(measurement_deg=0.0)


def test_it_goes_on_from_the_estimate_of_another():
    quick, covariance = DirectionFilter(DirectionNoise()), np.diag([0.01, 0.04])
    bearing = Bearing(direction=np.array([1.0, 0.0, 0.0]), rate=np.array([0.0, 0.2, 0.0]))
    quick.predict(1.0)
    quick.take_over(bearing, covariance)
    assert quick.expected_spread**2 == pytest.approx(0.01 + math.radians(0.5) ** 2)
    quick.predict(1.1)
    np.testing.assert_allclose(quick.bearing.direction, bearing.after(0.1).direction)
