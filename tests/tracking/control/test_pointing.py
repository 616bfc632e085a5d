"""Joint values for a moving direction: exact where it can be, nearest where not, planned where pan takes seconds."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optics.gaze.kinematics import inverse_gaze
from optics.gaze.motion import JointSpeeds
from optics.layout import Layout
from rigs import Rig
from tracking.control.pointing import Pointing
from tracking.estimation.bearing import Bearing
from tracking.estimation.gimbal import Gimbal

RIG = Rig.load("aqua2")
LAYOUT = Layout.from_rig(RIG)
GIMBAL = Gimbal(LAYOUT)
SPEEDS = JointSpeeds.from_rig(RIG)
HALF_VIEW = math.radians(10.5)
FRAME_S = 1 / 30


def direction(azimuth_deg, elevation_deg):
    azimuth, elevation = math.radians(azimuth_deg), math.radians(elevation_deg)
    level = math.cos(elevation)
    return np.array([level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation)])


def angle_deg(a, b):
    return math.degrees(math.atan2(np.linalg.norm(np.cross(a, b)), a @ b))


def still(azimuth_deg, elevation_deg):
    return Bearing(direction=direction(azimuth_deg, elevation_deg), rate=np.zeros(3))


def servos(q, command, seconds=FRAME_S):
    most = np.array([SPEEDS.pan, SPEEDS.tilt]) * seconds
    return q + np.clip(command - q, -most, most)


def follow(pointing, path, q, frames):
    """Gaze errors in degrees and joint values, frame by frame, of ideal servos that are told where the target is."""
    errors, joints = [], []
    for frame in range(frames):
        now, soon = path(frame * FRAME_S), path(frame * FRAME_S + 1e-4)
        rate = (soon - now) / 1e-4
        command = pointing.command(Bearing(direction=now, rate=rate - (rate @ now) * now), FRAME_S, q)
        assert (command >= GIMBAL.lowest - 1e-9).all()
        assert (command <= GIMBAL.highest + 1e-9).all()
        q = servos(q, command)
        errors.append(angle_deg(GIMBAL.gaze(q), path((frame + 1) * FRAME_S)))
        joints.append(q)
    return np.array(errors), np.array(joints)


@given(st.floats(-170, 170), st.floats(-60, 84))
def test_a_direction_within_reach_is_met_exactly(azimuth_deg, elevation_deg):
    """From any of its solutions: the command is that solution, as `inverse_gaze` has it."""
    wanted = direction(azimuth_deg, elevation_deg)
    pointing = Pointing(GIMBAL, SPEEDS, HALF_VIEW)
    for q in inverse_gaze(LAYOUT, math.radians(azimuth_deg), math.radians(elevation_deg)):
        command = pointing.command(still(azimuth_deg, elevation_deg), FRAME_S, q)
        np.testing.assert_allclose(command, q, atol=1e-9)
        assert angle_deg(GIMBAL.gaze(command), wanted) < 1e-6


@pytest.mark.parametrize("gaze", [(90, 0), (-90, 20), (180, -89), (0, -80), (85, -85), (-100, -70)])
def test_a_direction_out_of_reach_is_met_by_the_nearest_gaze(gaze):
    """Beside the best of all joint values on a grid of half a degree (of pan; one of gaze), which adds at most half."""
    wanted = direction(*gaze)
    assert not len(inverse_gaze(LAYOUT, *np.radians(gaze)))
    q = GIMBAL.middle
    pointing = Pointing(GIMBAL, SPEEDS, HALF_VIEW)
    for _ in range(200):
        q = servos(q, pointing.command(still(*gaze), FRAME_S, q))
    axes = [np.linspace(low, high, 311) for low, high in zip(GIMBAL.lowest, GIMBAL.highest, strict=True)]
    pan, tilt = np.meshgrid(*axes)
    gazes = np.stack([np.cos(2 * tilt) * np.cos(pan), np.cos(2 * tilt) * np.sin(pan), np.sin(2 * tilt)], axis=-1)
    best = math.degrees(math.acos((gazes @ wanted).max()))
    assert angle_deg(GIMBAL.gaze(q), wanted) < best + 0.5


def test_straight_over_the_zenith_pan_does_not_move():
    """Ahead at 20 degrees azimuth, over the zenith and down behind at 40 degrees/s: tilt alone, without an error."""
    path = lambda time_s: _over(math.radians(20), math.radians(30 + 40 * time_s))  # noqa: E731
    start = GIMBAL.joint_values(math.radians(20), math.radians(15))
    errors, joints = follow(Pointing(GIMBAL, SPEEDS, HALF_VIEW), path, start, 90)
    assert errors.max() < 0.01
    assert np.ptp(joints[:, 0]) < math.radians(0.01)


def _over(azimuth, elevation):
    return np.array(
        [math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation)]
    )


@pytest.mark.parametrize("offset_deg", [2.0, 5.0, 9.0])
def test_a_target_that_passes_beside_the_zenith_stays_in_view(offset_deg):
    """It is let pass, at most as far off as it passes: pan would have to turn round, 155 degrees, 2.6 s.

    Across that, the plan's grid of pan may put it off by half of the 5 degrees between two nodes.
    """
    offset = math.sin(math.radians(offset_deg))

    def path(time_s):
        angle = math.radians(30 + 30 * time_s)
        line = np.array([math.cos(angle), 0.0, math.sin(angle)]) * math.cos(math.radians(offset_deg))
        line[1] = offset
        return line

    q = inverse_gaze(LAYOUT, math.atan2(path(0.0)[1], path(0.0)[0]), math.asin(path(0.0)[2]))[-1]
    errors, _ = follow(Pointing(GIMBAL, SPEEDS, HALF_VIEW), path, q, 120)
    assert errors.max() < math.hypot(offset_deg, 2.5)
    assert errors[-1] < 0.01


def test_where_the_limits_end_pan_turns_round_once_and_in_one_go():
    """A target circles at 20 degrees of elevation, 15 degrees/s.

    From 77.5 degrees on only the way over the zenith is left, beyond 102.5 degrees, half a turn of pan away: 155
    degrees at 60 degrees/s, 2.6 s. The target is out of view for no longer than that, and on the axis again afterwards.
    """
    path = lambda time_s: direction(40 + 15 * time_s, 20)  # noqa: E731
    start = GIMBAL.joint_values(math.radians(40), math.radians(10))
    errors, joints = follow(Pointing(GIMBAL, SPEEDS, HALF_VIEW), path, start, 300)
    lost_s = (errors > math.degrees(HALF_VIEW)).sum() * FRAME_S
    assert lost_s <= 155 / 60
    assert errors[200:].max() < 0.01
    turned_back = (np.diff(np.sign(np.diff(joints[:, 0])[np.abs(np.diff(joints[:, 0])) > 1e-3])) != 0).sum()
    # To the left with the target, to the right all the way round, to the left again behind.
    assert turned_back == 2


@pytest.mark.parametrize("elevation_deg", [10, -12])
@pytest.mark.parametrize("rate_deg_per_s", [12, 25])
def test_a_target_unseen_beyond_the_joints_is_met_again_on_the_other_side(rate_deg_per_s, elevation_deg):
    """It was lost at 80 degrees, beyond pan's end, and goes on: pan is there, half a turn on, when it comes in view.

    The gap is 25 degrees less half a view at each end; a turn of pan takes 2.6 s. The slower one is met as it comes in
    view, the faster one as soon as pan has got there. On the way nothing shows it, and below the horizon the gaze that
    is nearest to it leads away, past the nadir: tilt goes to the other side at once.
    """
    rate = math.radians(rate_deg_per_s)
    path = lambda time_s: direction(80 + rate_deg_per_s * time_s, elevation_deg)  # noqa: E731
    pointing, errors = Pointing(GIMBAL, SPEEDS, HALF_VIEW), []
    q = np.array([math.radians(77.5), math.radians(elevation_deg / 2)])
    for frame in range(150):
        now = path(frame * FRAME_S)
        bearing = Bearing(direction=now, rate=rate * np.cross([0.0, 0.0, 1.0], now))
        q = servos(q, pointing.command(bearing, FRAME_S, q, seen=False, left=True))
        errors.append(angle_deg(GIMBAL.gaze(q), path((frame + 1) * FRAME_S)))
    met_s = (np.array(errors) > math.degrees(HALF_VIEW)).nonzero()[0][-1] * FRAME_S
    assert met_s <= max(155 / 60, (102.5 - 80) / rate_deg_per_s) + 2 * FRAME_S
    assert errors[-1] < 5


@pytest.mark.parametrize("azimuth_deg", [70.0, 90.0])
def test_an_unseen_target_that_stands_is_waited_for_where_pan_is(azimuth_deg):
    """In view it hides behind something, between both ways nothing shows it: neither is a reason to turn round."""
    pointing, q = Pointing(GIMBAL, SPEEDS, HALF_VIEW), np.array([math.radians(77.5), math.radians(5)])
    for _ in range(60):
        q = servos(q, pointing.command(still(azimuth_deg, 10), FRAME_S, q, seen=False, left=True))
    assert math.degrees(q[0]) == pytest.approx(min(azimuth_deg, 77.5), abs=0.01)


def test_a_target_that_did_not_leave_by_the_joints_end_is_waited_for():
    """Lost within reach, before the sun, and expected beyond it: pan stays, for it may come back here."""
    pointing, q = Pointing(GIMBAL, SPEEDS, HALF_VIEW), np.array([math.radians(-76), math.radians(30)])
    assert not pointing.past_the_end(direction(-73, 62))
    assert pointing.past_the_end(direction(-84, 0))
    rate = -math.radians(25) * np.cross([0.0, 0.0, 1.0], direction(-95, 20))
    for _ in range(60):
        command = pointing.command(Bearing(direction=direction(-95, 20), rate=rate), FRAME_S, q, seen=False)
        q = servos(q, command)
    assert math.degrees(q[0]) == pytest.approx(-77.5, abs=0.01)


def test_a_target_in_view_is_not_left_for_where_it_will_be():
    """At 84 degrees and 12 degrees/s pan's end has it in view, 6.5 degrees off; in 3 s only the other side will."""
    pointing, q = Pointing(GIMBAL, SPEEDS, HALF_VIEW), np.array([math.radians(77.5), 0.0])
    now = direction(84, 0)
    bearing = Bearing(direction=now, rate=math.radians(12) * np.cross([0.0, 0.0, 1.0], now))
    assert math.degrees(pointing.command(bearing, FRAME_S, q)[0]) == pytest.approx(77.5, abs=0.1)


