"""Files of a calibration for OpenCV, ROS, Kalibr, COLMAP-Underwater and Foxglove.

Only COLMAP-Underwater knows ports. The others get the pinhole (or fisheye) that comes closest, with its residual; the
tables for `cv2.remap` undo lens and port exactly at one distance.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from optics.gaze.camera_files import matrix_lines
from optics.kernels.arrays import FloatArray
from optics.perturbation.port_camera import Lens, PortCamera
from optics.ports.port import DomePort, FlatPort
from rigs.atomic_files import atomic_files
from tracking.port_calibration.camera_input import PIXEL_CENTRE
from tracking.port_calibration.corner_files import write_corners
from tracking.port_calibration.estimate import PortCalibration
from tracking.port_calibration.pinhole_fit import (
    FOUR_TERMS,
    PORTIONS,
    TERMS,
    PinholeFit,
    fit_pinhole,
    undistortion_maps,
)
from tracking.port_calibration.summary import as_dict

CALIBRATION_FILE = "calibration.json"
CORNERS_FILE = "corners.csv"
KALIBR_FILE = "kalibr_camchain.yaml"
COLMAP_FILE = "colmap_underwater.txt"
OF_ROS = {"pinhole": "plumb_bob", "fisheye": "equidistant"}
OF_KALIBR = {"pinhole": "radtan", "fisheye": "equidistant"}
OF_FOXGLOVE = {"pinhole": "plumb_bob", "fisheye": "kannala_brandt"}


def write_port_files(found: PortCalibration, folder: Path) -> list[Path]:
    """Write all files into a folder, made when it is missing; nothing is left half-written."""
    far = board_distance_m(found)
    distances = [far * part for part in PORTIONS]
    fits = {name: fit_pinhole(camera, distances, TERMS[camera.model]) for name, camera in found.cameras.items()}
    texts = {
        CALIBRATION_FILE: _calibration_text(found, fits),
        KALIBR_FILE: kalibr_yaml(found, distances),
        COLMAP_FILE: colmap_text(found.cameras),
    }
    for name, fit in fits.items():
        model = found.cameras[name].model
        texts[f"{name}_opencv.yaml"] = opencv_yaml(fit, model)
        texts[f"{name}_ros.yaml"] = ros_yaml(name, fit, model)
        texts[f"{name}_foxglove.json"] = foxglove_json(name, fit, model)
    maps = [f"{name}_remap.npz" for name in fits]
    with atomic_files(folder) as scratch:
        write_corners(scratch / CORNERS_FILE, found.observations)
        for file, text in texts.items():
            (scratch / file).write_text(text, encoding="utf-8")
        for file, (name, fit) in zip(maps, fits.items(), strict=True):
            map_u, map_v = undistortion_maps(found.cameras[name], fit, far)
            matrix = camera_matrix(fit.lens)
            np.savez(scratch / file, map_u=map_u, map_v=map_v, camera_matrix=matrix, distance_m=far)
    return [folder / file for file in (CORNERS_FILE, *texts, *maps)]


def board_distance_m(found: PortCalibration) -> float:
    """Median distance of the boards from the first camera."""
    return float(np.median(np.linalg.norm(found.arrangement.rig_from_board.translation, axis=1)))


def camera_matrix(lens: Lens) -> FloatArray:
    """OpenCV's, shape (3, 3)."""
    return np.array([[lens.fx_px, 0, lens.cx_px], [0, lens.fy_px, lens.cy_px], [0, 0, 1.0]])


def opencv_yaml(fit: PinholeFit, model: str) -> str:
    """OpenCV's FileStorage text: the fit, its place in the real camera's frame, and its residual by distance."""
    return "\n".join(
        [
            "%YAML:1.0",
            "---",
            f"image_width: {fit.lens.width_px}",
            f"image_height: {fit.lens.height_px}",
            f"distortion_model: {OF_ROS[model]}",
            *matrix_lines("camera_matrix", camera_matrix(fit.lens)),
            *matrix_lines("distortion_coefficients", np.array([fit.lens.distortion])),
            *matrix_lines("pinhole_from_camera", fit.pinhole_from_camera.as_matrix()),
            *matrix_lines("fitted_at_m", np.array([fit.distances_m])),
            *matrix_lines("rms_px", np.array([fit.rms_px])),
            *matrix_lines("largest_px", np.array([fit.largest_px])),
            "",
        ]
    )


def ros_yaml(name: str, fit: PinholeFit, model: str) -> str:
    """ROS's camera_info as `camera_calibration_parsers` reads it."""
    matrix = camera_matrix(fit.lens)
    return "\n".join(
        [
            f"# Closest camera without a port; rms {_listed(fit.rms_px)} px at {_listed(fit.distances_m)} m.",
            f"image_width: {fit.lens.width_px}",
            f"image_height: {fit.lens.height_px}",
            f"camera_name: {name}",
            *matrix_lines("camera_matrix", matrix, ros=True),
            f"distortion_model: {OF_ROS[model]}",
            *matrix_lines("distortion_coefficients", np.array([fit.lens.distortion]), ros=True),
            *matrix_lines("rectification_matrix", np.eye(3), ros=True),
            *matrix_lines("projection_matrix", np.hstack([matrix, np.zeros((3, 1))]), ros=True),
            "",
        ]
    )


