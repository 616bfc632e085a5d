"""`mirrorgaze calibrate-port`: what it prints and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform
from typer.testing import CliRunner

from mirrorgaze.cli import app
from optics import FlatPort, PinholeCamera
from optics.perturbation.port_camera import PortCamera
from tracking import simulated_observations
from tracking.port_calibration.camera_input import read_intrinsics
from tracking.port_calibration.corner_files import write_corners

CAMERA = PinholeCamera(width_px=1280, height_px=960, fx_px=1000.0, fy_px=1002.0, cx_px=640.0, cy_px=470.0)
PORT = FlatPort(distance_m=0.03, thickness_m=0.008, normal=(0.03, 0.02, 1))
X, Y = np.meshgrid(np.arange(7), np.arange(5))
BOARD = 0.05 * np.stack([X.ravel(), Y.ravel()], axis=1)


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, ["calibrate-port", *map(str, arguments)])


@pytest.fixture(scope="module")
def corners(tmp_path_factory):
    """File of a session in water."""
    path = tmp_path_factory.mktemp("session") / "corners.csv"
    seen = simulated_observations(
        [PortCamera(camera=CAMERA, port=PORT)],
        [RigidTransform.identity()],
        BOARD,
        images={"bare": 5, "water": 6},
        distance_m=(0.5, 1.0),
        noise_px=0.1,
    )
    write_corners(path, seen)
    return path


def test_it_tells(corners):
    result = mirrorgaze(corners, "--thickness-mm", 8, "--lens", "pinhole", "--distance-mm", 15)
    assert result.exit_code == 0, result.stderr
    lines = result.stdout.splitlines()
    assert lines[0].split() == ["parameter", "estimate", "std.", "dev."]
    rows = {line.split()[0]: [float(number) for number in line.split()[1:3]] for line in lines[1:8]}
    for name, wanted in (("fx", 1000.0), ("port_distance", 30.0), ("port_tilt_y", np.degrees(np.arctan2(0.03, 1)))):
        value, deviation = rows[f"camera1.{name}"]
        assert abs(value - wanted) < 4.5 * deviation
    assert any("a plain pinhole fits worse" in line for line in lines)


def test_json_holds_the_same_and_files_are_written(corners, here):
    (here / "air.txt").write_text("1 PINHOLE 1280 960 990 990 640.5 480.5\n")
    start = ("--thickness-mm", 8, "--lens", "pinhole", "--intrinsics", "air.txt")
    result = mirrorgaze(corners, *start, "-o", "port", "--json")
    assert result.exit_code == 0, result.stderr
    told = json.loads(result.stdout)
    assert sorted(Path(file).name for file in told["files"]) == [
        "calibration.json",
        "camera1_foxglove.json",
        "camera1_opencv.yaml",
        "camera1_remap.npz",
        "camera1_ros.yaml",
        "colmap_underwater.txt",
        "corners.csv",
        "kalibr_camchain.yaml",
    ]
    assert json.loads((here / "port/calibration.json").read_text())["parameters"] == told["parameters"]
    assert read_intrinsics(here / "port/kalibr_camchain.yaml")[0].width_px == 1280
    assert told["converged"]
    assert told["outliers"] == 0
    assert len(told["covariance"]["matrix"]) == len(told["parameters"]) == 7
    assert told["cameras"]["camera1"]["port"] == "flat"


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ([], "expected CORNERS or images (--water-images, --air, --bare), either or"),
        (["corners.csv", "--water-images", "pool"], "either or"),
        (["corners.csv", "--port", "cube"], "expected --port flat, dome or none, got 'cube'"),
        (["corners.csv", "--port", "dome"], "expected --radius-mm > 0"),
        (["corners.csv", "--intrinsics", "air.txt"], "air.txt: No such file"),
        (["corners.csv", "--keep-intrinsics"], "expected intrinsics to keep, got none"),
        (["corners.csv", "--size-px", "big"], "expected --size-px as two whole numbers"),
        (["--water-images", "pool", "--square-mm", "25"], "expected --columns of at least 3, got 0"),
        (["--water-images", "nowhere", "--board", "wood"], "nowhere: expected a folder with images"),
    ],
)
def test_what_cannot_be_is_refused_with_a_sentence(arguments, sentence, here, corners):
    (here / "corners.csv").write_bytes(corners.read_bytes())
    (here / "pool").mkdir()
    cv2.imwrite("pool/1.png", np.zeros((90, 120), dtype=np.uint8))
    result = mirrorgaze(*arguments)
    assert result.exit_code == 2
    assert sentence in result.stderr


def test_every_problem_of_the_images_is_told_at_once(here):
    (here / "pool").mkdir()
    cv2.imwrite("pool/1.png", np.zeros((90, 120), dtype=np.uint8))
    cv2.imwrite("pool/2.png", np.zeros((80, 120), dtype=np.uint8))
    (here / "pool" / "3.png").write_text("no image")
    result = mirrorgaze("--water-images", "pool", "--columns", 4, "--rows", 3, "--square-mm", 25)
    assert result.exit_code == 2
    for sentence in (
        "3.png: expected an image, got something that cannot be read as one",
        "expected images of one size, got 120 x 90 (1, such as 1.png), 120 x 80 (1, such as 2.png)",
        "found the board in none of 2 images",
    ):
        assert sentence in result.stderr
