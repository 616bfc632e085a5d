"""Cameras against OpenCV, against closed forms and against themselves; what they cannot say is reported."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optics.camera import FisheyeCamera, PinholeCamera, _brown_conrady, camera_from_spec
from optics.kernels.backend import Float64
from rigs import Rig

AFFINE = {"width_px": 640, "height_px": 480, "fx_px": 500.0, "fy_px": 510.0, "cx_px": 322.0, "cy_px": 236.0}

MATRIX = np.array([[500.0, 0, 322.0], [0, 510.0, 236.0], [0, 0, 1]])

FIVE = (-0.28, 0.09, 8e-4, -6e-4, -0.012)
"""Brown-Conrady of a webcam-like lens: barrel, some decentring."""

EIGHT = (0.35, -0.2, 8e-4, -6e-4, 0.01, 0.6, -0.15, 0.02)
"""Rational model."""

FISHEYE = (-0.013, 0.002, -0.0014, 0.0002)

ROUND_TRIP_PX = 1e-9
"""The inverse stops at 1e-12 normalised units, which 500 px make 5e-10 px."""

SAME_FORMULA_PX = 1e-10
"""OpenCV evaluates the same polynomial in float64: rounding of numbers up to 1000 px."""

CAMERAS = {
    "pinhole": PinholeCamera(**AFFINE),
    "five": PinholeCamera(**AFFINE, distortion=FIVE),
    "eight": PinholeCamera(**AFFINE, distortion=EIGHT),
    "equidistant": FisheyeCamera(**AFFINE),
    "fisheye": FisheyeCamera(**AFFINE, distortion=FISHEYE),
}


def pixels_of_the_image(count=2000, seed=1):
    return np.random.default_rng(seed).uniform([-0.5, -0.5], [639.5, 479.5], (count, 2))


@pytest.mark.parametrize("name", ["pinhole", "five", "eight"])
def test_pinhole_projects_as_opencv(name):
    points = np.random.default_rng(2).uniform([-0.6, -0.45, 1.0], [0.6, 0.45, 1.0], (2000, 3))
    expected, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), MATRIX, np.array(CAMERAS[name].distortion))
    pixels, valid = CAMERAS[name].project(points)
    assert valid.all()
    np.testing.assert_allclose(pixels, expected[:, 0], rtol=0, atol=SAME_FORMULA_PX)


@pytest.mark.parametrize("name", ["five", "eight"])
def test_the_inverse_uses_the_true_derivative(name):
    """The Jacobian that Newton and the fold use, against OpenCV's derivatives of the pixel by the translation.

    At unit depth these are fx and fy times the Jacobian of the distortion; a wrong one would still converge, slowly.
    """
    camera = CAMERAS[name]
    parameters = camera.parameters()
    for x, y in ((0.0, 0.0), (0.3, -0.2), (-0.5, 0.4)):
        expected = cv2.projectPoints(
            np.array([[x, y, 1.0]]), np.zeros(3), np.zeros(3), MATRIX, np.array(camera.distortion)
        )[1][:, 3:5]
        _, _, jacobian = _brown_conrady(parameters["coefficients"], Float64(x), Float64(y))
        found = np.array([np.array(entry)[0] for entry in jacobian]).reshape(2, 2) * [[500], [510]]
        np.testing.assert_allclose(found, expected, rtol=0, atol=SAME_FORMULA_PX)


@pytest.mark.parametrize("name", ["equidistant", "fisheye"])
def test_fisheye_projects_as_opencv(name):
    points = np.random.default_rng(3).normal(size=(2000, 3))
    points[:, 2] = np.abs(points[:, 2])  # OpenCV's fisheye ends at 90 degrees
    expected, _ = cv2.fisheye.projectPoints(
        points[:, None], np.zeros((3, 1)), np.zeros((3, 1)), MATRIX, np.array(CAMERAS[name].distortion)
    )
    pixels, valid = CAMERAS[name].project(points)
    assert valid.all()
    np.testing.assert_allclose(pixels, expected[:, 0], rtol=0, atol=SAME_FORMULA_PX)


@pytest.mark.parametrize("name", ["five", "eight"])
def test_pinhole_unprojects_as_opencv(name):
    """OpenCV iterates a fixed point where we use Newton; it is asked for the same residual."""
    pixels = pixels_of_the_image()
    stop = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 500, 1e-13)
    expected = cv2.undistortPoints(
        pixels[:, None], MATRIX, np.array(CAMERAS[name].distortion), R=np.eye(3), P=np.eye(3), criteria=stop
    )
    directions, valid = CAMERAS[name].unproject(pixels)
    assert valid.all()
    np.testing.assert_allclose(directions[:, :2] / directions[:, 2:], expected[:, 0], rtol=0, atol=1e-10)


def test_the_principal_point_looks_along_the_axis():
    for camera in CAMERAS.values():
        directions, valid = camera.unproject([[322.0, 236.0]])
        assert directions.tolist() == [[0, 0, 1]]
        assert valid.tolist() == [True]


def test_pinhole_is_a_tangent_and_equidistant_fisheye_an_angle():
    """Closed forms: u = cx + fx tan(t) and u = cx + fx t."""
    angle = np.radians([1, 20, 40])
    directions = np.stack([np.sin(angle), np.zeros(3), np.cos(angle)], axis=1)
    for name, radius in (("pinhole", np.tan(angle)), ("equidistant", angle)):
        pixels, _ = CAMERAS[name].project(3 * directions)
        np.testing.assert_allclose(pixels[:, 0], 322 + 500 * radius, rtol=0, atol=SAME_FORMULA_PX)


@pytest.mark.parametrize("name", CAMERAS)
def test_project_undoes_unproject_everywhere_in_the_image(name):
    pixels = pixels_of_the_image()
    directions, valid = CAMERAS[name].unproject(pixels)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, rtol=0, atol=1e-15)
    again, seen = CAMERAS[name].project(directions)
    assert (valid & seen).all()
    np.testing.assert_allclose(again, pixels, rtol=0, atol=ROUND_TRIP_PX)


@given(
    distortion=st.tuples(
        st.floats(-0.5, 0.5),
        st.floats(-0.2, 0.2),
        st.floats(-2e-3, 2e-3),
        st.floats(-2e-3, 2e-3),
        st.floats(-0.05, 0.05),
    ),
    seed=st.integers(0, 2**16),
)
def test_what_is_called_valid_is_one_direction_and_one_pixel(distortion, seed):
    """For any lens, folded or not: valid pixels come back to themselves, valid directions too."""
    camera = PinholeCamera(**AFFINE, distortion=distortion)
    pixels = pixels_of_the_image(50, seed)
    directions, valid = camera.unproject(pixels)
    again, seen = camera.project(directions[valid])
    assert seen.all()
    np.testing.assert_allclose(again, pixels[valid], rtol=0, atol=ROUND_TRIP_PX)

    slopes = np.random.default_rng(seed).uniform(-2.5, 2.5, (50, 2))
    seen_pixels, seen = camera.project(np.column_stack([slopes, np.ones(50)]))
    back, converged = camera.unproject(seen_pixels[seen])
    back = back[converged]
    # Near the fold a pixel's error is magnified without bound; 1e-12 in the image is 1e-6 in angle there.
    np.testing.assert_allclose(back[:, :2] / back[:, 2:], slopes[seen][converged], rtol=0, atol=1e-5)


def test_a_lens_that_folds_back_sees_nothing_beyond_the_fold():
    """k1 = -1/2, k2 = 1/10: d(r f(r))/dr = 1 - 3/2 r^2 + 1/2 r^4 is zero at r = 1 and at r = sqrt 2.

    Beyond sqrt 2 the polynomial grows again, and slope 1.5 would land at 0.572, inside the image of r < 1, whose
    edge is r = 1 with 0.6: a ghost. Neither side may call it valid.
    """
    camera = PinholeCamera(**AFFINE, distortion=(-0.5, 0.1, 0, 0, 0))
    slopes = np.array([0.5, 0.999, 1.001, 1.3, 1.5, 2.0])
    _, valid = camera.project(np.stack([slopes, np.zeros(6), np.ones(6)], axis=1))
    assert valid.tolist() == [True, True, False, False, False, False]
    ghost = [[322 + 500 * 1.5 * (1 - 0.5 * 1.5**2 + 0.1 * 1.5**4), 236.0]]
    directions, valid = camera.unproject(ghost)
    assert not valid.any() or directions[0, 0] / directions[0, 2] < 1
    assert not camera.unproject([[322 + 500 * 0.61, 236.0]])[1].any()


def test_a_pole_of_the_rational_model_is_its_end():
    """k4 = -1: the denominator vanishes at r = 1, and beyond it image points change sign."""
    camera = PinholeCamera(**AFFINE, distortion=(0, 0, 0, 0, 0, -1.0, 0, 0))
    _, valid = camera.project([[0.9, 0, 1], [1.1, 0, 1], [3.0, 0, 1]])
    assert valid.tolist() == [True, False, False]


def test_a_fisheye_ends_where_its_polynomial_turns():
    """k1 = -1/3: d/dt (t - t^3 / 3) = 1 - t^2 vanishes at 1 rad; without distortion the end is the way back, pi."""
    camera = FisheyeCamera(**AFFINE, distortion=(-1 / 3, 0, 0, 0))
    angle = np.array([0.99, 1.01, 2.0])
    directions = np.stack([np.sin(angle), np.zeros(3), np.cos(angle)], axis=1)
    assert camera.project(directions)[1].tolist() == [True, False, False]
    assert not camera.unproject([[322 + 500 * 0.67, 236.0]])[1].any()  # the edge of the image is at 2/3
    behind = [[np.sin(3.1), 0, np.cos(3.1)], [0, 0, -1]]
    assert CAMERAS["equidistant"].project(behind)[1].tolist() == [True, False]


@pytest.mark.parametrize("name", CAMERAS)
def test_what_has_no_direction_or_no_pixel_is_not_valid(name):
    camera = CAMERAS[name]
    _, valid = camera.unproject([[np.nan, 1], [1, np.inf], [1e200, 0], [-1e300, 1e300]])
    assert not valid.any()
    _, valid = camera.project([[np.nan, 0, 1], [0, 0, -1], [0, np.nan, np.nan]])
    assert not valid.any()


@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize("count", [0, 1, 5])
def test_shapes_follow_the_batch(name, count):
    directions, valid = CAMERAS[name].unproject(np.ones((count, 2)))
    assert (directions.shape, valid.shape, valid.dtype) == ((count, 3), (count,), bool)
    pixels, valid = CAMERAS[name].project(np.ones((count, 3)))
    assert (pixels.shape, valid.shape, valid.dtype) == ((count, 2), (count,), bool)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"fx_px": 0.0}, "expected fx_px > 0, got 0.0"),
        ({"fy_px": np.nan}, "expected fy_px > 0, got nan"),
        ({"width_px": -1}, "expected width_px > 0, got -1"),
        ({"cx_px": np.inf}, "expected a finite cx_px, got inf"),
    ],
)
def test_wrong_numbers_are_refused(change, message):
    for model in (PinholeCamera, FisheyeCamera):
        with pytest.raises(ValueError, match=message):
            model(**{**AFFINE, **change})


def test_wrong_coefficients_are_refused():
    with pytest.raises(ValueError, match="expected 5 or 8 distortion coefficients, got 4"):
        PinholeCamera(**AFFINE, distortion=(0, 0, 0, 0))
    with pytest.raises(ValueError, match="expected 4 distortion coefficients, got 5"):
        FisheyeCamera(**AFFINE, distortion=(0, 0, 0, 0, 0))
    with pytest.raises(ValueError, match="expected finite distortion coefficients"):
        PinholeCamera(**AFFINE, distortion=(np.nan, 0, 0, 0, 0))


def test_a_rig_files_camera_is_built_from_its_numbers():
    spec = Rig.load("aqua2").camera
    camera = camera_from_spec(spec)
    assert isinstance(camera, PinholeCamera)
    assert (camera.width_px, camera.fx_px, camera.cy_px) == (spec.width_px, spec.fx_px, spec.cy_px)
