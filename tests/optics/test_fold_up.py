"""A rig that folds up over the hull: the rig that folds down, turned by half a turn about the camera's axis."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import RigidTransform, Rotation

from optics.coverage.coverage import compute_coverage
from optics.coverage.outcome import Outcome
from optics.coverage.sphere import cell_count, cell_directions, cells_of
from optics.feasibility.feasibility import feasibility_problems
from optics.gaze.jacobian import angle_jacobian
from optics.gaze.kinematics import faces_light, forward_gaze, inverse_gaze
from optics.layout import Layout
from optics.mesh import Group, PartMesh, Role
from optics.train import OpticalTrain
from rigs import Joint, Rig
from rigs.mounting import StowJoint

ROUNDING = 4e-15
"""About twenty float64 operations on metres and unit vectors below one."""

PIXEL_ROUNDING = 1e-9
"""Of a projected pixel: the project's own bound (`docs/explanation/optics.md`)."""

HALF_TURN = Rotation.from_euler("z", 180, degrees=True)
"""About the camera's axis, in the camera frame."""

DOWN = Rig.load("aqua2")
ANGLES = {"q1": st.floats(-1.3, 1.3), "q2": st.floats(-0.56, 0.56)}


def folding_up(rig: Rig) -> Rig:
    """The same rig, folding up; its joints' limits reversed, so that the mirror has the same range."""
    reversed_limits = {
        name: joint.model_copy(update={"min_deg": -joint.max_deg, "max_deg": -joint.min_deg})
        for name, joint in (("pan", rig.gaze.joints.pan), ("tilt", rig.gaze.joints.tilt))
    }
    return rig.with_gaze(
        fold_mirror={"direction": "up"},
        joints=reversed_limits,
    )


UP = folding_up(DOWN)


