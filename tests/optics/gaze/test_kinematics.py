"""Gaze: azimuth = q1 and elevation = 2 q2, all inverse solutions, and the virtual camera as two reflections."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from optics.gaze.kinematics import (
    faces_light,
    forward_gaze,
    gaze_mirror_normal,
    gaze_nearest_to_rest,
    inverse_gaze,
    virtual_camera,
)
from optics.layout import Layout
from optics.mirror import PlaneMirror
from rigs import Joint, Rig

ROUNDING = 4e-15
"""About twenty float64 operations on angles and unit vectors."""

NEAR_ZENITH = 1e-3
"""Cosine of the gimbal's elevation below which the inverse is not asked to find the same pan: there any pan will do."""

INVERSE = 1e-12
"""Rounding of 1e-15 in the direction, magnified by 1 / NEAR_ZENITH in the pan angle."""

AQUA2 = Rig.load("aqua2")
LAYOUT = Layout.from_rig(AQUA2)
Q1, Q2 = np.meshgrid(np.radians(np.linspace(-77.5, 77.5, 63)), np.radians(np.linspace(-32.5, 122.5, 125)))


def wrapped(angle):
    return np.abs((angle + np.pi) % (2 * np.pi) - np.pi)


def angles(lowest_deg, highest_deg):
    """A rig file refuses numbers next to zero: to the nearest of 1e-9 degrees."""
    return st.floats(lowest_deg, highest_deg).map(lambda angle: round(angle, 9))


@st.composite
def joints(draw):
    lowest = draw(angles(-360, 300))
    return Joint(
        min_deg=lowest,
        max_deg=draw(angles(lowest + 1, 360)),
        offset_deg=draw(angles(-200, 200)),
        sign=draw(st.sampled_from([1, -1])),
    )


@st.composite
def layouts(draw):
    """The aqua2 with its camera turned anywhere and any joints."""
    angle = angles(-180, 180)
    camera = AQUA2.camera.model_copy(update={"yaw_deg": draw(angle), "pitch_deg": draw(angle), "roll_deg": draw(angle)})
    rig = AQUA2.with_gaze(joints={"pan": draw(joints()), "tilt": draw(joints())})
    return Layout.from_rig(rig.model_copy(update={"camera": camera}))


def elevation_in_gimbal(layout, direction):
    return np.arcsin(np.clip(layout.body_from_gimbal.rotation.inv().apply(direction)[2], -1, 1))


def within(joint, fraction):
    return np.radians(joint.min_deg + fraction * (joint.max_deg - joint.min_deg))


def test_azimuth_is_q1_and_elevation_is_twice_q2():
    """Eq. 5, over the whole joint range of the aqua2, past the zenith too: there the gaze comes down on the other side.

    The direction is exact everywhere; its azimuth is as ill-conditioned as the zenith is near.
    """
    gaze = forward_gaze(LAYOUT, Q1, Q2)
    expected = np.stack([np.cos(2 * Q2) * np.cos(Q1), np.cos(2 * Q2) * np.sin(Q1), np.sin(2 * Q2)], axis=-1)
    np.testing.assert_allclose(gaze.direction, expected, rtol=0, atol=ROUNDING)
    over = np.cos(2 * Q2) < 0
    azimuth, elevation = np.where(over, Q1 + np.pi, Q1), np.where(over, np.pi - 2 * Q2, 2 * Q2)
    np.testing.assert_allclose(gaze.elevation, elevation, rtol=0, atol=ROUNDING)
    assert (wrapped(gaze.azimuth - azimuth) * np.cos(elevation) <= ROUNDING).all()


def test_the_image_rolls_against_the_pan_at_level_gaze():
    """At q2 = 0 the periscope keeps M1's image upright only straight ahead: roll = -q1, clockwise from behind."""
    gaze = forward_gaze(LAYOUT, Q1[0], 0.0)
    np.testing.assert_allclose(gaze.roll, -Q1[0], rtol=0, atol=ROUNDING)


