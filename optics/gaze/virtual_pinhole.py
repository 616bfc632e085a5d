"""The virtual camera as OpenCV and ROS know cameras: the pinhole closest to port and mirrors, and how close it is.

Behind a flat or decentred port there is no single centre of projection, so that no pinhole fits all distances. The fit
belongs to the pixels of the gaze region at one pose and to the distances it was made at; its residual says what else
it is good for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import RigidTransform, Rotation

from optics.camera import PinholeCamera
from optics.gaze.kinematics import virtual_camera
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.train import OpticalTrain, pixel_grid
from rigs import Rig

DISTANCES_M = (0.5, 1.0, 2.0, 5.0, 10.0)
"""Behind the gaze mirror, along the ray: what a tracker under water looks at."""

COLUMNS, ROWS = 64, 48
"""Cells of the image whose centres are fitted, as far as they see through both mirrors."""

FEWEST_PIXELS = 50
"""Fifteen unknowns need more pixels than that to mean anything."""

PARAMETERS = 15
"""fx, fy, cx, cy; k1, k2, p1, p2, k3; turn and shift of the pose."""


@dataclass(frozen=True, kw_only=True)
class Residual:
    """Distance in the image between the exact projection and the pinhole's, for points at one distance.

    Attributes
    ----------
    distance_m : float
        Behind the gaze mirror, along the ray.
    rms_px, largest_px : float
    worst_px : (u, v)
        Where it is largest.
    """

    distance_m: float
    rms_px: float
    largest_px: float
    worst_px: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class VirtualPinhole:
    """A pinhole with distortion in place of camera, port and mirrors, at one pose.

    Attributes
    ----------
    camera : PinholeCamera
        Whose pixels are those of the real camera.
    body_from_virtual : RigidTransform
        Its pose.
    q1, q2 : float
        The pose of the mirrors it belongs to, radians.
    fitted_at_m : tuple of float
        Distances of the points fitted, behind the gaze mirror.
    region_px : (u_min, v_min, u_max, v_max)
        What the fitted pixels lie in. Beyond it the distortion is an extrapolation.
    pixel_count : int
        How many were fitted.
    residuals : tuple of Residual
        One for each of `fitted_at_m`.
    """

    camera: PinholeCamera
    body_from_virtual: RigidTransform
    q1: float
    q2: float
    fitted_at_m: tuple[float, ...]
    region_px: tuple[float, float, float, float]
    pixel_count: int
    residuals: tuple[Residual, ...]

    @property
    def camera_matrix(self) -> FloatArray:
        """OpenCV's, shape (3, 3)."""
        camera = self.camera
        return np.array([[camera.fx_px, 0, camera.cx_px], [0, camera.fy_px, camera.cy_px], [0, 0, 1.0]])


def fit_virtual_pinhole(
    rig: Rig, *, q1: float = 0.0, q2: float = 0.0, distances_m: Sequence[float] = DISTANCES_M
) -> VirtualPinhole:
    """Best pinhole with OpenCV's five distortion coefficients and a pose of its own, in least squares of pixels.

    Parameters
    ----------
    rig : Rig
        With mirrors.
    q1, q2 : float
        Joint values, radians, within the limits.
    distances_m : sequence of float
        Where the points fitted lie behind the gaze mirror.

    Raises
    ------
    ValueError
        When the gaze mirror shows hardly anything at that pose, the joint values are beyond their limits or not
        numbers, or a distance is not positive.
    """
    distances = check_distances(distances_m)
    layout = Layout.from_rig(rig)
    layout.check_joints(q1, q2)
    body_from_nominal = virtual_camera(layout, q1, q2)
    pixels, points = _seen_points(rig, q1, q2, distances)
    nominal_points = body_from_nominal.inv().apply(points.reshape(-1, 3))
    observed = np.tile(pixels, (len(distances), 1))
    train = OpticalTrain.from_rig(rig, q1=q1, q2=q2)

    def misfit(parameters: FloatArray) -> FloatArray:
        return (_project(parameters, nominal_points) - observed).ravel()

    start = _start(train, pixels, nominal_points[-len(pixels) :])
    found = least_squares(misfit, start, x_scale="jac", method="lm", xtol=1e-12, ftol=1e-12, gtol=1e-12)
    fx, fy, cx, cy = found.x[:4]
    camera = PinholeCamera(
        width_px=train.camera.width_px,
        height_px=train.camera.height_px,
        fx_px=float(fx),
        fy_px=float(fy),
        cx_px=float(cx),
        cy_px=float(cy),
        distortion=tuple(float(value) for value in found.x[4:9]),
    )
    virtual = VirtualPinhole(
        camera=camera,
        body_from_virtual=body_from_nominal * _nominal_from_virtual(found.x),
        q1=q1,
        q2=q2,
        fitted_at_m=tuple(distances),
        region_px=(*(float(c) for c in pixels.min(axis=0)), *(float(c) for c in pixels.max(axis=0))),  # type: ignore[arg-type]
        pixel_count=len(pixels),
        residuals=(),
    )
    return replace(virtual, residuals=residuals_at(rig, virtual, distances))


