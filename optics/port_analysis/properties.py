"""What a port does to a camera: focal length, field of view, where things appear, and colour.

Formulas and sources are in `docs/explanation/ports.md`; lengths are metres, angles radians, distances from the pinhole.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from optics.camera import Camera, PinholeCamera, camera_from_spec
from optics.kernels.arrays import FloatArray, unit
from optics.port_analysis.colour import lateral_colour
from optics.port_analysis.focus import Focus, apparent_distance, focus_behind
from optics.ports.port import DomePort, FlatPort, NoPort, Port, port_from_spec
from optics.status import Status
from optics.train import OpticalTrain, pixel_grid
from rigs import Rig

TRACED_SLOPE = 1e-4
"""Half the step of the central difference along traced rays: its own error is 1e-8, rounding's 1e-12."""

COAXIAL = 1e-9
"""Sine of the angle of two axes that count as one: what it changes grows with its square."""

EDGE_SAMPLES = 2000
"""Pixels between the principal point and an edge at which a port's rim is looked for."""

COLOUR_GRID = (33, 25)
"""Columns and rows of the pixels at which lateral colour is looked at."""


@dataclass(frozen=True, kw_only=True)
class FieldOfView:
    """Angles between the rays at opposite edges of the image, through the principal point; radians."""

    horizontal: float
    vertical: float
    diagonal: float


@dataclass(frozen=True, kw_only=True)
class PortProperties:
    """The port of a rig in its water, at the wavelength of the geometry unless a field says otherwise.

    Attributes
    ----------
    n_water : float
    magnification, traced_magnification : (2,)
        `axial_magnification` and `traced_magnification`.
    object_distance_m, appears_at_m, infinity_appears_at_m : float
        An object in the water and where it appears; where what is far away appears.
    focus : Focus or None
        None when the nearest focus of the lens is not known.
    field_in_air, field_in_water : FieldOfView
    lateral_colour_px : float
        The largest distance in the image between the red (656 nm) and the blue (486 nm) image of one point.
    """

    n_water: float
    magnification: tuple[float, float]
    traced_magnification: tuple[float, float]
    object_distance_m: float
    appears_at_m: float
    infinity_appears_at_m: float
    focus: Focus | None
    field_in_air: FieldOfView
    field_in_water: FieldOfView
    lateral_colour_px: float


def port_properties(rig: Rig, *, object_distance_m: float, nearest_focus_m: float | None = None) -> PortProperties:
    """All properties of the port of a rig, in its water; the mirrors, which refract nothing, are left out."""
    camera, port = camera_from_spec(rig.camera), port_from_spec(rig.port, rig.water)
    dry = port if isinstance(port, NoPort) else replace(port, n_water=port.n_inside)  # type: ignore[type-var]
    shift = lateral_colour(rig, _pixels_up_to_the_corners(camera), object_distance_m=object_distance_m)
    return PortProperties(
        n_water=port.n_water,
        magnification=axial_magnification(port),
        traced_magnification=traced_magnification(port),
        object_distance_m=object_distance_m,
        appears_at_m=apparent_distance(port, object_distance_m),
        infinity_appears_at_m=apparent_distance(port, float("inf")),
        focus=None if nearest_focus_m is None else focus_behind(port, nearest_focus_m),
        field_in_air=field_of_view(camera, dry),
        field_in_water=field_of_view(camera, port),
        lateral_colour_px=float(np.nanmax(np.linalg.norm(shift[-1] - shift[0], axis=-1))),
    )


def _pixels_up_to_the_corners(camera: Camera) -> FloatArray:
    right, bottom = camera.width_px - 1, camera.height_px - 1
    corners = [[0, 0], [right, 0], [0, bottom], [right, bottom]]
    return np.vstack([pixel_grid(camera, *COLOUR_GRID), corners, [[camera.cx_px, camera.cy_px]]])