def test_the_roll_is_what_the_virtual_camera_shows():
    """Roll from the pose of the virtual camera: the angle of its x axis below the horizon, seen from behind."""
    for q1, q2 in ((0.3, 0.2), (-1.2, 0.5), (0.7, 1.5), (1.3, -0.5)):
        right, down, forward = virtual_camera(LAYOUT, q1, q2).rotation.as_matrix().T
        # x and y of the camera drop by sin(roll) and cos(roll), each times the cosine of the elevation.
        expected = np.arctan2(-right[2], -down[2])
        gaze = forward_gaze(LAYOUT, q1, q2)
        assert wrapped(gaze.roll - expected) < ROUNDING
        np.testing.assert_allclose(gaze.direction, forward, rtol=0, atol=ROUNDING)


@given(layout=layouts(), pan=st.floats(0, 1), tilt=st.floats(0, 1))
def test_sign_and_offset_turn_the_same_way_in_both_formulations(layout, pan, tilt):
    """The mirror's normal from the vectorised formula, and from the chain of frames that the solids are placed with."""
    q1, q2 = within(layout.pan, pan), within(layout.tilt, tilt)
    expected = layout.body_from_m2(q1, q2).rotation.as_matrix()[:, 2]
    np.testing.assert_allclose(gaze_mirror_normal(layout, q1, q2), expected, rtol=0, atol=ROUNDING)


@given(layout=layouts(), pan=st.floats(0, 1), tilt=st.floats(0, 1))
def test_the_inverse_contains_the_joints_it_came_from(layout, pan, tilt):
    """For any limits, offsets, signs and camera attitude; away from the gimbal's zenith, where pan is free."""
    q = np.array([within(layout.pan, pan), within(layout.tilt, tilt)])
    assume(abs(np.cos(2 * layout.tilt.angle(q[1]))) > NEAR_ZENITH)
    assume(faces_light(layout, q[1]))
    gaze = forward_gaze(layout, *q)
    # The body's own zenith makes the azimuth as uncertain, whatever the gimbal does.
    assume(np.cos(gaze.elevation) > NEAR_ZENITH)
    found = inverse_gaze(layout, float(gaze.azimuth), float(gaze.elevation))
    assert np.abs(found - q).max(axis=1).min() < 2 * INVERSE


@given(layout=layouts(), azimuth=st.floats(-np.pi, np.pi), elevation=st.floats(-np.pi / 2, np.pi / 2))
def test_every_inverse_solution_looks_there_and_is_within_the_limits(layout, azimuth, elevation):
    direction = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    found = inverse_gaze(layout, azimuth, elevation)
    assert found.shape[1:] == (2,)
    assert len(np.unique(found, axis=0)) == len(found)
    for q1, q2 in found:
        layout.check_joints(q1, q2)
        # At the nadir the mirror is edge-on.
        assert faces_light(layout, q2) or elevation_in_gimbal(layout, direction) < NEAR_ZENITH - np.pi / 2
        np.testing.assert_allclose(forward_gaze(layout, q1, q2).direction, direction, rtol=0, atol=ROUNDING)


def test_the_mirror_faces_the_light_where_its_normal_points_up():
    """M1 is above M2: a tilt of -45 degrees is edge-on, 135 too; between them the normal points upwards."""
    assert faces_light(LAYOUT, np.radians([-44.9, 0, 90, 134.9])).all()
    assert not faces_light(LAYOUT, np.radians([-45.1, -90, 135.1, 180])).any()
    normal = gaze_mirror_normal(LAYOUT, 0.3, np.radians([-44.9, -45.1, 134.9, 135.1]))
    assert (normal[:, 2] > 0).tolist() == [True, False, True, False]


def test_behind_is_reached_over_the_zenith_only():
    """The aqua2's pan ends at 77.5 degrees: straight back is q = (0, 90), over the zenith; (180, 0) is out of reach."""
    found = inverse_gaze(LAYOUT, np.pi, 0.0)
    np.testing.assert_allclose(found, [[0, np.pi / 2]], rtol=0, atol=ROUNDING)
    assert inverse_gaze(LAYOUT, 0.0, np.radians(-66)).shape == (0, 2)


def test_unlimited_joints_look_ahead_in_two_ways():
    """Over the front and over the zenith, up to whole turns; (0, -180) and (-180, -90) would look with the back."""
    free = Joint(min_deg=-180, max_deg=179)
    found = inverse_gaze(replace(LAYOUT, pan=free, tilt=free), 0.0, 0.0)
    expected = [[-180, 90], [0, 0]]
    np.testing.assert_allclose(np.degrees(found), expected, rtol=0, atol=1e-12)


