"""Frames of a rig: eqs. 1-3 of Cortes-Perez & Torres-Mendez 2021, joints, and the camera's angles as words say."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optics.layout import Layout, camera_pose
from rigs import Joint, Rig

ROUNDING = 1e-15
"""Metres and unit vectors: a few float64 operations on numbers below one."""

AQUA2 = Rig.load("aqua2")
LAYOUT = Layout.from_rig(AQUA2)


def turned(**angles):
    return AQUA2.camera.model_copy(update=angles)


def test_a_rig_is_laid_out_once():
    rig = Rig.load("aqua2")
    assert Layout.from_rig(rig.with_(mount__wall_mm=5.0)) is Layout.from_rig(rig)


def test_an_untilted_camera_looks_forward_with_its_image_up():
    """REP-103: camera z, x, y are body x, -y, -z."""
    axes = camera_pose(turned()).rotation.as_matrix()
    np.testing.assert_allclose(axes, [[0, 0, 1], [-1, 0, 0], [0, -1, 0]], rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(camera_pose(turned()).translation, [0.302, 0.06, 0], rtol=0, atol=ROUNDING)


@pytest.mark.parametrize(
    ("angles", "camera_axis", "body_axis"),
    [
        ({"yaw_deg": 90.0}, [0, 0, 1], [0, 1, 0]),  # looks left
        ({"pitch_deg": 90.0}, [0, 0, 1], [0, 0, 1]),  # looks up
        ({"roll_deg": 90.0}, [1, 0, 0], [0, 0, -1]),  # clockwise from behind: image-right points down
        ({"yaw_deg": 90.0, "pitch_deg": 90.0}, [0, -1, 0], [0, -1, 0]),  # pitch first: then the image's top turns
        ({"pitch_deg": 90.0, "roll_deg": 90.0}, [1, 0, 0], [1, 0, 0]),  # roll first
    ],
)
def test_yaw_is_left_pitch_is_up_roll_is_clockwise(angles, camera_axis, body_axis):
    found = camera_pose(turned(**angles)).rotation.apply(camera_axis)
    np.testing.assert_allclose(found, body_axis, rtol=0, atol=ROUNDING)


def test_the_fold_mirror_sends_the_axis_to_image_down():
    """Eq. 1: M1 is d1 along the camera's z, at 45 degrees, so that its reflection of z is the camera's y."""
    pose = LAYOUT.camera_from_m1
    np.testing.assert_allclose(pose.translation, [0, 0, 0.095], rtol=0, atol=ROUNDING)
    normal = pose.rotation.as_matrix()[:, 2]
    axis = np.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(axis - 2 * (axis @ normal) * normal, [0, 1, 0], rtol=0, atol=ROUNDING)
    assert normal @ axis < 0  # the reflecting face looks at the camera


@given(q1=st.floats(-1.35, 1.35), q2=st.floats(-0.56, 2.1))
def test_the_centre_of_the_gaze_mirror_does_not_move(q1, q2):
    """Eqs. 2-3: the joint axes cross at the centre of M2's face, which is at d1 along z and then d2 along y."""
    np.testing.assert_allclose(LAYOUT.camera_from_m2(q1, q2).translation, [0, 0.125, 0.095], rtol=0, atol=ROUNDING)


