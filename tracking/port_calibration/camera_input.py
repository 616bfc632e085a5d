"""Intrinsics that other programs wrote: OpenCV, ROS, Kalibr and COLMAP."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from optics.camera import FisheyeCamera, PinholeCamera
from optics.kernels.tables import finite_number, listed_problems, read_text
from optics.perturbation.port_camera import Lens
from tracking.port_calibration.yaml_files import read_yaml

PIXEL_CENTRE = 0.5
"""COLMAP counts from the corner of the top-left pixel, we and OpenCV from its centre."""

FISHEYES = ("equidistant", "fisheye", "kannala_brandt")
PINHOLES = ("plumb_bob", "rational_polynomial", "radtan", "none")

COLMAP_LINE = re.compile(r"^\d+\s+[A-Z_]+\s+\d+\s+\d+\s")

COLMAP_MODELS = {
    "SIMPLE_PINHOLE": ("pinhole", "f cx cy"),
    "PINHOLE": ("pinhole", "fx fy cx cy"),
    "SIMPLE_RADIAL": ("pinhole", "f cx cy k1"),
    "RADIAL": ("pinhole", "f cx cy k1 k2"),
    "OPENCV": ("pinhole", "fx fy cx cy k1 k2 p1 p2"),
    "FULL_OPENCV": ("pinhole", "fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6"),
    "SIMPLE_RADIAL_FISHEYE": ("fisheye", "f cx cy k1"),
    "RADIAL_FISHEYE": ("fisheye", "f cx cy k1 k2"),
    "OPENCV_FISHEYE": ("fisheye", "fx fy cx cy k1 k2 k3 k4"),
}
"""Models of COLMAP (`src/colmap/sensor/models.h`) that are ours, and their parameters in order."""

COEFFICIENTS = {"pinhole": ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"], "fisheye": ["k1", "k2", "k3", "k4"]}


def read_intrinsics(path: Path) -> list[Lens]:
    """Cameras of a file: OpenCV's (YAML, XML), ROS's camera_info, Kalibr's camchain, or COLMAP's cameras.txt.

    Raises
    ------
    ValueError
        With what is wrong with the file.
    """
    try:
        return _cameras(path)
    except KeyError as error:
        raise ValueError(listed_problems(str(path), [f"expected a key {error}"])) from None
    except (TypeError, ValueError) as error:
        told = str(error)
        raise ValueError(told if told.startswith(str(path)) else listed_problems(str(path), [told])) from None


def _cameras(path: Path) -> list[Lens]:
    if path.suffix.lower() == ".xml":
        return [_of_opencv(_xml(path))]
    lines = [line for line in read_text(path).splitlines() if line.strip() and not line.startswith("#")]
    if lines and all(COLMAP_LINE.match(line) for line in lines):
        return [_of_colmap(line.split()) for line in lines]
    content = read_yaml(path)
    chain = [content[key] for key in sorted(content) if re.fullmatch(r"cam\d+", key)]
    return [_of_kalibr(each) for each in chain] if chain else [_of_opencv(content)]


def _of_opencv(content: dict[str, Any]) -> Lens:
    """OpenCV's samples and ROS name the same things."""
    matrix = np.asarray(_numbers(content["camera_matrix"])).reshape(3, 3)
    size = (int(content["image_width"]), int(content["image_height"]))
    numbers = [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]]
    coefficients = _numbers(content["distortion_coefficients"])
    return _lens(_model(content.get("distortion_model", "plumb_bob")), size, numbers, coefficients)


def _of_kalibr(content: dict[str, Any]) -> Lens:
    if content["camera_model"] != "pinhole":
        raise ValueError(f"expected camera_model pinhole, got {content['camera_model']!r}")
    width, height = content["resolution"]
    model = _model(content["distortion_model"])
    return _lens(
        model, (int(width), int(height)), _numbers(content["intrinsics"]), _numbers(content["distortion_coeffs"])
    )


def _of_colmap(fields: Sequence[str]) -> Lens:
    name, numbers = fields[1], [finite_number(field) for field in fields[4:]]
    if name not in COLMAP_MODELS:
        raise ValueError(f"expected a camera model of {', '.join(COLMAP_MODELS)}, got {name}")
    model, order = COLMAP_MODELS[name][0], COLMAP_MODELS[name][1].split()
    if len(numbers) != len(order):
        raise ValueError(f"expected {len(order)} parameters of {name} ({' '.join(order)}), got {len(numbers)}")
    values = dict(zip(order, numbers, strict=True))
    focal = [values.get(key, values.get("f", np.nan)) for key in ("fx", "fy")]
    centre = [values[key] - PIXEL_CENTRE for key in ("cx", "cy")]
    coefficients = [values.get(key, 0.0) for key in COEFFICIENTS[model]]
    return _lens(model, (int(fields[2]), int(fields[3])), [*focal, *centre], coefficients)


def _lens(model: str, size: tuple[int, int], affine: Sequence[float], coefficients: Sequence[float]) -> Lens:
    fx, fy, cx, cy = map(float, affine)
    kind: Any = PinholeCamera if model == "pinhole" else FisheyeCamera
    return kind(  # type: ignore[no-any-return]
        width_px=size[0],
        height_px=size[1],
        fx_px=fx,
        fy_px=fy,
        cx_px=cx,
        cy_px=cy,
        distortion=_padded(model, [float(value) for value in coefficients]),
    )


def _padded(model: str, coefficients: list[float]) -> tuple[float, ...]:
    """Zeros for what is not given; OpenCV's terms beyond the eighth have to be zero."""
    counts = (4,) if model == "fisheye" else (5, 8)
    if any(coefficients[counts[-1] :]):
        raise ValueError(f"expected at most {counts[-1]} distortion coefficients that are not 0, got {coefficients}")
    kept = coefficients[: counts[-1]]
    count = next(each for each in counts if each >= len(kept))
    return (*kept, *(0.0,) * (count - len(kept)))


def _model(name: str) -> str:
    if name in FISHEYES:
        return "fisheye"
    if name in PINHOLES:
        return "pinhole"
    raise ValueError(f"expected a distortion_model of {', '.join((*PINHOLES, *FISHEYES))}, got {name!r}")


def _numbers(value: Any) -> list[float]:
    """Numbers of a list, or of a matrix as OpenCV and ROS write it."""
    listed = value["data"] if isinstance(value, dict) else value
    numbers = np.asarray(listed, dtype=np.float64).ravel()
    if not np.isfinite(numbers).all():
        raise ValueError(f"expected finite numbers, got {numbers.tolist()}")
    return [float(number) for number in numbers]


def _xml(path: Path) -> dict[str, Any]:
    try:
        storage = cv2.FileStorage(read_text(path), cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    except (cv2.error, SystemError):
        raise ValueError("expected XML of OpenCV") from None
    sizes = {name: storage.getNode(name).real() for name in ("image_width", "image_height")}
    matrices = {name: storage.getNode(name).mat() for name in ("camera_matrix", "distortion_coefficients")}
    missing = [name for name, value in matrices.items() if value is None]
    if missing or not all(sizes.values()):
        raise ValueError("expected image_width, image_height, camera_matrix and distortion_coefficients")
    return {**sizes, **matrices}
