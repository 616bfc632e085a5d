"""A camera behind a port, without mirrors: pixels of points, rays of pixels, and how pixels move with every parameter.

Parameters are those of `optics.perturbation.parameters`, here with their own values: metres, radians, pixels.
`port_tilt_x` and `port_tilt_y` turn a flat port's normal from the optical axis.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from optics.camera import FisheyeCamera, PinholeCamera
from optics.kernels.arrays import FloatArray, unit
from optics.perturbation.derivatives import Jacobian, jacobian_of_pixels, pixel_gradients
from optics.perturbation.kernels import Kind, compiled
from optics.perturbation.parameters import CAMERA, DISTORTION, POINT, PORT, PORT_CENTRE
from optics.perturbation.train import lanes_of, named
from optics.ports.port import DomePort, FlatPort, NoPort
from optics.train import OpticalTrain

AXIS = (0.0, 0.0, 1.0)
TILTS = ("port_tilt_x", "port_tilt_y")

SMALLEST_SHARE = 0.25
"""A length or an index that a step would take below this share of itself stops there: none becomes negative."""

LARGEST_OFFSET = 0.95
"""Of a dome's inner radius: no step takes the pinhole further from the centre."""

Lens = PinholeCamera | FisheyeCamera
Window = FlatPort | DomePort | NoPort


@dataclass(frozen=True, kw_only=True)
class PortCamera:
    """Camera and port in the camera frame; the port's rim is not asked for."""

    camera: Lens
    port: Window

    @property
    def model(self) -> str:
        """The camera's model as a rig file names it."""
        return "pinhole" if isinstance(self.camera, PinholeCamera) else "fisheye"

    @property
    def shape(self) -> str:
        """The port's shape as a rig file names it."""
        return {FlatPort: "flat", DomePort: "dome", NoPort: "none"}[type(self.port)]

    @property
    def train(self) -> OpticalTrain:
        """The same as an optical train."""
        return OpticalTrain(camera=self.camera, port=self.port.without_rim())

    def bare(self) -> PortCamera:
        """The camera taken out of its housing."""
        return replace(self, port=NoPort())

    def in_air(self) -> PortCamera:
        """The camera in its housing, out of the water."""
        return self if isinstance(self.port, NoPort) else replace(self, port=replace(self.port, n_water=1.0))

    def values(self) -> dict[str, float]:
        """Value of every parameter by name."""
        camera, port = self.camera, self.port
        values = {name: float(getattr(camera, f"{name}_px")) for name in CAMERA}
        values |= dict(zip(DISTORTION[self.model], _padded(self), strict=True))
        if isinstance(port, NoPort):
            return values
        values |= {"port_thickness": port.thickness_m, "n_port": port.n_port, "n_water": port.n_water}
        if isinstance(port, FlatPort):
            return values | {"port_distance": port.distance_m} | dict(zip(TILTS, _tilts(port), strict=True))
        centre = np.asarray(port.centre_m, dtype=np.float64).tolist()
        return values | {"port_radius": port.radius_m} | dict(zip(PORT_CENTRE, centre, strict=True))

    def moved(self, steps: Mapping[str, float]) -> PortCamera:
        """The same with steps added to some parameters; what has to be positive stays so (`SMALLEST_SHARE`)."""
        values = self.values()
        for name, step in steps.items():
            lowest = SMALLEST_SHARE * values[name] if name in _POSITIVE else -math.inf
            values[name] = max(values[name] + step, lowest)
        return replace(self, camera=_camera_with(self, values), port=_port_with(self.port, values))

    def project(self, points_m: ArrayLike) -> FloatArray:
        """Pixels, shape (n, 2), of points of the camera frame, shape (n, 3); NaN where there is none."""
        return self.train.project(points_m).pixels

    def rays(self, pixels: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Points on the port's outer face and unit directions behind it, shape (n, 3); NaN where there is no ray."""
        rays = self.train.trace(pixels)
        lost = ~rays.passed
        return np.where(lost[:, np.newaxis], np.nan, rays.origin_m), np.where(
            lost[:, np.newaxis], np.nan, rays.direction
        )

    def jacobian(self, points_m: ArrayLike, names: Sequence[str]) -> Jacobian:
        """Pixels of points of the camera frame, shape (n, 3), and their derivatives by parameters.

        `names` may hold `optics.perturbation.parameters.POINT` besides what `values` has.
        """
        port, tilts = self.port, {}
        if isinstance(port, FlatPort):
            # The normal counts from the axis: so its turns are differentiated where they are.
            tilts, port = dict(zip(TILTS, _tilts(port), strict=True)), replace(port, normal=AXIS)
        kind = Kind(model=self.model, camera=type(self.camera), distorted=True, port=type(port))
        nominal = {name: 0.0 for name in names if name not in POINT}
        lanes, shape = lanes_of({**nominal, **tilts, **named(POINT, points_m)})
        numbers = {"camera": self.camera.parameters(), "port": port.without_rim().parameters()}
        chosen = tuple(names)
        pixels, gradients = compiled(pixel_gradients, kind, tuple(lanes), chosen)(numbers, lanes)
        return jacobian_of_pixels(pixels, gradients, shape, chosen)


_POSITIVE = ("fx", "fy", "port_distance", "port_thickness", "port_radius", "n_port", "n_water")


def parameters_of(model: str, shape: str) -> tuple[str, ...]:
    """Parameters of a camera behind a port, in the order in which they are shown."""
    return (*CAMERA, *DISTORTION[model], *PORT[shape])


def _padded(of: PortCamera) -> tuple[float, ...]:
    given = tuple(of.camera.distortion)
    return (*given, *(0.0,) * (len(DISTORTION[of.model]) - len(given)))


def _tilts(port: FlatPort) -> tuple[float, float]:
    """Turns about x and then about the turned y that take the axis to the normal."""
    x, y, z = unit("normal", port.normal)
    return math.atan2(-y, z), math.asin(min(max(x, -1.0), 1.0))


def _camera_with(of: PortCamera, values: Mapping[str, float]) -> Lens:
    affine: dict[str, Any] = {f"{name}_px": values[name] for name in CAMERA}
    coefficients: Any = tuple(values[name] for name in DISTORTION[of.model])
    short = isinstance(of.camera, PinholeCamera) and not any(coefficients[5:])
    return replace(of.camera, distortion=coefficients[:5] if short else coefficients, **affine)


def _port_with(port: Window, values: Mapping[str, float]) -> Window:
    if isinstance(port, NoPort):
        return port
    shared: dict[str, Any] = {name: values[name] for name in ("n_port", "n_water")}
    shared["thickness_m"] = values["port_thickness"]
    if isinstance(port, FlatPort):
        about_x, about_y = (values[name] for name in TILTS)
        normal = (
            math.sin(about_y),
            -math.sin(about_x) * math.cos(about_y),
            math.cos(about_x) * math.cos(about_y),
        )
        return replace(port, distance_m=values["port_distance"], normal=normal, **shared)
    centre = np.array([values[name] for name in PORT_CENTRE])
    farthest = LARGEST_OFFSET * values["port_radius"]
    centre = centre * min(1.0, farthest / max(float(np.linalg.norm(centre)), np.finfo(np.float64).tiny))
    return replace(port, centre_m=tuple(centre.tolist()), radius_m=values["port_radius"], **shared)