def axial_magnification(port: Port) -> tuple[float, float]:
    """f_water / f_air on the optical axis for distant objects, in closed form.

    Returns
    -------
    smallest, largest : float
        Along and across the plane of refraction; the same for an untilted flat port (n_water / n_inside) and for a
        dome whose centre is on the axis (1 when it is in the pinhole).

    Notes
    -----
    With the angle a of the optical axis to the port's axis in air and w in the water, the image is enlarged by
    ``da / dw`` in the plane of refraction and by ``sin a / sin w`` across it.
    """
    if isinstance(port, DomePort):
        return _dome_magnification(port)
    if isinstance(port, FlatPort):
        cosine = float(unit("normal", port.normal)[2])
        ratio = port.n_water / port.n_inside
        sine = np.sqrt(1 - cosine**2)
        if sine >= ratio:
            raise ValueError(f"expected an optical axis that gets through the port, got normal {port.normal}")
        along = ratio * np.sqrt(1 - (sine / ratio) ** 2) / cosine
        return _ascending(along, ratio)
    return 1.0, 1.0


def _dome_magnification(port: DomePort) -> tuple[float, float]:
    centre = np.asarray(port.centre_m, dtype=np.float64)
    offset = float(np.linalg.norm(centre))
    if offset == 0:
        return 1.0, 1.0
    sideways = float(np.hypot(centre[0], centre[1]))
    sine, cosine = sideways / offset, -float(centre[2]) / offset
    outer = port.radius_m + port.thickness_m
    # The optical invariant n r sin(angle to the radius) is smaller than each of these where the ray crosses a face.
    limits = np.array(
        [port.n_inside * port.radius_m, port.n_port * port.radius_m, port.n_port * outer, port.n_water * outer]
    )
    signs = np.array([-1, 1, -1, 1])
    invariant = port.n_inside * offset * sine
    if invariant >= limits.min():
        raise ValueError(f"expected an optical axis that gets through the dome, got centre_m {port.centre_m}")
    turn = float(signs @ np.arcsin(invariant / limits))
    rate = 1 + port.n_inside * offset * cosine * float(signs @ (1 / np.sqrt(limits**2 - invariant**2)))
    if sine < COAXIAL:
        return 1 / rate, 1 / rate
    # sin(a + turn) / sin(a), written so that it holds on to small angles next to a = pi.
    across = float(np.cos(turn)) + cosine * float(np.sin(turn)) / sine
    return _ascending(1 / rate, 1 / across)


def _ascending(first: float, second: float) -> tuple[float, float]:
    return float(min(first, second)), float(max(first, second))


def traced_magnification(port: Port) -> tuple[float, float]:
    """f_water / f_air on the optical axis, from rays of the exact train: smallest, largest."""
    camera = PinholeCamera(width_px=1, height_px=1, fx_px=1.0, fy_px=1.0, cx_px=0.0, cy_px=0.0)
    steps = TRACED_SLOPE * np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    right, left, down, up = OpticalTrain(camera=camera, port=port).trace(steps).direction
    turn = np.stack([right - left, down - up], axis=1) / (2 * TRACED_SLOPE)
    largest, smallest = np.linalg.svd(turn, compute_uv=False)
    return 1 / float(largest), 1 / float(smallest)


def field_of_view(camera: Camera, port: Port) -> FieldOfView:
    """Angles in the medium outside the port between what opposite edges of the image, or the port's rim, let see."""
    train = OpticalTrain(camera=camera, port=port)
    left, right, top, bottom = -0.5, camera.width_px - 0.5, -0.5, camera.height_px - 0.5
    principal = (camera.cx_px, camera.cy_px)
    edges = (
        ((left, camera.cy_px), (right, camera.cy_px)),
        ((camera.cx_px, top), (camera.cx_px, bottom)),
        ((left, top), (right, bottom)),
    )
    horizontal, vertical, diagonal = (
        _half_field(train, principal, one) + _half_field(train, principal, other) for one, other in edges
    )
    return FieldOfView(horizontal=horizontal, vertical=vertical, diagonal=diagonal)


def _half_field(train: OpticalTrain, principal: tuple[float, float], edge: tuple[float, float]) -> float:
    """Angle from the ray of the principal point to the outermost ray that gets out on the way to an edge."""
    rays = train.trace(np.linspace(principal, edge, EDGE_SAMPLES + 1))
    out = rays.direction[rays.status == Status.OK]
    if rays.status[0] != Status.OK:
        raise ValueError(f"expected the principal point to see through the port, got {Status(rays.status[0]).name}")
    # The chord of two unit vectors gives small angles without cancellation, and angles up to pi.
    half_chord = float(np.linalg.norm(out[-1] - out[0])) / 2
    return float(2 * np.arcsin(min(1.0, half_chord)))
