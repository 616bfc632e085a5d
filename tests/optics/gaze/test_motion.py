"""Moving the gaze: the paper's 120 deg/s and 1.5 s, the branch reached first, the virtual camera's sphere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optics.gaze.kinematics import forward_gaze, inverse_gaze, virtual_camera, virtual_centre
from optics.gaze.motion import JointSpeeds, gaze_speed, joint_solutions, move_time, nearest_solution, shortest_change
from optics.gaze.summary import gaze_at, gaze_towards
from optics.layout import Layout
from rigs import Joint, Rig

AQUA2 = Rig.load("aqua2")
LAYOUT = Layout.from_rig(AQUA2)
SPEEDS = JointSpeeds.from_rig(AQUA2)
FREE = replace(LAYOUT, pan=Joint(min_deg=-180, max_deg=180), tilt=Joint(min_deg=-90, max_deg=180))

ROUNDING = 1e-12
"""Degrees to radians and back, and a few sums, at most."""


def test_the_servos_of_the_paper_turn_the_gaze_at_120_degrees_per_second():
    """Section 4: 60 deg/s "implies a rotation speed of 120 deg/s of the virtual camera"."""
    assert AQUA2.gaze.servos.tilt.name == "hs5086wp-paper"
    across, upwards = np.degrees(gaze_speed(LAYOUT, SPEEDS, 0.0))
    assert upwards == pytest.approx(120, abs=ROUNDING)
    # By pan the gaze turns as fast as the servo, a thing that the paper does not say.
    assert across == pytest.approx(60, abs=ROUNDING)
    assert np.degrees(gaze_speed(LAYOUT, SPEEDS, np.radians(30)))[0] == pytest.approx(30, abs=ROUNDING)


def test_half_a_turn_of_the_gaze_takes_one_and_a_half_seconds():
    """Section 4: "system takes 1.5 s to change the gaze direction 180 deg": from ahead over the zenith to behind."""
    assert shortest_change(LAYOUT, SPEEDS, (0.0, 0.0), (np.pi, 0.0)) == pytest.approx(1.5, abs=ROUNDING)
    # By pan alone it would take 3 s; with free joints the zenith is still the shorter way.
    assert shortest_change(FREE, SPEEDS, (0.0, 0.0), (np.pi, 0.0)) == pytest.approx(1.5, abs=ROUNDING)
    slow_tilt = JointSpeeds(pan=SPEEDS.pan, tilt=SPEEDS.tilt / 3)
    assert shortest_change(FREE, slow_tilt, (0.0, 0.0), (np.pi, 0.0)) == pytest.approx(3.0, abs=ROUNDING)


def test_a_change_of_gaze_is_at_least_as_quick_as_any_pair_of_branches():
    start, goal = (0.3, 0.2), (2.5, -0.4)
    times = [
        max(abs(b - a) / [SPEEDS.pan, SPEEDS.tilt])
        for a in inverse_gaze(FREE, *start)
        for b in inverse_gaze(FREE, *goal)
    ]
    assert len(times) > 2
    assert shortest_change(FREE, SPEEDS, start, goal) == pytest.approx(min(times), abs=ROUNDING)
    assert shortest_change(LAYOUT, SPEEDS, start, (0.0, np.radians(-80))) == np.inf


def test_a_move_takes_the_longer_of_the_joints_times():
    speeds = JointSpeeds(pan=2.0, tilt=0.5)
    times = move_time(speeds, [0.0, 0.0], [[1.0, 0.1], [1.0, 1.0]])
    np.testing.assert_allclose(times, [0.5, 2.0], rtol=0, atol=ROUNDING)


@given(azimuth=st.floats(-3.1, 3.1), elevation=st.floats(-1.5, 1.5), q=st.tuples(st.floats(-3, 3), st.floats(-1.5, 3)))
def test_the_chosen_branch_looks_there_and_none_is_reached_sooner(azimuth, elevation, q):
    found = nearest_solution(FREE, SPEEDS, azimuth, elevation, q)
    direction = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    np.testing.assert_allclose(forward_gaze(FREE, *found).direction, direction, rtol=0, atol=ROUNDING)
    others = inverse_gaze(FREE, azimuth, elevation)
    assert move_time(SPEEDS, q, found) <= move_time(SPEEDS, q, others).min() + ROUNDING


def test_the_speeds_decide_which_branch_is_nearest():
    """A gaze to the left behind, 135 degrees: pan 135 with level tilt, or pan -45 and tilt 90, over the zenith."""
    goal = (np.radians(135), 0.0)
    by_tilt = nearest_solution(FREE, SPEEDS, *goal, (0.0, 0.0))
    np.testing.assert_allclose(np.degrees(by_tilt), [-45, 90], rtol=0, atol=1e-9)
    by_pan = nearest_solution(FREE, JointSpeeds(pan=3.0, tilt=1.0), *goal, (0.0, 0.0))
    np.testing.assert_allclose(np.degrees(by_pan), [135, 0], rtol=0, atol=1e-9)


def test_at_the_zenith_pan_stays_where_it_is():
    found = nearest_solution(LAYOUT, SPEEDS, 1.0, np.pi / 2, (0.7, 0.0))
    np.testing.assert_allclose(found, [0.7, np.pi / 4], rtol=0, atol=ROUNDING)
    assert joint_solutions(LAYOUT, 1.0, np.pi / 2, (9.0, 0.0))[0][0] == pytest.approx(np.radians(77.5))


def test_a_gaze_out_of_reach_is_a_sentence():
    with pytest.raises(ValueError, match=r"within the joints' reach, got azimuth 10 deg, elevation -80 deg"):
        nearest_solution(LAYOUT, SPEEDS, np.radians(10), np.radians(-80), (0.0, 0.0))
    with pytest.raises(ValueError, match="expected a rig with mirrors, got 'bench', which has none"):
        JointSpeeds.from_rig(Rig.load("bench"))


@given(q1=st.floats(-1.3, 1.3), q2=st.floats(-0.5, 2.1))
def test_the_virtual_centre_is_that_of_the_virtual_camera(q1, q2):
    """From the product of two reflections; its distance from M2's centre is d1 + d2 = 95 + 125 mm."""
    found = virtual_centre(LAYOUT, q1, q2)
    np.testing.assert_allclose(found, virtual_camera(LAYOUT, q1, q2).translation, rtol=0, atol=ROUNDING)
    assert np.linalg.norm(found - LAYOUT.body_from_gimbal.translation) == pytest.approx(0.22, abs=ROUNDING)


