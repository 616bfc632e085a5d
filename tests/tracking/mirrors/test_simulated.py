"""The simulated driver: what it estimates, what is true, and that a seed and a snapshot decide everything."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from rigs import Rig
from tracking.mirrors.simulated import SimulatedMirrors

RIG = Rig.load("aqua2")
SPEED = math.radians(60)
ROUNDING = 1e-12


def test_truth_comes_after_the_command_by_a_pulse_and_the_latency():
    """Nothing moves for 5 ms; after 25 ms at most both joints run, at 60 degrees/s."""
    mirrors = SimulatedMirrors.from_rig(RIG, seed=1)
    start = mirrors.true_q(0.0)
    mirrors.command([0.0, 0.0], 0.0)
    assert (mirrors.true_q(0.005) == start).all()
    early, late = mirrors.true_q(0.1), mirrors.true_q(0.2)
    np.testing.assert_allclose(np.abs(late - early), 0.1 * SPEED, atol=ROUNDING)
    # Run for at least 0.1 - 0.025 s and at most 0.1 - 0.005 s, less half the backlash.
    run = np.abs(early - start) + math.radians(0.25)
    assert (run >= (0.1 - 0.025) * SPEED - ROUNDING).all()
    assert (run <= (0.1 - 0.005) * SPEED + ROUNDING).all()


def test_truth_ends_within_deadband_and_play_of_the_command():
    for seed in range(20):
        mirrors = SimulatedMirrors.from_rig(RIG, seed=seed)
        goal = np.radians([30.0, -10.0])
        mirrors.command(goal, 0.0)
        # Half the backlash of 0.5 degrees and the jitter of 0.2 us; the deadband only keeps what is at rest.
        assert np.abs(mirrors.true_q(5.0) - goal).max() <= math.radians(0.25 + 0.2 * 155 / 1500) + ROUNDING


def test_estimate_knows_the_speed_and_nothing_else():
    mirrors = SimulatedMirrors.from_rig(RIG, seed=1, estimated_latency_s=0.0)
    assert (mirrors.report(0.0).q == 0.0).all()
    mirrors.command(np.radians([30.0, -10.0]), 0.0)
    report = mirrors.report(0.25)
    np.testing.assert_allclose(report.q, np.radians([15.0, -10.0]), atol=ROUNDING)
    assert report.time_s == 0.25
    assert not report.measured


def test_estimate_expects_the_latency_of_the_rig_file():
    """Half of 20 ms between pulses and 5 ms of the servo's own."""
    mirrors = SimulatedMirrors.from_rig(RIG, seed=1)
    mirrors.command(np.radians([30.0, -10.0]), 0.0)
    np.testing.assert_allclose(mirrors.report(0.115).q, np.radians([6.0, -6.0]), atol=ROUNDING)


def test_where_the_servos_stand_at_power_on_is_anywhere_and_unknown():
    starts = np.array([SimulatedMirrors.from_rig(RIG, seed=seed).true_q(0.0) for seed in range(400)])
    low, high = np.radians([-77.5, -32.5]), np.radians([77.5, 122.5])
    assert (starts >= low).all()
    assert (starts <= high).all()
    # Uniform: mean in the middle, within 4 standard errors (155 degrees / sqrt(12 * 400)).
    error = math.radians(155) / math.sqrt(12 * 400)
    np.testing.assert_allclose(starts.mean(axis=0), (low + high) / 2, atol=4 * error)
    assert (SimulatedMirrors.from_rig(RIG, seed=0).report(0.0).q == 0.0).all()


def test_after_a_functional_check_the_driver_knows_that_the_servos_stand_in_the_middle():
    middle = np.radians([0.0, 45.0])
    for seed in range(5):
        mirrors = SimulatedMirrors.from_rig(RIG, seed=seed, checked=True)
        np.testing.assert_allclose(mirrors.true_q(0.0), middle, atol=ROUNDING)
        np.testing.assert_allclose(mirrors.report(0.0).q, middle, atol=ROUNDING)


def drive(mirrors: SimulatedMirrors, frames: range) -> list[float]:
    """Two sines at 30 frames/s, the command 20 ms after the exposure's middle, exposures of 10 ms."""
    seen: list[float] = []
    for k in frames:
        time_s = 0.1 + k / 30
        for part_s in (-0.005, 0.0, 0.005):
            seen += mirrors.true_q(time_s + part_s).tolist()
        seen += mirrors.report(time_s).q.tolist()
        mirrors.command(np.radians([40 * math.sin(k / 9), 20 * math.cos(k / 7)]), time_s + 0.02)
    return seen


def test_the_same_seed_gives_the_same_bytes_and_another_one_does_not():
    once = drive(SimulatedMirrors.from_rig(RIG, seed=5), range(60))
    assert drive(SimulatedMirrors.from_rig(RIG, seed=5), range(60)) == once
    assert drive(SimulatedMirrors.from_rig(RIG, seed=6), range(60)) != once


@pytest.mark.parametrize("cut", [0, 1, 17, 59])
def test_a_restored_driver_goes_on_with_the_same_bytes(cut):
    once = drive(SimulatedMirrors.from_rig(RIG, seed=5), range(60))
    killed = SimulatedMirrors.from_rig(RIG, seed=5)
    before = drive(killed, range(cut))
    again = SimulatedMirrors.from_rig(RIG, seed=5)
    again.restore(json.loads(json.dumps(killed.snapshot())))
    assert before + drive(again, range(cut, 60)) == once


def test_wrong_commands_are_named_all_at_once():
    mirrors = SimulatedMirrors.from_rig(RIG)
    message = "expected q1 from -77.5 to 77.5 degrees, got 80; expected q2 from -32.5 to 122.5 degrees, got nan"
    with pytest.raises(ValueError, match=message):
        mirrors.command([math.radians(80), math.nan], 0.0)
    with pytest.raises(ValueError, match=r"expected q of shape \(2,\), got \(3,\)"):
        mirrors.command([0.0, 0.0, 0.0], 0.0)
    mirrors.true_q(1.0)
    with pytest.raises(ValueError, match=r"expected a command from 1\.0 s on"):
        mirrors.command([0.0, 0.0], 0.5)
    with pytest.raises(ValueError, match="expected a rig with mirrors, got 'bench', which has none"):
        SimulatedMirrors.from_rig(Rig.load("bench"))


def test_limits_in_radians_may_be_commanded():
    """Expected: not refused, and after 10 s the driver estimates the joints to be there."""
    mirrors = SimulatedMirrors.from_rig(RIG)
    mirrors.command(np.radians([77.5, -32.5]), 0.0)
    np.testing.assert_allclose(np.degrees(mirrors.report(10.0).q), [77.5, -32.5], atol=1e-9)
