"""Where a port makes things in the water appear, and whether the lens can focus there.

Paraxial, along the optical axis; distances are metres from the pinhole. Formulas and sources:
`docs/explanation/ports.md`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from optics.ports.port import DomePort, FlatPort, Port


@dataclass(frozen=True, kw_only=True)
class Focus:
    """Whether a lens can focus on what a port shows it.

    Attributes
    ----------
    infinity_is_sharp : bool
        Whether the lens focuses as near as the image of infinity, which a dome puts a few radii off.
    nearest_object_m : float
        The nearest object in the water on which the lens can focus; infinity when there is none.
    """

    infinity_is_sharp: bool
    nearest_object_m: float


def apparent_distance(port: Port, object_distance_m: float) -> float:
    """Where an object in the water appears to the lens: the distance of its virtual image, metres.

    Paraxial, along the optical axis, from the pinhole. The tilt of a flat port and the sideways part of a dome's
    decentring come in at second order and are left out. Negative: the port makes a real image behind the pinhole.

    Raises
    ------
    ValueError
        For an object that is not in front of the port's outer face.
    """
    _check_in_water(port, object_distance_m)
    if isinstance(port, FlatPort):
        window = port.distance_m + port.thickness_m
        in_window = port.thickness_m / port.n_port
        in_water = (object_distance_m - window) / port.n_water
        return port.distance_m + port.n_inside * (in_window + in_water)
    if isinstance(port, DomePort):
        centre = float(np.asarray(port.centre_m)[2])
        vergence = _dome_vergence(port) + 1 / (port.n_water * (object_distance_m - centre))
        return float("inf") if vergence == 0 else centre + 1 / (port.n_inside * vergence)
    return object_distance_m


def focus_behind(port: Port, nearest_focus_m: float) -> Focus:
    """Whether a lens that focuses from `nearest_focus_m` (of the pinhole) to infinity can use what the port shows.

    Raises
    ------
    ValueError
        For a nearest focus that is not a positive distance.
    """
    if not 0 < nearest_focus_m < float("inf"):
        raise ValueError(f"expected nearest_focus_m > 0, got {nearest_focus_m!r}")
    infinity = apparent_distance(port, float("inf"))
    # Behind a port in air whose image of infinity is real (negative), the lens would have to focus beyond infinity.
    sharp = infinity >= nearest_focus_m
    return Focus(
        infinity_is_sharp=sharp,
        nearest_object_m=_object_distance(port, nearest_focus_m) if sharp else float("inf"),
    )


def _object_distance(port: Port, appears_at_m: float) -> float:
    """Inverse of `apparent_distance`, at least the outer face's distance."""
    distance = appears_at_m
    if isinstance(port, FlatPort):
        in_water = (appears_at_m - port.distance_m) / port.n_inside - port.thickness_m / port.n_port
        distance = port.distance_m + port.thickness_m + port.n_water * in_water
    elif isinstance(port, DomePort):
        centre = float(np.asarray(port.centre_m)[2])
        if appears_at_m <= centre:
            return _outer_face(port)
        vergence = 1 / (port.n_inside * (appears_at_m - centre)) - _dome_vergence(port)
        distance = float("inf") if vergence <= 0 else centre + 1 / (port.n_water * vergence)
    return max(distance, _outer_face(port))


def _dome_vergence(port: DomePort) -> float:
    """What the dome adds to 1 / (n x distance from its centre), from the water to the air; 1/m.

    A paraxial ray with the invariant k = n r sin(angle to the radius) turns by ``k / n (1 / r1 - 1 / r2)`` around the
    centre between two radii; for an object at D and its image at q this sums to
    ``1 / (n_i q) = 1 / (n_w D) + (1 / n_i - 1 / n_p) / R1 + (1 / n_p - 1 / n_w) / R2``.
    """
    inner = (1 / port.n_inside - 1 / port.n_port) / port.radius_m
    return inner + (1 / port.n_port - 1 / port.n_water) / (port.radius_m + port.thickness_m)


def _outer_face(port: Port) -> float:
    """Distance of the outer face along the axis."""
    if isinstance(port, FlatPort):
        return port.distance_m + port.thickness_m
    if isinstance(port, DomePort):
        return float(np.asarray(port.centre_m)[2]) + port.radius_m + port.thickness_m
    return 0.0


def _check_in_water(port: Port, object_distance_m: float) -> None:
    face = _outer_face(port)
    if not object_distance_m > face:
        raise ValueError(
            f"expected object_distance_m beyond the port's outer face, {face:g} m off, got {object_distance_m!r}"
        )