def residuals_at(rig: Rig, virtual: VirtualPinhole, distances_m: Sequence[float]) -> tuple[Residual, ...]:
    """How far a fitted pinhole is off at any distances, over the pixels of the gaze region at its pose."""
    distances = check_distances(distances_m)
    pixels, points = _seen_points(rig, virtual.q1, virtual.q2, distances)
    rows = []
    for distance, layer in zip(distances, points, strict=True):
        seen, _ = virtual.camera.project(virtual.body_from_virtual.inv().apply(layer))
        off = np.linalg.norm(seen - pixels, axis=1)
        worst = pixels[int(off.argmax())]
        rows.append(
            Residual(
                distance_m=float(distance),
                rms_px=float(np.sqrt((off**2).mean())),
                largest_px=float(off.max()),
                worst_px=(float(worst[0]), float(worst[1])),
            )
        )
    return tuple(rows)


def check_distances(distances_m: Sequence[float]) -> list[float]:
    """Positive finite distances, at least one, or a `ValueError`."""
    distances = [float(distance) for distance in distances_m]
    if not distances or not all(0 < distance < np.inf for distance in distances):
        raise ValueError(f"expected distances_m > 0, at least one, got {distances}")
    return distances


def _seen_points(rig: Rig, q1: float, q2: float, distances: Sequence[float]) -> tuple[FloatArray, FloatArray]:
    """Pixels of the gaze region, shape (n, 2), and what they show, body frame, shape (distances, n, 3)."""
    train = OpticalTrain.from_rig(rig, q1=q1, q2=q2)
    pixels = pixel_grid(train.camera, COLUMNS, ROWS)
    rays = train.trace(pixels)
    seen = rays.passed
    if seen.sum() < FEWEST_PIXELS:
        raise ValueError(
            f"expected a pose at which the gaze mirror is in view, got q1 = {np.degrees(q1):g} deg, "
            f"q2 = {np.degrees(q2):g} deg, where it fills {seen.sum()} of {len(seen)} cells of the image"
        )
    reach = np.array(distances)[:, np.newaxis, np.newaxis]
    points = rays.origin_m[seen] + reach * rays.direction[seen]
    to_body = Layout.from_rig(rig).body_from_camera
    return pixels[seen], to_body.apply(points.reshape(-1, 3)).reshape(points.shape)


def _start(train: OpticalTrain, pixels: FloatArray, points: FloatArray) -> FloatArray:
    """Straight lines through pixels against slopes of the farthest points, at the nominal pose, without distortion."""
    slopes = points[:, :2] / points[:, 2:]
    (fx, cx), (fy, cy) = (np.polyfit(slopes[:, axis], pixels[:, axis], 1) for axis in range(2))
    start = np.zeros(PARAMETERS)
    start[:4] = fx, fy, cx, cy
    return start


def _nominal_from_virtual(parameters: FloatArray) -> RigidTransform:
    return RigidTransform.from_components(parameters[12:], Rotation.from_rotvec(parameters[9:12]))


def _project(parameters: FloatArray, nominal_points: FloatArray) -> FloatArray:
    """OpenCV's pinhole in plain NumPy: a fit asks for it some hundred times."""
    x, y, z = _nominal_from_virtual(parameters).inv().apply(nominal_points).T
    fx, fy, cx, cy, k1, k2, p1, p2, k3 = parameters[:9]
    x, y = x / z, y / z
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    v = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return np.stack([fx * u + cx, fy * v + cy], axis=1)