def foxglove_json(name: str, fit: PinholeFit, model: str) -> str:
    """Foxglove's CameraCalibration message."""
    matrix = camera_matrix(fit.lens)
    message = {
        "timestamp": {"sec": 0, "nsec": 0},
        "frame_id": name,
        "width": fit.lens.width_px,
        "height": fit.lens.height_px,
        "distortion_model": OF_FOXGLOVE[model],
        "D": list(fit.lens.distortion),
        "K": matrix.ravel().tolist(),
        "R": np.eye(3).ravel().tolist(),
        "P": np.hstack([matrix, np.zeros((3, 1))]).ravel().tolist(),
    }
    return json.dumps(message, indent=2) + "\n"


def kalibr_yaml(found: PortCalibration, distances_m: Iterable[float]) -> str:
    """Kalibr's camchain: closest cameras with Kalibr's four coefficients, and the transforms between them."""
    lines, before = [], None
    for index, (camera, pose) in enumerate(
        zip(found.arrangement.cameras, found.arrangement.camera_from_rig, strict=True)
    ):
        fit = fit_pinhole(camera, list(distances_m), FOUR_TERMS[camera.model])
        lens, from_rig = fit.lens, fit.pinhole_from_camera * pose
        lines += [
            f"cam{index}:",
            f"  # closest camera without a port; rms {_listed(fit.rms_px)} px at {_listed(fit.distances_m)} m",
            "  camera_model: pinhole",
            f"  intrinsics: {[lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px]}",
            f"  distortion_model: {OF_KALIBR[camera.model]}",
            f"  distortion_coeffs: {list(lens.distortion[:4])}",
            f"  resolution: {[lens.width_px, lens.height_px]}",
            f"  rostopic: /{found.observations.cameras[index]}/image_raw",
        ]
        if before is not None:
            rows = (from_rig * before.inv()).as_matrix().tolist()
            lines += ["  T_cn_cnm1:", *(f"  - {row}" for row in rows)]
        before = from_rig
    return "\n".join([*lines, ""])


def colmap_text(cameras: Mapping[str, PortCamera]) -> str:
    """Options of COLMAP-Underwater's feature_extractor for each camera, exact; lengths in metres.

    Its ports: FLATPORT is the normal, the distance, the thickness and the indices of air, window and water; DOMEPORT
    the centre, the inner radius, the thickness and the same indices.
    """
    return "\n".join(line for name, camera in cameras.items() for line in _colmap_lines(name, camera))


def _colmap_lines(name: str, camera: PortCamera) -> Iterable[str]:
    lens, port = camera.camera, camera.port
    coefficients = [*lens.distortion, *(0.0,) * (8 - len(lens.distortion))]
    full = any(coefficients[4:])
    model = "OPENCV_FISHEYE" if camera.model == "fisheye" else "FULL_OPENCV" if full else "OPENCV"
    centre = [lens.cx_px + PIXEL_CENTRE, lens.cy_px + PIXEL_CENTRE]
    terms = coefficients if model == "FULL_OPENCV" else coefficients[:4]
    yield f"# {name}"
    yield f"--ImageReader.camera_model {model}"
    yield f'--ImageReader.camera_params "{_joined([lens.fx_px, lens.fy_px, *centre, *terms])}"'
    if isinstance(port, FlatPort | DomePort):
        flat = isinstance(port, FlatPort)
        place = [*np.asarray(port.normal if isinstance(port, FlatPort) else port.centre_m, dtype=float)]
        length = port.distance_m if isinstance(port, FlatPort) else port.radius_m
        numbers = [*place, length, port.thickness_m, port.n_inside, port.n_port, port.n_water]
        yield f"--ImageReader.camera_refrac_model {'FLATPORT' if flat else 'DOMEPORT'}"
        yield f'--ImageReader.camera_refrac_params "{_joined(numbers)}"'
    yield ""


def _calibration_text(found: PortCalibration, fits: Mapping[str, PinholeFit]) -> str:
    content: dict[str, Any] = as_dict(found)
    content["pinhole_fits"] = {
        name: {
            "distances_m": list(fit.distances_m),
            "rms_px": list(fit.rms_px),
            "largest_px": list(fit.largest_px),
            "pinhole_from_camera": fit.pinhole_from_camera.as_matrix().tolist(),
        }
        for name, fit in fits.items()
    }
    return json.dumps(content, indent=2) + "\n"


def _listed(numbers: Iterable[float]) -> str:
    return ", ".join(f"{number:.3g}" for number in numbers)


def _joined(numbers: Iterable[float]) -> str:
    return ",".join(repr(float(number)) for number in numbers)