def test_at_the_zenith_two_of_all_pan_angles_are_named():
    free = Joint(min_deg=-180, max_deg=180)
    found = inverse_gaze(replace(LAYOUT, pan=free), 0.0, np.pi / 2)
    np.testing.assert_allclose(np.degrees(found[:, 1]), 45, rtol=0, atol=1e-12)
    assert set(np.round(np.degrees(found[:, 0]), 9)) >= {0.0, 180.0}


@given(layout=layouts(), azimuth=st.floats(-np.pi, np.pi), elevation=st.floats(-np.pi / 2, np.pi / 2))
def test_of_many_directions_each_gets_the_solution_nearest_to_rest(layout, azimuth, elevation):
    """One after the other, and beside a direction that is looked at as well: straight ahead of the gimbal at rest."""
    ahead = forward_gaze(layout, 0.0, 0.0)
    directions = np.array([[azimuth, elevation], [ahead.azimuth, ahead.elevation]])
    q1, q2 = gaze_nearest_to_rest(layout, *directions.T)
    for q, direction in zip(np.stack([q1, q2], axis=-1), directions, strict=True):
        found = inverse_gaze(layout, *map(float, direction))
        if not len(found):
            assert np.isnan(q).all()
            continue
        assert np.abs(found - q).max(axis=1).min() < ROUNDING
        assert np.abs(q).max() < np.abs(found).max(axis=1).min() + ROUNDING


def test_a_gaze_that_is_not_a_number_is_refused():
    with pytest.raises(ValueError, match=r"expected finite azimuth and elevation, got nan and 0\.0"):
        inverse_gaze(LAYOUT, np.nan, 0.0)


@given(layout=layouts(), pan=st.floats(0, 1), tilt=st.floats(0, 1))
def test_the_virtual_camera_is_the_product_of_two_reflections(layout, pan, tilt):
    """As 4 x 4 matrices written here: I - 2 n n^T with the shift 2 (n . p) n; the product is proper (det +1)."""
    q1, q2 = within(layout.pan, pan), within(layout.tilt, tilt)
    product = np.eye(4)
    for pose in (layout.body_from_m1, layout.body_from_m2(q1, q2)):
        normal, point = pose.rotation.as_matrix()[:, 2], pose.translation
        matrix = np.eye(4)
        matrix[:3, :3] -= 2 * np.outer(normal, normal)
        matrix[:3, 3] = 2 * (normal @ point) * normal
        assert np.linalg.det(matrix) == pytest.approx(-1, abs=ROUNDING)
        product = matrix @ product
    found = virtual_camera(layout, q1, q2).as_matrix()
    np.testing.assert_allclose(found, product @ layout.body_from_camera.as_matrix(), rtol=0, atol=ROUNDING)
    assert np.linalg.det(found) == pytest.approx(1, abs=ROUNDING)


@given(q1=st.floats(-1.35, 1.35), q2=st.floats(-0.56, 2.1))
def test_the_virtual_camera_is_symmetric_about_the_mirror(q1, q2):
    """Figure 4: the camera's image in M1, at d2 + d1 above M2, and the virtual camera are equally far from M2's plane.

    It follows that its centre moves on a sphere of d1 + d2 around the centre of M2, opposite to the gaze.
    """
    pose = LAYOUT.body_from_m2(q1, q2)
    once = PlaneMirror.from_pose(LAYOUT.body_from_m1).reflection.apply(LAYOUT.body_from_camera.translation)
    twice = virtual_camera(LAYOUT, q1, q2).translation
    above, below = (pose.inv().apply(centre) for centre in (once, twice))
    np.testing.assert_allclose(below, above * [1, 1, -1], rtol=0, atol=ROUNDING)
    gaze = forward_gaze(LAYOUT, q1, q2).direction
    np.testing.assert_allclose(twice, pose.translation - 0.22 * gaze, rtol=0, atol=ROUNDING)


def test_shapes_follow_the_joints():
    gaze = forward_gaze(LAYOUT, Q1, Q2)
    assert gaze.azimuth.shape == gaze.elevation.shape == gaze.roll.shape == Q1.shape
    assert gaze.direction.shape == (*Q1.shape, 3)
    assert forward_gaze(LAYOUT, 0.1, 0.2).azimuth.shape == ()
    assert forward_gaze(LAYOUT, np.empty(0), 0.2).direction.shape == (0, 3)
