"""The attitude sensor of a dive: closed forms of its noise, drift and age."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dives.paths import attitude_sensor, body_pose
from dives.runner import identity_of
from dives.trajectories.attitude_sensor import AttitudeSettings

PERFECT = {"noise_deg": 0.0, "drift_deg_per_min": 0.0, "latency_ms": 0.0}

ROUNDING = 1e-12


def reported(dive, time_s, **settings):
    """World from body as a sensor tells it."""
    told = dive.model_copy(update={"attitude": AttitudeSettings(**(PERFECT | settings))})
    report = attitude_sensor(told).report(time_s)
    assert np.linalg.norm(report.quaternion) == pytest.approx(1, abs=ROUNDING)
    return Rotation.from_quat(report.quaternion), report.time_s


def true_turn(dive, time_s):
    return body_pose(dive, time_s).rotation


def test_a_perfect_sensor_tells_the_truth(small_dive):
    turn, time_s = reported(small_dive, 0.2)
    assert time_s == 0.2
    assert (turn * true_turn(small_dive, 0.2).inv()).magnitude() < ROUNDING


def test_a_late_one_tells_what_was_true_and_when(small_dive):
    turn, time_s = reported(small_dive, 0.2, latency_ms=50.0)
    assert time_s == pytest.approx(0.15, abs=ROUNDING)
    assert (turn * true_turn(small_dive, 0.15).inv()).magnitude() < ROUNDING


def test_the_heading_drifts_to_the_left(small_dive):
    """6 degrees a minute are 3 after half of one, about the world's vertical whatever the body does."""
    turn, _ = reported(small_dive, 30.0, drift_deg_per_min=6.0)
    drift = (turn * true_turn(small_dive, 30.0).inv()).as_rotvec(degrees=True)
    np.testing.assert_allclose(drift, [0.0, 0.0, 3.0], atol=1e-9)


def test_noise_is_white_about_each_axis(small_dive):
    """Of 400 reports: means within 4 standard errors, spreads within 4 of theirs, no memory from one to the next."""
    turns = [reported(small_dive, k / 30, noise_deg=0.2)[0] * true_turn(small_dive, k / 30).inv() for k in range(400)]
    noise = np.array([turn.as_rotvec(degrees=True) for turn in turns])
    assert np.abs(noise.mean(axis=0)).max() < 4 * 0.2 / np.sqrt(400)
    np.testing.assert_allclose(noise.std(axis=0), 0.2, rtol=4 / np.sqrt(800))
    assert np.abs((noise[1:] * noise[:-1]).mean(axis=0)).max() < 4 * 0.2**2 / np.sqrt(399)


def test_the_same_seed_gives_the_same_reports_in_any_order(small_dive):
    told = small_dive.model_copy(update={"attitude": AttitudeSettings()})
    times_s = [0.0, 1 / 30, 2 / 30]
    forwards = [attitude_sensor(told).report(time_s).quaternion for time_s in times_s]
    backwards = [attitude_sensor(told).report(time_s).quaternion for time_s in reversed(times_s)]
    np.testing.assert_array_equal(forwards, backwards[::-1])
    other = told.model_copy(update={"seed": told.seed + 1})
    assert not np.array_equal(attitude_sensor(other).report(0.0).quaternion, forwards[0])


def test_a_dive_without_a_sensor_is_the_dive_that_it_was(small_dive):
    """Nothing is reported, nothing is written down, and what was dived before there were sensors stays finished."""
    assert attitude_sensor(small_dive) is None
    assert "attitude" not in small_dive.as_toml()
    rig = small_dive.load_rig()
    without = identity_of(small_dive, rig)
    told = small_dive.model_copy(update={"attitude": AttitudeSettings()})
    assert identity_of(told, rig) != without
    worse = small_dive.model_copy(update={"attitude": AttitudeSettings(noise_deg=1.0)})
    assert identity_of(worse, rig) != identity_of(told, rig)
