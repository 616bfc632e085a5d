"""The servo catalogue's numbers follow from the figures that its sources give."""

from __future__ import annotations

import pytest

from rigs import Rig, Servo
from rigs.catalogue import SERVO_CATALOGUE, servo_numbers

NEWTON_METRES_PER_KG_CM = 9.80665 / 100
"""By the definition of the kilogram-force."""


@pytest.mark.parametrize("name", sorted(SERVO_CATALOGUE))
def test_every_entry_is_a_servo(name):
    assert Servo.model_validate(servo_numbers(name)).name == name


def test_hs5086wp_has_the_vendors_figures():
    """At 6.0 V without load: 3.6 kg cm, 0.15 s per 60 degrees; 750-2250 us maps to 0-155 degrees."""
    servo = Servo.model_validate(servo_numbers("hs5086wp"))
    assert servo.torque_n_m == pytest.approx(3.6 * NEWTON_METRES_PER_KG_CM, abs=5e-4)  # given to 1 mN m
    assert servo.speed_deg_per_s == pytest.approx(60 / 0.15)
    assert servo.travel_deg == 155
    assert servo.pulse_us == (750, 2250)
    assert servo.size_mm == (31.0, 15.2, 31.0)
    assert servo.mass_g == 26


def test_the_papers_servo_differs_only_in_speed():
    """Section 4 of the paper: "a rotation speed of 60 degrees/s"."""
    paper, vendor = SERVO_CATALOGUE["hs5086wp-paper"], SERVO_CATALOGUE["hs5086wp"]
    assert paper == vendor | {"speed_deg_per_s": 60.0}


def test_a_rig_that_names_a_servo_gets_its_numbers():
    assert Rig.load("aqua2").gaze.servos.pan.speed_deg_per_s == 60
    assert Rig.load("bluerov2").gaze.servos.pan.speed_deg_per_s == 300


@pytest.mark.parametrize("name", sorted(SERVO_CATALOGUE))
def test_every_entry_says_how_the_servo_moves(name):
    """50 pulses a second; jitter below 200 ns by the Maestro's guide; latency and backlash nominal."""
    servo = SERVO_CATALOGUE[name]
    assert servo["pulse_period_ms"] == 1000 / 50
    assert servo["jitter_us"] == 0.2
    assert {"latency_ms", "backlash_deg"} <= servo.keys()


def test_pulses_must_fit_their_period():
    with pytest.raises(
        ValueError, match="expected a pulse_period_ms longer than the longest pulse of 2250 us, got 2 ms"
    ):
        Servo.model_validate(servo_numbers("hs5086wp") | {"pulse_period_ms": 2.0})


def test_a_servo_must_rest_in_spite_of_its_pulses_jitter():
    with pytest.raises(ValueError, match=r"expected jitter_us of at most half of deadband_us = 2, got 1\.5"):
        Servo.model_validate(servo_numbers("hs5086wp") | {"jitter_us": 1.5})
