"""Cameras: pixels to directions and back, in air, in the camera frame (x right, y down, z forward).

The kernels take the camera's numbers as a dictionary of Dr.Jit scalars, so that one compiled kernel serves every
camera of a kind.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike

from optics.kernels.arrays import FloatArray, check_points, opaque, to_columns, to_rows
from optics.kernels.backend import Array3f64, dr
from rigs import Camera as CameraSpec

INVERSE_ITERATIONS = 20
"""Newton steps of the inverse distortion: quadratic convergence needs about six, the rest is for strong lenses."""

INVERSE_TOLERANCE = 1e-12
"""Residual (normalised image units) under which an inverse distortion counts as converged."""

LARGEST_SLOPE = 1e6
"""Normalised image coordinate beyond which a pinhole has no pixels: 0.2 arc seconds from its own image plane."""

REAL_ROOT = 1e-9
"""Relative imaginary part under which a root of a polynomial is a real one; eigenvalue solvers leave about 1e-15."""


@dataclass(frozen=True, kw_only=True)
class Camera(ABC):
    """What both camera models share: the image's size and its affine part, pixels."""

    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float

    def __post_init__(self) -> None:
        for name in ("width_px", "height_px", "fx_px", "fy_px"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise ValueError(f"expected {name} > 0, got {getattr(self, name)}")
        for name in ("cx_px", "cy_px"):
            if not np.isfinite(getattr(self, name)):
                raise ValueError(f"expected a finite {name}, got {getattr(self, name)}")
        if not np.isfinite(self._coefficients()).all():
            raise ValueError(f"expected finite distortion coefficients, got {self._coefficients()}")

    @property
    def kind(self) -> tuple[Any, ...]:
        """What the compiled kernel depends on: the model, and whether there is any distortion to invert."""
        return (type(self), any(self._coefficients()))

    def parameters(self) -> dict[str, Any]:
        """Numbers of the camera for the kernels, as Dr.Jit scalars that are not baked into the code."""
        affine = {name: opaque(getattr(self, name)) for name in ("fx_px", "fy_px", "cx_px", "cy_px")}
        # Kernels multiply by these: a division takes them ten times as long.
        affine |= {"per_fx": opaque(1 / self.fx_px), "per_fy": opaque(1 / self.fy_px)}
        coefficients = [opaque(value) for value in self._coefficients()]
        return {**affine, "coefficients": coefficients, "limit": opaque(self._limit())}

    @abstractmethod
    def _coefficients(self) -> tuple[float, ...]:
        """Distortion coefficients in a fixed order."""

    @abstractmethod
    def _limit(self) -> float:
        """How far from the axis the model describes a lens: its image must grow with the angle all the way there."""

    @staticmethod
    @abstractmethod
    def direction(parameters: dict[str, Any], distorted: bool, u: Any, v: Any) -> tuple[Any, Any]:
        """Kernel: pixels to unit directions, and whether the model could be inverted there."""

    @staticmethod
    @abstractmethod
    def pixel(parameters: dict[str, Any], distorted: bool, direction: Any) -> tuple[Any, Any, Any]:
        """Kernel: directions to pixels (u, v), and whether the model has a pixel for them."""

    def unproject(self, pixels: ArrayLike) -> tuple[FloatArray, np.ndarray[Any, np.dtype[np.bool_]]]:
        """Pixels to unit directions in air.

        Parameters
        ----------
        pixels : array, shape (n, 2)
            (u, v); the centre of the top-left pixel is (0, 0).

        Returns
        -------
        directions : array, shape (n, 3)
            Unit vectors, camera frame.
        valid : array of bool, shape (n,)
            False where the distortion could not be inverted to 1e-12.
        """
        pixels = check_points("pixels", pixels, 2)
        if not len(pixels):
            return np.empty((0, 3)), np.empty(0, dtype=np.bool_)
        kind, distorted = self.kind
        direction, valid = kind.direction(self.parameters(), distorted, *to_columns(pixels))
        return to_rows(direction), np.array(valid)

    def project(self, directions: ArrayLike) -> tuple[FloatArray, np.ndarray[Any, np.dtype[np.bool_]]]:
        """Directions in air (any length) to pixels; the inverse of `unproject`."""
        directions = check_points("directions", directions, 3)
        if not len(directions):
            return np.empty((0, 2)), np.empty(0, dtype=np.bool_)
        kind, distorted = self.kind
        u, v, valid = kind.pixel(self.parameters(), distorted, Array3f64(*to_columns(directions)))
        return to_rows((u, v)), np.array(valid)


@dataclass(frozen=True, kw_only=True)
class PinholeCamera(Camera):
    """Pinhole with OpenCV's distortion (k1, k2, p1, p2, k3[, k4, k5, k6])."""

    distortion: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if len(self.distortion) not in (5, 8):
            raise ValueError(f"expected 5 or 8 distortion coefficients, got {len(self.distortion)}")
        super().__post_init__()

    def _coefficients(self) -> tuple[float, ...]:
        return (*self.distortion, *(0.0,) * (8 - len(self.distortion)))

    def _limit(self) -> float:
        """Squared radius in front of the lens at which the radial polynomial first folds back or has a pole."""
        k1, k2, _, _, k3, k4, k5, k6 = self._coefficients()
        above, below = Polynomial([1, k1, k2, k3]), Polynomial([1, k4, k5, k6])
        twice_r2 = Polynomial([0, 2])
        growth = above * below + twice_r2 * (above.deriv() * below - above * below.deriv())
        return min(_first_positive_root(growth), _first_positive_root(below))

    @staticmethod
    def direction(parameters: dict[str, Any], distorted: bool, u: Any, v: Any) -> tuple[Any, Any]:
        """Kernel: pixels to unit directions; Newton on the distortion polynomial."""
        x_d = (u - parameters["cx_px"]) * parameters["per_fx"]
        y_d = (v - parameters["cy_px"]) * parameters["per_fy"]
        x, y = x_d, y_d
        valid = (dr.abs(x_d) < LARGEST_SLOPE) & (dr.abs(y_d) < LARGEST_SLOPE)
        if distorted:
            coefficients = parameters["coefficients"]
            for _ in range(INVERSE_ITERATIONS):
                fx, fy, (xx, xy, yx, yy) = _brown_conrady(coefficients, x, y)
                determinant = xx * yy - xy * yx
                x, y = (
                    x - (yy * (fx - x_d) - xy * (fy - y_d)) / determinant,
                    y - (xx * (fy - y_d) - yx * (fx - x_d)) / determinant,
                )
            fx, fy, (xx, xy, yx, yy) = _brown_conrady(coefficients, x, y)
            unfolded = _before_the_fold(parameters, x, y, (xx, xy, yx, yy))
            converged = (dr.abs(fx - x_d) < INVERSE_TOLERANCE) & (dr.abs(fy - y_d) < INVERSE_TOLERANCE)
            valid = valid & converged & unfolded
        return dr.normalize(Array3f64(x, y, 1)), valid

    @staticmethod
    def pixel(parameters: dict[str, Any], distorted: bool, direction: Any) -> tuple[Any, Any, Any]:
        """Kernel: directions to pixels; valid in front of the camera."""
        x, y = direction.x / direction.z, direction.y / direction.z
        valid = (direction.z > 0) & (dr.abs(x) < LARGEST_SLOPE) & (dr.abs(y) < LARGEST_SLOPE)
        if distorted:
            x_d, y_d, jacobian = _brown_conrady(parameters["coefficients"], x, y)
            valid = valid & _before_the_fold(parameters, x, y, jacobian)
            x, y = x_d, y_d
        u = dr.fma(x, parameters["fx_px"], parameters["cx_px"])
        return u, dr.fma(y, parameters["fy_px"], parameters["cy_px"]), valid


@dataclass(frozen=True, kw_only=True)
class FisheyeCamera(Camera):
    """Kannala-Brandt fisheye (IEEE TPAMI 28, 1335, 2006), as OpenCV's: r = t + k1 t^3 + k2 t^5 + k3 t^7 + k4 t^9."""

    distortion: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    largest_angle: ClassVar[float] = np.pi
    """Angle from the axis up to which the model is used, radians."""

    def __post_init__(self) -> None:
        if len(self.distortion) != 4:
            raise ValueError(f"expected 4 distortion coefficients, got {len(self.distortion)}")
        super().__post_init__()

    def _coefficients(self) -> tuple[float, ...]:
        return self.distortion

    def _limit(self) -> float:
        """Angle at which the polynomial first folds back, at most `largest_angle`."""
        k1, k2, k3, k4 = self.distortion
        growth_of_squared_angle = Polynomial([1, 3 * k1, 5 * k2, 7 * k3, 9 * k4])
        return min(self.largest_angle, math.sqrt(_first_positive_root(growth_of_squared_angle)))

    @staticmethod
    def direction(parameters: dict[str, Any], distorted: bool, u: Any, v: Any) -> tuple[Any, Any]:
        """Kernel: pixels to unit directions; Newton on the angle polynomial."""
        x = (u - parameters["cx_px"]) * parameters["per_fx"]
        y = (v - parameters["cy_px"]) * parameters["per_fy"]
        radius = dr.sqrt(x * x + y * y)
        angle = radius
        if distorted:
            for _ in range(INVERSE_ITERATIONS):
                value, derivative = _kannala_brandt(parameters["coefficients"], angle)
                angle = angle - (value - radius) / derivative
        value, _ = _kannala_brandt(parameters["coefficients"], angle)
        valid = (dr.abs(value - radius) < INVERSE_TOLERANCE) & (angle < parameters["limit"])
        # sin(t)/r tends to 1 on the axis, where both vanish.
        scale = dr.select(radius > 0, dr.sin(angle) / radius, 1)
        return Array3f64(x * scale, y * scale, dr.cos(angle)), valid & (angle >= 0)

    @staticmethod
    def pixel(parameters: dict[str, Any], distorted: bool, direction: Any) -> tuple[Any, Any, Any]:
        """Kernel: directions to pixels; valid up to where the polynomial stops growing with the angle."""
        sideways = dr.sqrt(dr.square(direction.x) + dr.square(direction.y))
        angle = dr.atan2(sideways, direction.z)
        value, _ = _kannala_brandt(parameters["coefficients"], angle)
        scale = dr.select(sideways > 0, value / sideways, 1 / direction.z)
        u = dr.fma(direction.x * scale, parameters["fx_px"], parameters["cx_px"])
        v = dr.fma(direction.y * scale, parameters["fy_px"], parameters["cy_px"])
        # The arc tangent of a NaN may be a number: the direction itself is asked.
        return u, v, dr.isfinite(sideways + direction.z) & (angle < parameters["limit"])


def camera_from_spec(spec: CameraSpec) -> PinholeCamera | FisheyeCamera:
    """Camera of a rig file's `[camera]` section."""
    numbers: dict[str, Any] = {
        name: getattr(spec, name)
        for name in ("width_px", "height_px", "fx_px", "fy_px", "cx_px", "cy_px", "distortion")
    }
    return PinholeCamera(**numbers) if spec.model == "pinhole" else FisheyeCamera(**numbers)


def _first_positive_root(polynomial: Polynomial) -> float:
    """Smallest positive real root of a polynomial with constant term 1, infinity when there is none.

    The roots' reciprocals are found instead: theirs is the leading coefficient 1, however small the others are.
    """
    reciprocals = np.roots(polynomial.coef)
    real = reciprocals.real[np.abs(reciprocals.imag) <= REAL_ROOT * np.abs(reciprocals)]
    return 1 / float(max(real)) if (real > LARGEST_SLOPE**-2).any() else np.inf


def _before_the_fold(parameters: dict[str, Any], x: Any, y: Any, jacobian: tuple[Any, Any, Any, Any]) -> Any:
    """Whether the distortion still describes the lens at (x, y): beyond its fold the image runs backwards.

    Further out the polynomial may grow again, so that the sign of the Jacobian alone is not enough; it is needed
    for the tangential terms, which the radial limit leaves out.
    """
    xx, xy, yx, yy = jacobian
    return (x * x + y * y < parameters["limit"]) & (xx * yy - xy * yx > 0) & (xx > 0)


def _brown_conrady(coefficients: list[Any], x: Any, y: Any) -> tuple[Any, Any, tuple[Any, Any, Any, Any]]:
    """OpenCV's distortion of normalised coordinates, with its Jacobian (row by row)."""
    k1, k2, p1, p2, k3, k4, k5, k6 = coefficients
    r2 = x * x + y * y
    above = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    below = 1 + r2 * (k4 + r2 * (k5 + r2 * k6))
    radial = above / below
    # Derivative of the radial factor with respect to r^2.
    derivative = (k1 + r2 * (2 * k2 + 3 * r2 * k3) - radial * (k4 + r2 * (2 * k5 + 3 * r2 * k6))) / below
    fx = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    fy = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    xx = radial + 2 * x * x * derivative + 2 * p1 * y + 6 * p2 * x
    xy = 2 * x * y * derivative + 2 * p1 * x + 2 * p2 * y
    yy = radial + 2 * y * y * derivative + 6 * p1 * y + 2 * p2 * x
    return fx, fy, (xx, xy, xy, yy)


def _kannala_brandt(coefficients: list[Any], angle: Any) -> tuple[Any, Any]:
    """Radius in the image for an angle from the axis, and its derivative."""
    k1, k2, k3, k4 = coefficients
    t2 = angle * angle
    value = angle * (1 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))))
    derivative = 1 + t2 * (3 * k1 + t2 * (5 * k2 + t2 * (7 * k3 + t2 * 9 * k4)))
    return value, derivative