def test_noise_does_not_change_its_mind():
    """Half a degree of noise on a target between both ways, level at the side: pan stays on the one it is on."""
    rng = np.random.default_rng(6)
    pointing = Pointing(GIMBAL, SPEEDS, HALF_VIEW)
    for side in (1, -1):
        q = np.array([side * math.radians(77.5), 0.0])
        for _ in range(60):
            noise = np.radians(rng.normal(scale=0.5, size=3))
            towards = direction(90, 10) + noise
            towards /= np.linalg.norm(towards)
            rate = np.radians(rng.normal(scale=2.0, size=3))
            bearing = Bearing(direction=towards, rate=rate - (rate @ towards) * towards)
            q = servos(q, pointing.command(bearing, FRAME_S, q))
        assert abs(q[0] - side * math.radians(77.5)) < math.radians(5)


def test_a_moving_target_is_led():
    """Feed-forward: the command is where the target will be."""
    rate = np.cross([0.0, 0.0, math.radians(20)], direction(10, 0))
    command = Pointing(GIMBAL, SPEEDS, HALF_VIEW).command(
        Bearing(direction=direction(10, 0), rate=rate), 0.1, GIMBAL.joint_values(math.radians(10), 0.0)
    )
    np.testing.assert_allclose(np.degrees(command), [12, 0], atol=1e-9)


