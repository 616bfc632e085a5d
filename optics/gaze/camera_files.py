"""Files that carry a virtual pinhole to OpenCV and ROS, written as text: neither needs to be installed.

OpenCV's `cv2.FileStorage` reads the first; `camera_calibration_parsers` and `camera_info_manager` of ROS read the
second. Numbers are written with all their digits.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from optics.gaze.virtual_pinhole import VirtualPinhole
from optics.kernels.arrays import FloatArray
from rigs.atomic_files import atomic_files

OPENCV_FILE = "virtual_camera_opencv.yaml"
ROS_FILE = "virtual_camera_ros.yaml"


def opencv_yaml(virtual: VirtualPinhole) -> str:
    """OpenCV's FileStorage text: size, camera_matrix, distortion_coefficients, and the pose.

    `body_from_virtual_camera` takes points of the camera (x right, y down, z forward) to the body, metres. The rest
    says for which joint values and distances it was fitted, and how well.
    """
    residuals = virtual.residuals
    return "\n".join(
        [
            "%YAML:1.0",
            "---",
            f"image_width: {virtual.camera.width_px}",
            f"image_height: {virtual.camera.height_px}",
            *matrix_lines("camera_matrix", virtual.camera_matrix),
            *matrix_lines("distortion_coefficients", np.array([virtual.camera.distortion])),
            *matrix_lines("body_from_virtual_camera", virtual.body_from_virtual.as_matrix()),
            f"q1_deg: {float(np.degrees(virtual.q1))!r}",
            f"q2_deg: {float(np.degrees(virtual.q2))!r}",
            *matrix_lines("fitted_region_px", np.array([virtual.region_px])),
            *matrix_lines("fitted_at_m", np.array([[row.distance_m for row in residuals]])),
            *matrix_lines("rms_px", np.array([[row.rms_px for row in residuals]])),
            *matrix_lines("largest_px", np.array([[row.largest_px for row in residuals]])),
            "",
        ]
    )


def ros_yaml(virtual: VirtualPinhole, name: str) -> str:
    """ROS's CameraInfo as `camera_calibration_parsers` writes it: plumb_bob, no rectification.

    It has no place for the pose: that is a transform from the body to the camera's optical frame.
    """
    projection = np.hstack([virtual.camera_matrix, np.zeros((3, 1))])
    return "\n".join(
        [
            f"image_width: {virtual.camera.width_px}",
            f"image_height: {virtual.camera.height_px}",
            f"camera_name: {name}",
            *matrix_lines("camera_matrix", virtual.camera_matrix, ros=True),
            "distortion_model: plumb_bob",
            *matrix_lines("distortion_coefficients", np.array([virtual.camera.distortion]), ros=True),
            *matrix_lines("rectification_matrix", np.eye(3), ros=True),
            *matrix_lines("projection_matrix", projection, ros=True),
            "",
        ]
    )


def write_camera_files(virtual: VirtualPinhole, name: str, folder: Path) -> list[Path]:
    """Write both files into a folder, made when it is missing; nothing is left half-written."""
    contents = {OPENCV_FILE: opencv_yaml(virtual), ROS_FILE: ros_yaml(virtual, name)}
    with atomic_files(folder) as scratch:
        for file, text in contents.items():
            (scratch / file).write_text(text, encoding="utf-8")
    return [folder / file for file in contents]


def matrix_lines(name: str, matrix: FloatArray, *, ros: bool = False) -> Iterable[str]:
    """Lines of a matrix in OpenCV's or ROS's YAML."""
    # Python's shortest text of a float64 reads back as the same number.
    numbers = ", ".join(repr(float(value)) for value in matrix.ravel())
    rows, columns = matrix.shape
    yield f"{name}:" if ros else f"{name}: !!opencv-matrix"
    yield f"   rows: {rows}"
    yield f"   cols: {columns}"
    if not ros:
        yield "   dt: d"
    yield f"   data: [ {numbers} ]"
