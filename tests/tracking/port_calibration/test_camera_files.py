"""Files of other programs: what they write is read, and what is written they read."""

import json

import cv2
import numpy as np
import pytest
import yaml

from optics import DomePort, FisheyeCamera, FlatPort, PinholeCamera
from optics.perturbation.port_camera import PortCamera
from tracking.port_calibration.board_files import read_target
from tracking.port_calibration.boards import AprilGrid, Chessboard
from tracking.port_calibration.camera_input import read_intrinsics
from tracking.port_calibration.camera_output import colmap_text, foxglove_json, opencv_yaml, ros_yaml
from tracking.port_calibration.pinhole_fit import FOUR_TERMS, TERMS, fit_pinhole, undistortion_maps

SIZE = {"width_px": 640, "height_px": 480, "fx_px": 500.0, "fy_px": 501.0, "cx_px": 320.5, "cy_px": 239.0}
PINHOLE = PinholeCamera(**SIZE, distortion=(-0.1, 0.02, 1e-3, 2e-3, 0.01))
FISHEYE = FisheyeCamera(**SIZE, distortion=(0.01, 0.02, 0.001, 0.001))
FLAT = PortCamera(camera=PINHOLE, port=FlatPort(distance_m=0.03, thickness_m=0.01, normal=(0.05, -0.03, 1)))
DOME = PortCamera(camera=FISHEYE, port=DomePort(centre_m=(0.001, 0.0, -0.004), radius_m=0.05, thickness_m=0.006))

OPENCV = """%YAML:1.0
---
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 500., 0., 320.5, 0., 501., 239., 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ -0.1, 0.02, 1e-03, 2e-03, 0.01 ]
"""
KALIBR = """cam0:
  camera_model: pinhole
  intrinsics: [500.0, 501.0, 320.5, 239.0]
  distortion_model: equidistant
  distortion_coeffs: [0.01, 0.02, 0.001, 0.001]
  resolution: [640, 480]
"""
COLMAP = """# Camera list with one line of data per camera:
1 FULL_OPENCV 640 480 500 501 321 239.5 -0.1 0.02 1e-3 2e-3 0.01 0 0 0
2 OPENCV_FISHEYE 640 480 500 501 321 239.5 0.01 0.02 0.001 0.001
"""


@pytest.mark.parametrize(
    ("text", "wanted"), [(OPENCV, [PINHOLE]), (KALIBR, [FISHEYE]), (COLMAP, [PINHOLE, FISHEYE])], ids=("o", "k", "c")
)
def test_intrinsics_of_other_programs_are_read(text, wanted, tmp_path):
    (tmp_path / "camera.yaml").write_text(text)
    found = read_intrinsics(tmp_path / "camera.yaml")
    assert [type(each) for each in found] == [type(each) for each in wanted]
    for camera, other in zip(found, wanted, strict=True):
        numbers, others = (PortCamera(camera=each, port=FLAT.port).values() for each in (camera, other))
        assert numbers == pytest.approx(others)


def test_opencvs_xml_is_read(tmp_path):
    path = str(tmp_path / "camera.xml")
    storage = cv2.FileStorage(path, cv2.FILE_STORAGE_WRITE)
    storage.write("image_width", 640)
    storage.write("image_height", 480)
    storage.write("camera_matrix", np.array([[500, 0, 320.5], [0, 501, 239], [0, 0, 1.0]]))
    storage.write("distortion_coefficients", np.array([PINHOLE.distortion]))
    storage.release()
    assert read_intrinsics(tmp_path / "camera.xml") == [PINHOLE]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("a: [", "expected YAML"),
        ("- 1", "expected keys with values"),
        ("image_width: 3", "expected a key 'camera_matrix'"),
        (OPENCV.replace("500.", ".nan"), "expected finite numbers"),
        (OPENCV + "distortion_model: mystery\n", "expected a distortion_model of plumb_bob"),
        (KALIBR.replace("pinhole", "omni"), "expected camera_model pinhole, got 'omni'"),
        ("1 THIN_PRISM_FISHEYE 640 480 1 1", "expected a camera model of SIMPLE_PINHOLE"),
        ("1 PINHOLE 640 480 1 1", "expected 4 parameters of PINHOLE"),
    ],
)
def test_bad_files_are_refused_with_their_place(text, sentence, tmp_path):
    path = tmp_path / "camera.yaml"
    path.write_text(text)
    with pytest.raises(ValueError, match=sentence) as caught:
        read_intrinsics(path)
    assert str(path) in str(caught.value)