def test_faster_servos_are_planned_for_as_well():
    fast = JointSpeeds(pan=math.radians(400), tilt=math.radians(400))
    pointing = Pointing(GIMBAL, fast, HALF_VIEW)
    q = GIMBAL.joint_values(math.radians(70), math.radians(10))
    command = pointing.command(still(120, 20), FRAME_S, q)
    # Over the zenith: pan 120 - 180 degrees.
    for _ in range(20):
        command = pointing.command(still(120, 20), FRAME_S, q)
        q = q + np.clip(command - q, -math.radians(400) * FRAME_S, math.radians(400) * FRAME_S)
    np.testing.assert_allclose(np.degrees(q), [-60, 80], atol=1e-6)


@pytest.mark.parametrize(
    ("azimuth_deg", "elevation_deg", "beyond"),
    [
        # aqua2's gaze gets 65 degrees down, to the front and over the zenith to the back, and pan 77.5 to each side:
        # beside 77.5 and 102.5 degrees level gazes end, and half a view of 10.5 hides 2 degrees of the gap.
        (0.0, 0.0, False),
        (0.0, -70.0, False),
        (0.0, -80.0, True),
        (180.0, 30.0, False),
        (90.0, 0.0, True),
        (86.0, 0.0, False),
        (90.0, 80.0, False),
    ],
)
def test_what_is_beyond_reach(azimuth_deg, elevation_deg, beyond):
    assert Pointing(GIMBAL, SPEEDS, HALF_VIEW).beyond_reach(direction(azimuth_deg, elevation_deg)) is beyond