@given(q1=st.floats(-1.35, 1.35), q2=st.floats(-0.56, 2.1))
def test_the_gaze_mirror_pans_about_the_vertical_and_tilts_about_its_own_width(q1, q2):
    """Figure 6, with a level camera: M2's width stays horizontal, q1 turns it, q2 raises the normal."""
    axes = LAYOUT.body_from_m2(q1, q2).rotation.as_matrix()
    width, normal = axes[:, 0], axes[:, 2]
    elevation = np.pi / 4 + q2
    expected = [np.cos(elevation) * np.cos(q1), np.cos(elevation) * np.sin(q1), np.sin(elevation)]
    np.testing.assert_allclose(normal, expected, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(width, [-np.sin(q1), np.cos(q1), 0], rtol=0, atol=ROUNDING)
    assert np.linalg.det(axes) == pytest.approx(1, abs=4 * ROUNDING)


@pytest.mark.parametrize("fold", ["down", "up"])
@pytest.mark.parametrize(("sign", "offset"), [(1, 0), (-1, 5)])
def test_frames_of_many_joint_values_are_those_of_each(fold, sign, offset):
    joint = Joint(min_deg=-90, max_deg=90, sign=sign, offset_deg=offset)
    rig = AQUA2.with_gaze(joints={"pan": joint, "tilt": joint}, fold_mirror={"direction": fold})
    layout = Layout.from_rig(rig.model_copy(update={"camera": turned(yaw_deg=20.0, pitch_deg=-10.0)}))
    q1, q2 = np.random.default_rng(0).uniform([-1.3, -0.5], [1.3, 0.5], (20, 2)).T
    pan, tilt = layout.moving_frames(q1, q2)
    for k in range(len(q1)):
        np.testing.assert_allclose(pan[k], layout.body_from_pan(q1[k]).as_matrix(), rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(tilt[k], layout.body_from_m2(q1[k], q2[k]).as_matrix(), rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("fold", ["down", "up"])
def test_the_mount_frame_looks_along_the_camera_and_the_fold_frame_has_m2_below(fold):
    """By their definitions: x is the camera's z, and z its -y (image-up) or against the fold; the pinhole stays."""
    camera = turned(yaw_deg=20.0, pitch_deg=-30.0, roll_deg=40.0)
    rig = AQUA2.with_gaze(fold_mirror={"direction": fold}).model_copy(update={"camera": camera})
    layout = Layout.from_rig(rig)
    to_body = layout.body_from_camera.rotation
    for frame, up in (
        (layout.body_from_mount, np.array([0.0, -1.0, 0.0])),
        (layout.body_from_fold, -layout.fold_direction),
    ):
        axes = frame.rotation.as_matrix()
        np.testing.assert_allclose(axes[:, 0], to_body.apply([0, 0, 1]), rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(axes[:, 2], to_body.apply(up), rtol=0, atol=ROUNDING)
        pinhole = layout.body_from_camera.translation
        np.testing.assert_allclose(frame.apply(pinhole), pinhole, rtol=0, atol=ROUNDING)
    gimbal = layout.body_from_fold.inv().apply(layout.body_from_gimbal.translation)
    np.testing.assert_allclose(gimbal, [0.302 + 0.095, 0.06, -0.125], rtol=0, atol=ROUNDING)


def test_the_mount_frame_of_a_camera_that_looks_ahead_is_the_body():
    for frame in (LAYOUT.body_from_mount, LAYOUT.body_from_fold):
        assert np.array_equal(frame.as_matrix(), np.eye(4))


@pytest.mark.parametrize(("sign", "offset", "expected_deg"), [(1, 0, 10), (-1, 0, -10), (1, 5, 15), (-1, 5, -5)])
def test_the_optical_angle_is_sign_times_q_plus_offset(sign, offset, expected_deg):
    joint = Joint(min_deg=-90, max_deg=90, sign=sign, offset_deg=offset)
    layout = Layout.from_rig(AQUA2.with_gaze(joints={"pan": joint, "tilt": joint}))
    assert np.degrees(layout.pan.angle(np.radians(10))) == pytest.approx(expected_deg, abs=1e-13)
    assert np.degrees(layout.tilt.angle(np.radians(10))) == pytest.approx(expected_deg, abs=1e-13)


def test_joint_limits_are_inside_and_what_is_outside_is_named():
    for q1 in (-77.5, 77.5):
        for q2 in (-32.5, 122.5):
            LAYOUT.check_joints(np.radians(q1), np.radians(q2))
    message = r"expected q1 \(pan\) between -77\.5 and 77\.5 deg, got 78; expected q2 \(tilt\) between"
    with pytest.raises(ValueError, match=message):
        LAYOUT.check_joints(np.radians(78), np.radians(-33))
    with pytest.raises(ValueError, match="got nan"):
        LAYOUT.check_joints(0.0, np.nan)


def test_a_rig_without_mirrors_has_no_layout():
    with pytest.raises(ValueError, match="expected a rig with mirrors, got 'bench', which has none"):
        Layout.from_rig(Rig.load("bench"))