def test_kalibrs_targets_are_read(tmp_path):
    path = tmp_path / "target.yaml"
    path.write_text("target_type: aprilgrid\ntagCols: 6\ntagRows: 5\ntagSize: 0.088\ntagSpacing: 0.3\n")
    assert read_target(path) == AprilGrid(columns=6, rows=5, tag_m=0.088, spacing=0.3)
    grid = "targetCols: 7\ntargetRows: 6\nrowSpacingMeters: 0.03\ncolSpacingMeters: 0.03\n"
    path.write_text(f"target_type: checkerboard\n{grid}")
    assert read_target(path) == Chessboard(columns=7, rows=6, square_m=0.03)
    path.write_text("target_type: circlegrid\n")
    with pytest.raises(ValueError, match="got 'circlegrid'"):
        read_target(path)


@pytest.fixture(scope="module")
def fits():
    return {camera: fit_pinhole(camera, (0.5, 1.0, 2.0), TERMS[camera.model]) for camera in (FLAT, DOME)}


@pytest.mark.parametrize("camera", [FLAT, DOME], ids=["flat", "dome"])
def test_the_fit_says_how_far_it_is_off(camera, fits):
    """Seen by OpenCV, the fit is as far off the exact projection as it says, at a distance that was fitted."""
    fit = fits[camera]
    pixels = np.random.default_rng(0).uniform((20, 20), (620, 460), (400, 2))
    origin, direction = camera.rays(pixels)
    points = fit.pinhole_from_camera.apply(origin + direction)
    matrix = np.array([[fit.lens.fx_px, 0, fit.lens.cx_px], [0, fit.lens.fy_px, fit.lens.cy_px], [0, 0, 1]])
    project = cv2.projectPoints if camera is FLAT else cv2.fisheye.projectPoints
    here = np.zeros(3)
    seen = project(points[:, np.newaxis].copy(), here, here, matrix, np.array(fit.lens.distortion))[0].reshape(-1, 2)
    off = np.linalg.norm(seen - pixels, axis=1)
    assert np.sqrt((off**2).mean()) < 1.3 * fit.rms_px[1]
    assert off.max() < 1.01 * fit.largest_px[1]
    assert fit.rms_px[1] < 0.5


def test_remap_tables_are_exact_at_their_distance(fits):
    fit = fits[FLAT]
    map_u, map_v = undistortion_maps(FLAT, fit, 1.0)
    x, y = 100, 400
    slope = np.array([(x - fit.lens.cx_px) / fit.lens.fx_px, (y - fit.lens.cy_px) / fit.lens.fy_px, 1.0])
    point = fit.pinhole_from_camera.inv().apply(slope / np.linalg.norm(slope))
    wanted = FLAT.project(point[np.newaxis])[0]
    assert (map_u[y, x], map_v[y, x]) == pytest.approx(wanted, abs=1e-4)


def test_opencv_and_ros_read_what_is_written(fits, tmp_path):
    fit = fits[FLAT]
    storage = cv2.FileStorage(opencv_yaml(fit, "pinhole"), cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    assert storage.getNode("distortion_coefficients").mat().ravel().tolist() == list(fit.lens.distortion)
    assert storage.getNode("rms_px").mat().ravel().tolist() == list(fit.rms_px)
    told = yaml.safe_load(ros_yaml("front", fit, "pinhole"))
    assert told["distortion_model"] == "plumb_bob"
    assert told["camera_matrix"]["data"][2] == fit.lens.cx_px
    (tmp_path / "ros.yaml").write_text(ros_yaml("front", fit, "pinhole"))
    (tmp_path / "opencv.yaml").write_text(opencv_yaml(fits[DOME], "fisheye"))
    assert read_intrinsics(tmp_path / "ros.yaml") == [fit.lens]
    assert read_intrinsics(tmp_path / "opencv.yaml") == [fits[DOME].lens]
    message = json.loads(foxglove_json("front", fits[DOME], "fisheye"))
    assert message["distortion_model"] == "kannala_brandt"
    assert len(message["K"]) == len(message["R"]) == 9
    assert len(message["P"]) == 12


def test_kalibrs_fit_has_four_coefficients():
    fit = fit_pinhole(FLAT, (1.0,), FOUR_TERMS["pinhole"])
    assert fit.lens.distortion[4] == 0


def test_colmap_gets_the_exact_port():
    lines = colmap_text({"a": FLAT, "b": DOME}).splitlines()
    assert lines[1] == "--ImageReader.camera_model FULL_OPENCV"
    numbers = lines[2].split('"')[1].split(",")
    assert [float(number) for number in numbers[:5]] == [500.0, 501.0, 321.0, 239.5, -0.1]
    port = [float(number) for number in lines[4].split('"')[1].split(",")]
    assert port == pytest.approx([0.05, -0.03, 1, 0.03, 0.01, 1.0, 1.49, 1.333])
    assert lines[3] == "--ImageReader.camera_refrac_model FLATPORT"
    assert "--ImageReader.camera_refrac_model DOMEPORT" in lines
