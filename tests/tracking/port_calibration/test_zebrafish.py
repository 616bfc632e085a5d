"""Real images: two cameras that look into an aquarium, one from above, one through its front wall.

Data of Pedersen, Bengtson, Gade, Madsen and Moeslund, Camera calibration for underwater 3D reconstruction based on ray
tracing using Snell's law, CVPR workshops 2018 (github.com/ahmedanan418/Underwater_calibration, MIT). They take the
corners of the aquarium's openings for the places of the cameras and of the refracting planes, air to water (1.33)
without a wall, and put each fish where the rays of both cameras are nearest.
"""

from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from optics import FlatPort, NoPort, PinholeCamera
from optics.kernels.tables import read_table
from optics.perturbation.port_camera import PortCamera
from tracking import calibrate_port, read_corners, triangulate
from tracking.port_calibration.tracks import nearest_points, reprojection_errors

DATA = Path(__file__).parent / "data"

# Their calibration in air (camera.pkl): OpenCV's rational model.
MATRIX = np.array([[1216.332661, 0, 1346.726313], [0, 1214.756630, 745.207908], [0, 0, 1]])
DISTORTION = (
    *(-2.17592999, 3.89512440, -1.61294798e-03, -5.96601488e-04),
    *(0.612865818, -1.91796440, 3.30844936, 1.67470520),
)
LENS = PinholeCamera(
    width_px=2704,
    height_px=1520,
    fx_px=MATRIX[0, 0],
    fy_px=MATRIX[1, 1],
    cx_px=MATRIX[0, 2],
    cy_px=MATRIX[1, 2],
    distortion=DISTORTION,
)
# Corners of the opening that each camera looks through (cam1_references.json, cam2_references.json): pixels, metres.
TOP = (
    np.array([[2222, 1127], [260, 1290], [263, 269], [2087, 155.0]]),
    np.array([[0, 0, 0], [0.387, 0, 0], [0.387, 0.208, 0], [0, 0.208, 0]]),
)
FRONT = (
    np.array([[288, 179], [2498, 265], [2368, 1261], [394, 1288.0]]),
    np.array([[0, 0.208, 0], [0.387, 0.208, 0], [0.382, 0.203, 0.195], [0.005, 0.203, 0.195]]),
)
THEIR_MEDIANS_PX = (2.13, 2.49)
"""Of all 8,408 fish (err1, err2 in detections_triangulated.csv)."""


def behind_its_opening(corners_px, corners_m):
    """Camera with the plane of the opening as its port, and its pose."""
    _, turn, shift = cv2.solvePnP(corners_m, corners_px, MATRIX, np.array(DISTORTION))
    pose = RigidTransform.from_components(shift.ravel(), Rotation.from_rotvec(turn.ravel()))
    first, second, third, _ = pose.apply(corners_m)
    normal = np.cross(first - second, third - second)
    normal = normal * np.sign(normal[2]) / np.linalg.norm(normal)
    # Glass of the index of water: they have none.
    port = FlatPort(distance_m=normal @ first, thickness_m=1e-9, normal=normal, n_port=1.33, n_water=1.33)
    return PortCamera(camera=LENS, port=port), pose


@pytest.fixture(scope="module")
def aquarium():
    cameras, poses = zip(*(behind_its_opening(*opening) for opening in (TOP, FRONT)), strict=True)
    table = read_table(DATA / "zebrafish_tracks.csv")
    pixels = np.array([[table[f"{name}_u_px"], table[f"{name}_v_px"]] for name in ("top", "front")]).transpose(0, 2, 1)
    theirs_m = np.stack([table[f"{axis}_mm"] for axis in "xyz"], axis=1) / 1000
    errors = np.stack([table["top_error_px"], table["front_error_px"]])
    return cameras, poses, pixels, theirs_m, errors


def test_fish_are_where_the_authors_found_them(aquarium):
    cameras, poses, pixels, theirs_m, their_errors = aquarium
    found = nearest_points(cameras, poses, pixels)
    off_m = np.linalg.norm(found - theirs_m, axis=1)
    assert np.median(off_m) < 1e-6
    errors = np.median(reprojection_errors(cameras, poses, found, pixels), axis=1)
    # Their own projection, the root of a quartic, gives a hundredth less on the same points; why is not known.
    np.testing.assert_allclose(errors, np.median(their_errors, axis=1), rtol=0.02)
    np.testing.assert_allclose(errors, THEIR_MEDIANS_PX, rtol=0.15)


def test_least_squares_of_pixels_leave_less(aquarium):
    cameras, poses, pixels, *_ = aquarium
    nearest = reprojection_errors(cameras, poses, nearest_points(cameras, poses, pixels), pixels)
    best = reprojection_errors(cameras, poses, triangulate(cameras, poses, pixels), pixels)
    known = np.isfinite(nearest + best).all(axis=0)
    squares = [(errors[:, known] ** 2).sum(axis=0) for errors in (best, nearest)]
    assert (squares[0] <= squares[1] + 1e-9).all()
    assert np.median(squares[0]) < 0.95 * np.median(squares[1])


def test_their_chessboard_in_air_gives_the_lens_that_opencv_finds():
    seen = read_corners(DATA / "zebrafish_corners.csv")
    found = calibrate_port(seen, ports=NoPort())
    views = [seen.image == index for index in range(len(seen.images))]
    boards = [seen.places_m[view].astype(np.float32) for view in views]
    pixels = [seen.pixels[view].astype(np.float32) for view in views]
    rms_px, matrix, *_ = cv2.calibrateCamera(boards, pixels, seen.sizes_px[0], None, None)
    lens = found.cameras["camera"].camera
    # Some images are blurred: OpenCV's least squares follow them, ours less.
    assert rms_px <= found.rms_px < 1.01 * rms_px
    assert (lens.fx_px, lens.fy_px) == pytest.approx((matrix[0, 0], matrix[1, 1]), rel=0.003)
    assert (lens.cx_px, lens.cy_px) == pytest.approx((matrix[0, 2], matrix[1, 2]), abs=3)
