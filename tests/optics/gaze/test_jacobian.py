"""How the gaze turns with the joints: closed forms, difference quotients, the singular set."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from optics.gaze.jacobian import angle_jacobian, direction_jacobian, joint_rates, manipulability
from optics.gaze.kinematics import forward_gaze
from optics.layout import Layout
from rigs import Joint, Rig

AQUA2 = Rig.load("aqua2")
LAYOUT = Layout.from_rig(AQUA2)

OBLIQUE = replace(
    Layout.from_rig(
        AQUA2.model_copy(
            update={
                "camera": AQUA2.camera.model_copy(update={"yaw_deg": 25.0, "pitch_deg": -15.0, "roll_deg": 40.0}),
            }
        )
    ),
    pan=Joint(min_deg=-100, max_deg=100, offset_deg=20.0, sign=-1),
    tilt=Joint(min_deg=-130, max_deg=60, offset_deg=-5.0, sign=-1),
)

ANGLES = st.floats(-1.5, 1.5)
ROUNDING = 1e-14
"""Products of a few numbers of the order of one."""

STEP = 1e-4
"""Central differences of functions with derivatives up to 8 are good to 8 STEP^2 / 6, and to rounding 1e-16 / STEP."""

QUOTIENT = 2e-8


def derivatives(function, q1, q2):
    columns = [(function(q1 + a, q2 + b) - function(q1 - a, q2 - b)) / (2 * STEP) for a, b in ((STEP, 0), (0, STEP))]
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("layout", [LAYOUT, OBLIQUE], ids=["level", "oblique"])
@given(q1=ANGLES, q2=ANGLES)
def test_the_direction_turns_as_difference_quotients_say(layout, q1, q2):
    expected = derivatives(lambda a, b: forward_gaze(layout, a, b).direction, q1, q2)
    np.testing.assert_allclose(direction_jacobian(layout, q1, q2), expected, rtol=0, atol=QUOTIENT)


@given(q1=ANGLES, q2=ANGLES)
def test_its_singular_values_are_two_and_the_cosine_of_twice_the_tilt(q1, q2):
    values = np.linalg.svd(direction_jacobian(OBLIQUE, q1, q2), compute_uv=False)
    turned = abs(np.cos(2 * OBLIQUE.tilt.angle(q2)))
    np.testing.assert_allclose(values, [2, turned], rtol=0, atol=ROUNDING)
    assert manipulability(OBLIQUE, q2) == pytest.approx(turned, abs=ROUNDING)


@given(q1=ANGLES, q2=ANGLES)
def test_azimuth_and_elevation_turn_as_eq_5_says(q1, q2):
    """For a level camera: azimuth with q1, elevation with 2 q2, and down again beyond the zenith."""
    level = abs(np.cos(2 * q2))
    assume(level > 1e-3)
    expected = np.diag([1, 2 * np.sign(np.cos(2 * q2))])
    # Rounding in the direction turns its azimuth by 1 / level as much; the azimuth's derivative divides by it again.
    np.testing.assert_allclose(angle_jacobian(LAYOUT, q1, q2), expected, rtol=0, atol=ROUNDING / level**2)


@given(q1=ANGLES, q2=ANGLES)
def test_azimuth_and_elevation_turn_as_difference_quotients_say(q1, q2):
    level = np.cos(forward_gaze(OBLIQUE, q1, q2).elevation)
    assume(level > 0.1)

    def angles(a, b):
        seen = forward_gaze(OBLIQUE, a, b)
        # An azimuth relative to the middle does not wrap.
        relative = (seen.azimuth - forward_gaze(OBLIQUE, q1, q2).azimuth + np.pi) % (2 * np.pi) - np.pi
        return np.stack([relative, seen.elevation], axis=-1)

    # The third derivatives grow with the third power of 1 / cos elevation, and so do the quotients' errors.
    np.testing.assert_allclose(
        angle_jacobian(OBLIQUE, q1, q2), derivatives(angles, q1, q2), rtol=0, atol=10 * QUOTIENT / level**3
    )


def test_pan_does_not_turn_the_gaze_at_the_zenith():
    """The aqua2's tilt of 45 degrees."""
    assert manipulability(LAYOUT, np.radians(45)) < ROUNDING
    # sign -1, offset -5: the tilt angle runs from 125 down to -65 degrees, over -45 and 45.
    for q2 in np.radians([-50, 40]):
        assert manipulability(OBLIQUE, q2) < ROUNDING
        assert np.linalg.matrix_rank(direction_jacobian(OBLIQUE, 0.3, q2), tol=1e-9) == 1
    assert np.isnan(angle_jacobian(LAYOUT, 0.3, np.pi / 4)).all()


def test_pan_runs_ever_faster_towards_the_zenith():
    """To turn the gaze across at 1 rad/s takes a pan rate of 1 / cos(elevation)."""
    for from_zenith in (0.5, 0.1, 1e-3):
        q2 = np.pi / 4 - from_zenith / 2
        rates = joint_rates(LAYOUT, 0.0, q2, [0.0, 1.0, 0.0])
        # Rounding 1e-16 of the cosine, over the cosine itself.
        np.testing.assert_allclose(rates, [1 / np.sin(from_zenith), 0], rtol=1e-12, atol=1e-12)


@given(q1=ANGLES, q2=ANGLES, rate=st.tuples(*[st.floats(-1, 1)] * 3))
def test_joint_rates_turn_the_gaze_as_wanted(q1, q2, rate):
    assume(manipulability(OBLIQUE, q2) > 1e-3)
    direction = forward_gaze(OBLIQUE, q1, q2).direction
    wanted = np.array(rate) - direction * (direction @ np.array(rate))
    found = direction_jacobian(OBLIQUE, q1, q2) @ joint_rates(OBLIQUE, q1, q2, rate)
    np.testing.assert_allclose(found, wanted, rtol=0, atol=ROUNDING / 1e-3)


def test_shapes_follow_the_joints():
    q1, q2 = np.zeros((3, 1)), np.zeros(4)
    assert direction_jacobian(LAYOUT, q1, q2).shape == (3, 4, 3, 2)
    assert angle_jacobian(LAYOUT, q1, q2).shape == (3, 4, 2, 2)
    assert joint_rates(LAYOUT, q1, q2, [0, 1, 0]).shape == (3, 4, 2)