def test_the_axis_goes_to_image_up_and_the_gaze_mirror_is_there():
    layout = Layout.from_rig(UP)
    normal = layout.camera_from_m1.rotation.as_matrix()[:, 2]
    axis = np.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(axis - 2 * (axis @ normal) * normal, [0, -1, 0], rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(layout.body_from_gimbal.translation, [0.397, 0.06, 0.125], rtol=0, atol=ROUNDING)


@given(**ANGLES)
def test_its_mirrors_are_those_of_the_fold_down_turned_and_with_the_joints_reversed(q1, q2):
    up, down = Layout.from_rig(UP), Layout.from_rig(DOWN)
    for found, expected in (
        (up.camera_from_m1, down.camera_from_m1),
        (up.camera_from_m2(q1, q2), down.camera_from_m2(-q1, -q2)),
    ):
        turned = RigidTransform.from_rotation(HALF_TURN) * expected
        np.testing.assert_allclose(found.as_matrix(), turned.as_matrix(), rtol=0, atol=ROUNDING)


@given(**ANGLES)
def test_azimuth_is_still_q1_and_elevation_twice_q2(q1, q2):
    """Conventions of `docs/reference/conventions.md`, which do not depend on where the mirror stands (camera level)."""
    gaze = forward_gaze(Layout.from_rig(UP), q1, q2)
    expected = [np.cos(2 * q2) * np.cos(q1), np.cos(2 * q2) * np.sin(q1), np.sin(2 * q2)]
    np.testing.assert_allclose(gaze.direction, expected, rtol=0, atol=ROUNDING)


def test_offset_and_sign_mean_the_same_as_in_a_fold_down():
    joints = UP.gaze.joints.model_copy(update={"pan": Joint(min_deg=-90, max_deg=90, sign=-1, offset_deg=5.0)})
    layout = Layout.from_rig(UP.with_gaze(joints=joints))
    gaze = forward_gaze(layout, np.radians(20), 0.0)
    assert np.degrees(gaze.azimuth) == pytest.approx(-15, abs=1e-12)


@given(**ANGLES)
def test_the_image_rolls_against_the_fold_downs(q1, q2):
    """At q = 0 the image stands upright in both; panning rolls it by -q1 above, by q1 below, as a periscope does."""
    up, down = (forward_gaze(Layout.from_rig(rig), q1, q2).roll for rig in (UP, DOWN))
    assert np.cos(up + down) == pytest.approx(1, abs=ROUNDING)
    assert forward_gaze(Layout.from_rig(UP), 0.0, 0.0).roll == pytest.approx(
        forward_gaze(Layout.from_rig(DOWN), 0.0, 0.0).roll, abs=ROUNDING
    )


@given(azimuth=st.floats(-1.3, 1.3), elevation=st.floats(-1.0, 1.0))
def test_the_inverse_finds_the_gaze(azimuth, elevation):
    layout = Layout.from_rig(UP)
    found = inverse_gaze(layout, azimuth, elevation)
    np.testing.assert_allclose(found[np.abs(found[:, 0] - azimuth).argmin()], [azimuth, elevation / 2], atol=1e-12)
    expected = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    for q1, q2 in found:
        assert faces_light(layout, q2)
        np.testing.assert_allclose(forward_gaze(layout, q1, q2).direction, expected, rtol=0, atol=1e-14)


def test_azimuth_and_elevation_turn_as_eq_5_says():
    found = angle_jacobian(Layout.from_rig(UP), 0.3, 0.2)
    np.testing.assert_allclose(found, np.diag([1.0, 2.0]), rtol=0, atol=1e-13)


def test_rays_and_pixels_are_those_of_the_fold_down_turned():
    """A pixel turned about the principal point, through the turned train: the ray is the turned one, and back."""
    pixels = np.random.default_rng(0).uniform([100, 80], [540, 400], (50, 2))
    turned_pixels = 2 * np.array([DOWN.camera.cx_px, DOWN.camera.cy_px]) - pixels
    up = OpticalTrain.from_rig(UP, q1=0.4, q2=0.1)
    expected, found = OpticalTrain.from_rig(DOWN, q1=-0.4, q2=-0.1).trace(pixels), up.trace(turned_pixels)
    np.testing.assert_array_equal(found.status, expected.status)
    np.testing.assert_allclose(found.origin_m, HALF_TURN.apply(expected.origin_m), rtol=0, atol=1e-14)
    np.testing.assert_allclose(found.direction, HALF_TURN.apply(expected.direction), rtol=0, atol=1e-14)
    seen = found.status == 0
    assert seen.sum() > 10
    image = up.project((found.origin_m + 2 * found.direction)[seen])
    np.testing.assert_allclose(image.pixels, turned_pixels[seen], rtol=0, atol=PIXEL_ROUNDING)


def slab(*, turned: bool) -> PartMesh:
    """A plate behind the gaze mirror, on one side only; turned about the camera's axis or not."""
    corners = np.array([[x, y, z] for x in (0.0, 0.25) for y in (0.0, 0.3) for z in (-0.2, -0.19)])
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
    faces += [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    pinhole = np.array(DOWN.camera.position_mm) / 1000
    if turned:
        corners = pinhole + (corners - pinhole) * [1, -1, -1]
    return PartMesh(name="slab", group=Group.FIXED, role=Role.HULL, vertices_m=corners, faces=np.array(faces, np.int32))


def test_coverage_is_mirrored():
    """Over reversed joint values each outcome of each pose is the same, and the sphere is turned with the mount."""
    q1, q2 = np.radians([-60.0, 10.0, 50.0]), np.radians([-20.0, 30.0, 100.0])
    small = {"columns": 16, "rows": 12, "nside": 8}
    down = compute_coverage(DOWN, [slab(turned=False)], q1=q1, q2=q2, **small)
    up = compute_coverage(UP, [slab(turned=True)], q1=-q1, q2=-q2, **small)
    assert down.pixels[..., Outcome.HULL].any()
    np.testing.assert_array_equal(up.pixels, down.pixels)
    np.testing.assert_allclose(up.solid_angle_sr, down.solid_angle_sr, rtol=0, atol=1e-12)
    turned = cells_of(cell_directions(8) * [1, -1, -1], 8)
    assert len(turned) == cell_count(8)
    # A ray on the border of two cells may fall to either side of it.
    assert np.mean(up.covered[turned] == down.covered) > 0.99


def test_a_tilt_that_shows_the_mirrors_back_is_named_with_the_range_of_a_fold_up():
    joints = UP.gaze.joints.model_copy(update={"tilt": Joint(min_deg=-60, max_deg=60)})
    problems = feasibility_problems(UP.with_gaze(joints=joints))
    wrong = next(problem for problem in problems if problem.place == "joints.tilt.max_deg")
    assert "between -135 and 45 deg, not 60" in wrong.expected


def test_a_stowing_servo_needs_a_hinge_within_its_travel():
    servo = DOWN.gaze.servos.pan
    with_servo = DOWN.with_gaze(servos={"stow": servo})
    found = {problem.place: problem.expected for problem in feasibility_problems(with_servo)}
    assert found == {"servos.stow": "no servo, as there is no hinge joints.stow"}
    for max_deg, places in ((servo.travel_deg, []), (servo.travel_deg + 1, ["joints.stow.max_deg"])):
        hinged = with_servo.gaze.joints.model_copy(update={"stow": StowJoint(max_deg=max_deg)})
        problems = feasibility_problems(with_servo.with_gaze(joints=hinged))
        assert [problem.place for problem in problems] == places