def test_with_pan_alone_the_virtual_centre_runs_on_a_circle():
    centres = virtual_centre(LAYOUT, np.linspace(-1.3, 1.3, 9), 0.2) - LAYOUT.body_from_gimbal.translation
    np.testing.assert_allclose(centres[:, 2], centres[0, 2], rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(np.hypot(*centres[:, :2].T), 0.22 * np.cos(0.4), rtol=0, atol=ROUNDING)


def test_the_summary_is_in_degrees_and_agrees_with_its_parts():
    report = gaze_towards(AQUA2, azimuth_deg=150.0, elevation_deg=20.0)
    # Over the zenith: pan 150 - 180, tilt (180 - 20) / 2; 80 degrees at 60 deg/s.
    assert (report["q1_deg"], report["q2_deg"]) == (pytest.approx(-30), pytest.approx(80))
    assert report["time_s"] == pytest.approx(80 / 60)
    assert (report["azimuth_deg"], report["elevation_deg"]) == (pytest.approx(150), pytest.approx(20))
    assert report["condition"] == pytest.approx(2 / np.cos(np.radians(20)))
    assert gaze_at(AQUA2, q1_deg=10.0, q2_deg=45.0)["condition"] is None
    assert gaze_at(AQUA2, q1_deg=10.0, q2_deg=45.0)["jacobian"] == [[None, None], [None, None]]
