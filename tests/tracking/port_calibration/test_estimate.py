"""Calibration through ports of simulated sessions, whose truth is known."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation
from scipy.stats import chi2

from optics import DomePort, FisheyeCamera, FlatPort, PinholeCamera
from optics.perturbation.port_camera import PortCamera
from tracking import calibrate_port, simulated_observations
from tracking.port_calibration.bundle import Arrangement, Bundle
from tracking.port_calibration.estimate import PORT_POSE
from tracking.port_calibration.observations import MEDIA, board_handedness
from tracking.port_calibration.start import board_poses
from tracking.port_calibration.summary import as_dict

SIZE = {"width_px": 1920, "height_px": 1200, "fx_px": 1400.0, "fy_px": 1410.0, "cx_px": 970.0, "cy_px": 590.0}
PINHOLE = PinholeCamera(**SIZE, distortion=(-0.1, 0.02, 1e-3, 2e-3, 0.01))
FISHEYE = FisheyeCamera(**SIZE, distortion=(0.01, 0.02, 0.001, 0.001))
FLAT = FlatPort(distance_m=0.03, thickness_m=0.01, normal=(0.05, -0.03, 1))
DOME = DomePort(centre_m=(0.004, -0.02, -0.025), radius_m=0.05, thickness_m=0.006)
FLAT_GUESS = replace(FLAT, distance_m=0.015, normal=(0, 0, 1))
DOME_GUESS = replace(DOME, centre_m=(0, 0, 0))
NEARLY = replace(PINHOLE, fx_px=1390.0, fy_px=1390.0, distortion=(0.0,) * 5)
"""To begin with, where the search for a focal length is not what is tested."""

X, Y = np.meshgrid(np.arange(8), np.arange(5))
BOARD = 0.05 * np.stack([X.ravel(), Y.ravel()], axis=1)
HERE = RigidTransform.identity()
NOISE_PX = 0.2
ONE_IN_TEN_THOUSAND = 1 - 1e-4


def session(camera=PINHOLE, port=FLAT, *, seed=3, images=None, **options):
    images = images or {"bare": 6, "water": 8}
    return simulated_observations(
        [PortCamera(camera=camera, port=port)],
        [HERE],
        BOARD,
        images=images,
        distance_m=(0.5, 1.0),
        seed=seed,
        **options,
    )


def normalised_error(found, truth):
    """Squared error in units of the covariance, and how many parameters it is of."""
    names = [name for name in found.covariance.names if name.startswith("camera1.") or "." not in name]
    values = found.cameras["camera1"].values()
    error = np.array([values[name.rpartition(".")[2]] - truth.values()[name.rpartition(".")[2]] for name in names])
    return float(error @ np.linalg.solve(found.covariance.matrix[: len(names), : len(names)], error)), len(names)


@pytest.mark.parametrize(
    ("truth", "guess", "options", "images"),
    [
        (PortCamera(camera=PINHOLE, port=FLAT), FLAT_GUESS, {"also": ("n_water",)}, None),
        (PortCamera(camera=PINHOLE, port=DOME), DOME_GUESS, {"also": ("n_water",)}, None),
        (PortCamera(camera=FISHEYE, port=FLAT), FLAT_GUESS, {"lens": "fisheye"}, {"water": 12}),
    ],
    ids=["flat, air and water, index", "dome, air and water, index", "fisheye, flat, water alone"],
)
def test_nothing_known_beforehand_the_truth_is_found_within_the_covariance(truth, guess, options, images):
    found = calibrate_port(session(truth.camera, truth.port, images=images), ports=guess, **options)
    error, count = normalised_error(found, truth)
    assert found.converged
    assert not found.covariance.unobservable
    # The deviation of a median's size is 1.17 / sqrt(m) (Huber 1981).
    assert found.noise_px == pytest.approx(NOISE_PX, rel=4 * 1.17 / np.sqrt(found.off_px.size))
    assert error < chi2.ppf(ONE_IN_TEN_THOUSAND, count)
    assert not found.pinholes[0].fits_as_well
    assert found.pinholes[0].rms_px > found.pinholes[0].rms_with_port_px


def test_normalised_errors_are_chi_square():
    truth = PortCamera(camera=PINHOLE, port=FLAT)
    free = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", *PORT_POSE["flat"], "n_water")
    errors = []
    for seed in range(12):
        seen = session(seed=seed)
        bundle = Bundle(seen, [free])
        start = Arrangement(cameras=(truth,), camera_from_rig=(HERE,), rig_from_board=board_poses(seen, truth))
        at = bundle.solve(start, noise_px=NOISE_PX).arrangement
        off = np.array([at.cameras[0].values()[n] - truth.values()[n] for n in free])
        errors.append(off @ bundle.information(at, NOISE_PX) @ off)
    total, freedom = sum(errors), len(errors) * len(free)
    assert chi2.ppf(1 - ONE_IN_TEN_THOUSAND, freedom) < total < chi2.ppf(ONE_IN_TEN_THOUSAND, freedom)


def test_a_target_that_is_not_flat_is_enough_in_few_images():
    rng = np.random.default_rng(5)
    corner = rng.uniform((-0.2, -0.15, -0.1), (0.2, 0.15, 0.1), (60, 3))
    truth = PortCamera(camera=PINHOLE, port=FLAT)
    seen = simulated_observations(
        [truth], [HERE], corner, images={"water": 4}, distance_m=(0.6, 0.8), tilt_deg=30, noise_px=NOISE_PX
    )
    found = calibrate_port(seen, ports=FLAT_GUESS, intrinsics=[NEARLY])
    error, count = normalised_error(found, PortCamera(camera=PINHOLE, port=FLAT))
    assert not found.covariance.unobservable
    assert error < chi2.ppf(ONE_IN_TEN_THOUSAND, count)


def test_several_cameras_find_their_baseline():
    cameras = [PortCamera(camera=PINHOLE, port=FLAT), PortCamera(camera=replace(PINHOLE, cx_px=950.0), port=FLAT)]
    pose = RigidTransform.from_components([-0.12, 0.002, 0.005], Rotation.from_euler("xyz", [1, -4, 0.5], degrees=True))
    seen = simulated_observations(
        cameras, [HERE, pose], BOARD, images={"bare": 5, "water": 6}, distance_m=(0.6, 1.0), seed=1
    )
    found = calibrate_port(seen, ports=FLAT_GUESS, intrinsics=[NEARLY, NEARLY])
    deviations = found.covariance.standard_deviations()
    off = found.arrangement.camera_from_rig[1].translation - pose.translation
    assert np.abs(off[0]) < 4 * deviations["camera2.shift_x"]
    assert np.linalg.norm(off) < 0.001
    told = as_dict(found)
    assert told["cameras"]["camera2"]["camera_from_first_camera"][0][3] == pytest.approx(-0.12, abs=0.001)


def test_outliers_change_little():
    seen = session()
    spoiled = seen.pixels.copy()
    spoiled[::40] = np.clip(spoiled[::40] + 30, 0, 1100)
    found = calibrate_port(replace(seen, pixels=spoiled), ports=FLAT_GUESS, intrinsics=[NEARLY])
    error, count = normalised_error(found, PortCamera(camera=PINHOLE, port=FLAT))
    assert found.outlier_count >= len(spoiled[::40]) - 1
    assert error < 2 * chi2.ppf(ONE_IN_TEN_THOUSAND, count)


def test_a_centred_dome_is_a_pinhole_and_says_nothing_of_the_water():
    centred = replace(DOME, centre_m=(0.0, 0.0, 0.0))
    found = calibrate_port(session(port=centred), ports=centred, also=("n_water",), intrinsics=[NEARLY])
    assert found.pinholes[0].fits_as_well
    assert any("n_water" in combination for combination in found.covariance.unobservable)


def test_parallel_boards_are_told_and_what_they_leave_open():
    found = calibrate_port(session(images={"water": 4}, tilt_deg=0.0), ports=FLAT_GUESS, intrinsics=[NEARLY])
    assert any("parallel" in warning for warning in found.warnings)
    assert any("fx" in combination for combination in found.covariance.unobservable)


def test_every_problem_of_the_observations_is_told_at_once():
    seen = session(images={"water": 5})
    mirrored = seen.pixels.copy()
    first = seen.image == 0
    mirrored[first, 0] = 1919 - mirrored[first, 0]
    mirrored[seen.image == 1] = 1e5
    with pytest.raises(ValueError, match="expected pixels inside") as caught:
        calibrate_port(replace(seen, pixels=mirrored), ports=FLAT_GUESS, lens="zoom", also=("fx",), keep=("m1",))
    told = str(caught.value)
    for sentence in (
        "image image001: expected pixels inside the 1920 x 1200 image",
        "1 of 5 show it mirrored (camera1/image000)",
        "expected a lens of pinhole, brown4, brown, rational, fisheye, got 'zoom'",
        "expected to estimate one of n_water",
        "expected to keep one of",
    ):
        assert sentence in told


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"pixels": lambda seen: np.full_like(seen.pixels, 300.0)}, "the board is seen from its edge"),
        ({"board_m": lambda seen: 1e-6 * seen.board_m}, "expected a board of 0.001 to 100 m"),
        ({"board_m": lambda seen: seen.board_m * [1, 0, 0]}, "expected each point of the board once"),
        ({"sizes_px": lambda seen: ((10**9, 10**9),)}, "at most 20000 pixels a side"),
    ],
)
def test_points_that_tell_nothing_are_refused(changes, sentence):
    seen = session(images={"water": 4})
    with pytest.raises(ValueError, match=sentence):
        calibrate_port(replace(seen, **{name: change(seen) for name, change in changes.items()}), ports=FLAT_GUESS)


def test_one_image_is_too_few():
    with pytest.raises(ValueError, match="expected at least 3 images of the board, got 1"):
        calibrate_port(session(images={"water": 1}), ports=FLAT_GUESS)


def test_cameras_that_share_no_image_are_told():
    cameras = [PortCamera(camera=PINHOLE, port=FLAT)] * 2
    seen = simulated_observations(cameras, [HERE, HERE], BOARD, images={"water": 6}, distance_m=(0.6, 1.0))
    apart = seen.rows((seen.camera == 0) == (seen.image < 3))
    with pytest.raises(ValueError, match="camera camera2: expected images that another camera took at the same moment"):
        calibrate_port(apart, ports=FLAT_GUESS)


def test_a_mirrored_board_turns_the_other_way():
    assert board_handedness(BOARD, 1000 * BOARD) == 1
    assert board_handedness(BOARD, 1000 * BOARD * [-1, 1]) == -1


def test_media_are_named():
    assert MEDIA == ("bare", "air", "water")
