"""The pinhole (or fisheye) that comes closest to a camera behind a port, how close, and how to undistort exactly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import RigidTransform, Rotation

from optics.kernels.arrays import FloatArray
from optics.perturbation.parameters import CAMERA, DISTORTION, POINT
from optics.perturbation.port_camera import Lens, PortCamera
from optics.ports.port import NoPort
from optics.train import pixel_grid

COLUMNS, ROWS = 24, 18
"""Cells of the image whose centres are fitted."""

PORTIONS = (0.5, 1.0, 2.0, 4.0)
"""Distances that are fitted, in parts of where the boards were."""

TERMS = {"pinhole": DISTORTION["pinhole"][:5], "fisheye": DISTORTION["fisheye"]}
FOUR_TERMS = {"pinhole": DISTORTION["pinhole"][:4], "fisheye": DISTORTION["fisheye"]}
"""Distortion coefficients of the fit; Kalibr's radtan has four."""

NOWHERE = -1.0
"""In the tables of `remap`: a place outside every image."""


Table = NDArray[np.float32]


@dataclass(frozen=True, kw_only=True)
class PinholeFit:
    """A camera without a port in place of one with it.

    Attributes
    ----------
    lens : PinholeCamera or FisheyeCamera
    pinhole_from_camera : RigidTransform
        From the real camera's frame to that of the fitted one, whose pinhole is elsewhere.
    distances_m : tuple of float
        Behind the port, along the rays.
    rms_px, largest_px : tuple of float
        Residual at each of them.
    """

    lens: Lens
    pinhole_from_camera: RigidTransform
    distances_m: tuple[float, ...]
    rms_px: tuple[float, ...]
    largest_px: tuple[float, ...]


def fit_pinhole(camera: PortCamera, distances_m: Sequence[float], terms: Sequence[str]) -> PinholeFit:
    """Fit a camera without a port, in least squares of pixels over the whole image.

    Parameters
    ----------
    camera : PortCamera
    distances_m : sequence of float
    terms : sequence of str
        Distortion coefficients that are fitted, of the same model as the camera's.
    """
    pixels = pixel_grid(camera.camera, COLUMNS, ROWS)
    origins, directions = camera.rays(pixels)
    seen = np.isfinite(directions).all(axis=1)
    points = np.concatenate([origins[seen] + far * directions[seen] for far in distances_m])
    observed = np.tile(pixels[seen], (len(distances_m), 1))
    names, start = (*CAMERA, *terms), _start(camera, len(terms))

    def off(unknowns: FloatArray) -> FloatArray:
        fitted, pose = _at(camera, names, unknowns)
        return np.asarray(np.nan_to_num(fitted.project(pose.apply(points)) - observed, nan=1e3).ravel())

    def jacobian(unknowns: FloatArray) -> FloatArray:
        fitted, pose = _at(camera, names, unknowns)
        inside = pose.apply(points)
        found = fitted.jacobian(inside, (*POINT, *names))
        by_point = found.values[..., :3]
        by_turn = by_point @ _skew(inside - pose.translation) @ _left_jacobian(unknowns[-3:])
        return np.asarray(np.nan_to_num(np.concatenate([found.values[..., 3:], by_point, by_turn], axis=2))).reshape(
            -1, len(unknowns)
        )

    found: Any = least_squares(off, start, jac=jacobian, x_scale="jac", method="lm", xtol=1e-10, ftol=1e-10)
    fitted, pose = _at(camera, names, found.x)
    lengths = np.linalg.norm(off(found.x).reshape(len(distances_m), -1, 2), axis=2)
    return PinholeFit(
        lens=fitted.camera,
        pinhole_from_camera=pose,
        distances_m=tuple(map(float, distances_m)),
        rms_px=tuple(np.sqrt((lengths**2).mean(axis=1)).tolist()),
        largest_px=tuple(lengths.max(axis=1).tolist()),
    )


def undistortion_maps(camera: PortCamera, fit: PinholeFit, distance_m: float) -> tuple[Table, Table]:
    """Tables of u and v for `cv2.remap`, shape (height, width), float32: exact for points at one distance.

    The image that they give is that of a pinhole without distortion, with the fit's focal lengths and principal point,
    at the fit's place; outside the image they are `NOWHERE`.
    """
    none: Any = (0.0,) * len(fit.lens.distortion)
    lens = replace(fit.lens, distortion=none)
    ideal = PortCamera(camera=lens, port=NoPort())
    pixels = pixel_grid(lens)
    _, directions = ideal.rays(pixels)
    points = fit.pinhole_from_camera.inv().apply(distance_m * np.nan_to_num(directions))
    found = np.nan_to_num(camera.project(points), nan=NOWHERE).astype(np.float32)
    shape = (lens.height_px, lens.width_px)
    return found[:, 0].reshape(shape), found[:, 1].reshape(shape)


def _start(camera: PortCamera, terms: int) -> FloatArray:
    """Focal lengths on the axis, no distortion, and no shift."""
    lens = camera.camera
    centre = np.array([lens.cx_px, lens.cy_px])
    _, rays = camera.rays(np.add(centre, ((-1, 0), (1, 0), (0, -1), (0, 1))))
    slopes = rays[:, :2] / rays[:, 2:]
    fx, fy = 2 / (slopes[1, 0] - slopes[0, 0]), 2 / (slopes[3, 1] - slopes[2, 1])
    return np.array([fx, fy, *centre, *(0.0,) * terms, *(0.0,) * 6])


def _at(camera: PortCamera, names: tuple[str, ...], unknowns: FloatArray) -> tuple[PortCamera, RigidTransform]:
    none: Any = (0.0,) * (5 if camera.model == "pinhole" else 4)
    plain = replace(camera.camera, distortion=none)
    bare = PortCamera(camera=plain, port=NoPort())
    values = bare.values()
    steps = {name: float(value) - values[name] for name, value in zip(names, unknowns, strict=False)}
    turn = Rotation.from_rotvec(unknowns[-3:])
    return bare.moved(steps), RigidTransform.from_components(unknowns[-6:-3], turn)


def _skew(arms: FloatArray) -> FloatArray:
    """Derivatives of points, shape (n, 3, 3), by a small turn of what they are `arms` from."""
    x, y, z = arms.T
    zero = np.zeros_like(x)
    rows = [[zero, z, -y], [-z, zero, x], [y, -x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=1)


def _left_jacobian(vector: FloatArray) -> FloatArray:
    """Small turn in the outer frame by a change of a rotation vector, for the small turns of a fit: to first order."""
    x, y, z = vector / 2
    return np.array([[1, -z, y], [z, 1, -x], [-y, x, 1]])
