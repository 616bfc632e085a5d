"""A servo against closed forms: pulses, delay, rate limit, deadband, backlash, travel, power-on; and any step size."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigs import Rig
from tracking.servos import ServoBehaviour, ServoPlant

ROUNDING = 1e-12
"""Radians: a few roundings of numbers of the order of 1."""

TRAVEL = (-1.0, 2.0)


def servo(*, angle: float = 0.0, seed: int = 0, **changes) -> ServoPlant:
    """A servo with 0.5 rad/s and nothing else that is wrong with it, but for what is changed."""
    return ServoPlant(ServoBehaviour(**({"travel": TRAVEL, "speed": 0.5} | changes)), angle=angle, seed=seed)


def angle_after(plant: ServoPlant, time_s: float) -> float:
    plant.advance(time_s)
    return plant.angle


@pytest.mark.parametrize(("time_s", "angle"), [(0.0, 0.0), (0.4, 0.2), (1.99, 0.995), (2.0, 1.0), (7.0, 1.0)])
def test_the_rate_limit_makes_a_ramp(time_s, angle):
    """1 rad at 0.5 rad/s: v t, then the goal itself."""
    plant = servo()
    plant.command(1.0, 0.0)
    assert angle_after(plant, time_s) == pytest.approx(angle, abs=ROUNDING)
    assert angle < 1.0 or plant.angle == 1.0


def test_a_new_goal_turns_the_ramp_where_it_is():
    """Up for 0.8 s to 0.4 rad, then down towards -0.3, which takes 1.4 s."""
    plant = servo()
    plant.command(1.0, 0.0)
    plant.command(-0.3, 0.8)
    assert angle_after(plant, 0.8) == pytest.approx(0.4, abs=ROUNDING)
    assert angle_after(plant, 1.3) == pytest.approx(0.4 - 0.25, abs=ROUNDING)
    assert angle_after(plant, 0.8 + 1.4 + 1e-9) == -0.3


def test_latency_moves_the_ramp():
    plant = servo(latency_s=0.1)
    plant.command(1.0, 0.0)
    assert angle_after(plant, 0.1) == 0.0
    assert angle_after(plant, 0.3) == pytest.approx(0.5 * 0.2, abs=ROUNDING)


@pytest.mark.parametrize(("commanded_s", "answered_s"), [(0.0, 0.003), (0.0031, 0.023), (0.0229, 0.023), (0.03, 0.043)])
def test_a_command_waits_for_the_next_pulse(commanded_s, answered_s):
    """Pulses begin at 3, 23, 43 ms; latency 5 ms on top."""
    behaviour = ServoBehaviour(travel=TRAVEL, speed=0.5, pulse_period_s=0.02, pulse_phase_s=0.003, latency_s=0.005)
    assert behaviour.answer_time(commanded_s) == pytest.approx(answered_s + 0.005, abs=ROUNDING)


def test_a_pulse_takes_the_latest_command_before_it():
    plant = servo(pulse_period_s=0.02, pulse_phase_s=0.019)
    plant.command(1.0, 0.0)
    plant.command(-1.0, 0.01)
    assert angle_after(plant, 0.039) == pytest.approx(-0.5 * 0.02, abs=ROUNDING)


def test_the_delay_of_a_pulsed_servo_is_half_a_period_and_the_latency_on_average():
    """Commands spread evenly over a period wait between 0 and a period for their pulse: 20 / 2 + 5 = 15 ms."""
    behaviour = ServoBehaviour(travel=TRAVEL, speed=1.0, pulse_period_s=0.02, latency_s=0.005)
    times = [(k + 0.5) / 1000 * 0.02 for k in range(1000)]
    delays = [behaviour.answer_time(time_s) - time_s for time_s in times]
    assert sum(delays) / 1000 == pytest.approx(0.015, abs=1e-9)  # the midpoints' mean is exact for a line


@pytest.mark.parametrize(("change", "reached"), [(0.009, 0.0), (0.01, 0.0), (0.011, 0.011), (-0.011, -0.011)])
def test_a_servo_at_rest_ignores_changes_within_its_deadband(change, reached):
    plant = servo(deadband=0.01)
    plant.command(change, 0.0)
    assert angle_after(plant, 1.0) == reached


def test_a_slow_ramp_of_commands_becomes_a_staircase():
    """Commands a step of 2^-10 rad apart: followed whenever they are more than the deadband of 10 steps away."""
    step = 2.0**-10  # exact in binary, so that ten steps are ten
    plant = servo(deadband=10 * step)
    held = []
    for k in range(1, 36):
        plant.command(step * k, k - 1.0)
        held.append(angle_after(plant, k - 0.5) / step)
    assert held == [0] * 10 + [11] * 11 + [22] * 11 + [33] * 3


def test_a_moving_servo_follows_small_changes_too():
    """At 0.19 s it is at 0.095 rad, within the deadband of both goals."""
    plant = servo(deadband=0.01)
    plant.command(0.1, 0.0)
    plant.command(0.1005, 0.19)
    assert angle_after(plant, 1.0) == 0.1005


def test_backlash_loses_its_whole_width_on_every_turn_back():
    """The horn starts in the middle of 0.1 rad of backlash: 0.05 are lost at first, 0.1 on each reversal."""
    plant = servo(speed=1.0, backlash=0.1)
    plant.command(0.5, 0.0)
    assert angle_after(plant, 0.05) == 0.0
    assert angle_after(plant, 0.25) == pytest.approx(0.2, abs=ROUNDING)
    assert angle_after(plant, 1.0) == pytest.approx(0.45, abs=ROUNDING)
    plant.command(0.0, 1.0)
    assert angle_after(plant, 1.1) == pytest.approx(0.45, abs=ROUNDING)
    assert angle_after(plant, 1.2) == pytest.approx(0.35, abs=ROUNDING)
    assert angle_after(plant, 2.0) == pytest.approx(0.05, abs=ROUNDING)
    assert plant.motor_angle == 0.0


def test_travel_ends_a_move():
    plant = servo()
    plant.command(9.0, 0.0)
    assert angle_after(plant, 10.0) == TRAVEL[1]


def test_before_its_first_pulse_a_servo_stays_where_it_was_left():
    plant = servo(angle=1.7, pulse_period_s=0.02, pulse_phase_s=0.01)
    assert angle_after(plant, 5.0) == 1.7
    plant.command(0.0, 5.0)
    assert angle_after(plant, 5.01) == 1.7
    assert angle_after(plant, 6.01) == pytest.approx(1.7 - 0.5, abs=ROUNDING)


def test_jitter_stays_within_its_bound_and_comes_from_the_seed():
    """Uniform within +-0.001 rad: of 500 moves some come within 10 % of the bound (missed with 0.9^500 ~ 1e-23)."""

    def ends(seed: int) -> list[float]:
        plant = servo(speed=100.0, jitter=0.001, deadband=0.002, seed=seed)
        errors = []
        for k in range(500):
            goal = 0.5 * (-1) ** k
            plant.command(goal, float(k))
            errors.append(angle_after(plant, k + 0.5) - goal)
        return errors

    first = ends(1)
    assert ends(1) == first != ends(2)
    assert 0.0009 < max(map(abs, first)) <= 0.001 + ROUNDING


def test_repeated_commands_do_not_make_a_servo_at_rest_tremble():
    plant = servo(speed=100.0, jitter=0.001, deadband=0.002)
    plant.command(0.5, 0.0)
    rest = angle_after(plant, 1.0)
    for k in range(200):
        plant.command(0.5, 1.0 + k)
        assert angle_after(plant, 1.5 + k) == rest


COMMANDS = st.lists(st.tuples(st.floats(0.001, 0.3), st.floats(-1.5, 2.5)), min_size=1, max_size=12)
STEPS = st.lists(st.floats(0.0, 0.02), max_size=40)


def real_servo(phase_s: float) -> ServoPlant:
    behaviour = ServoBehaviour(
        travel=TRAVEL,
        speed=1.0,
        deadband=0.0036,
        backlash=0.009,
        pulse_period_s=0.02,
        pulse_phase_s=phase_s,
        latency_s=0.005,
        jitter=0.0004,
    )
    return ServoPlant(behaviour, angle=0.7, seed=3)


@given(commands=COMMANDS, steps=STEPS, phase_s=st.floats(0.0, 0.02))
def test_any_number_of_steps_gives_the_same_bytes(commands, steps, phase_s):
    plants = real_servo(phase_s), real_servo(phase_s)
    time_s = 0.0
    for wait_s, angle in commands:
        # Only one of the two is looked at in between.
        passed, time_s = time_s, time_s + wait_s
        for step in steps:
            passed = min(passed + step, time_s)
            plants[1].advance(passed)
        for plant in plants:
            plant.command(angle, time_s)
    for k in range(1, 1001):
        plants[1].advance(time_s + k * 0.002)
    plants[0].advance(time_s + 1000 * 0.002)
    assert plants[0].snapshot() == plants[1].snapshot()
    assert plants[0].angle == plants[1].angle


@given(commands=COMMANDS, step_s=st.floats(1e-4, 0.05))
def test_horn_and_motor_keep_to_travel_speed_and_play(commands, step_s):
    plant = real_servo(0.0)
    time_s, before = 0.0, plant.angle
    for _, angle in commands:
        plant.command(angle, time_s)
        time_s += step_s
        after = angle_after(plant, time_s)
        assert TRAVEL[0] <= after <= TRAVEL[1]
        assert abs(after - before) <= 1.0 * step_s + ROUNDING
        assert abs(after - plant.motor_angle) <= 0.009 / 2 + ROUNDING
        before = after


@given(commands=COMMANDS, cut=st.integers(0, 12))
def test_a_restored_servo_goes_on_with_the_same_bytes(commands, cut):
    plant, twin = real_servo(0.007), real_servo(0.007)
    time_s = 0.0
    for number, (wait_s, angle) in enumerate(commands):
        if number == cut:
            twin = real_servo(0.007)
            twin.restore(json.loads(json.dumps(plant.snapshot())))
        for one in {id(plant): plant, id(twin): twin}.values():
            one.command(angle, time_s)
            one.advance(time_s + wait_s)
        time_s += wait_s
    assert twin.snapshot() == plant.snapshot()
    assert twin.angle == plant.angle


def test_the_rig_files_numbers_arrive_in_radians_and_seconds():
    """HS-5086WP: 155 degrees over 750 to 2250 us, so 2 us of deadband are 2 / 1500 of 155 degrees."""
    rig = Rig.load("aqua2")
    behaviour = ServoBehaviour.of(rig.gaze.servos.tilt, rig.gaze.joints.tilt, pulse_phase_s=0.004)
    assert behaviour.travel == (math.radians(-32.5), math.radians(122.5))
    assert behaviour.speed == math.radians(60)
    assert behaviour.deadband == pytest.approx(math.radians(155 * 2 / 1500), abs=ROUNDING)
    assert behaviour.backlash == math.radians(0.5)
    assert behaviour.jitter == pytest.approx(math.radians(155 * 0.2 / 1500), abs=ROUNDING)
    assert (behaviour.pulse_period_s, behaviour.pulse_phase_s, behaviour.latency_s) == (0.02, 0.004, 0.005)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"travel": (1.0, 1.0)}, r"expected travel as lowest and highest angle, got \(1\.0, 1\.0\)"),
        ({"speed": 0.0}, "expected a speed above 0 rad/s, got 0"),
        ({"speed": math.nan}, "expected a speed above 0 rad/s, got nan"),
        ({"backlash": -0.1}, "expected backlash of at least 0, got -0.1"),
        ({"jitter": 0.1}, "expected a deadband of at least twice the jitter"),
    ],
)
def test_a_wrong_behaviour_is_named(changes, message):
    with pytest.raises(ValueError, match=message):
        servo(**changes)


def test_a_wrong_call_is_named():
    plant = servo()
    plant.advance(1.0)
    with pytest.raises(ValueError, match=r"expected a finite angle, got nan"):
        plant.command(math.nan, 1.0)
    with pytest.raises(ValueError, match=r"expected a command from 1\.0 s on, .* got 0\.9 s"):
        plant.command(0.0, 0.9)
    with pytest.raises(ValueError, match=r"expected a time from 1\.0 s on, .* got 0\.5 s"):
        plant.advance(0.5)
    with pytest.raises(ValueError, match=r"expected an angle at power-on from -1\.0 to 2\.0 rad, got 3"):
        servo(angle=3.0)
