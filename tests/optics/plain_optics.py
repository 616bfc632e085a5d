"""Ports written a second time, plainly, for the tests: shares no code and no formula choices with `optics`.

The functions work on sequences of any numbers: with mpmath's they are good to 50 digits, with floats SciPy can call
them. Snell is written with the conserved tangential part, spheres by the point of closest approach; `optics` uses
the cosine form of vector Snell and the quadratic equation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import mpmath
import numpy as np
from scipy.optimize import brentq

DIGITS = 50
"""Decimal digits of the reference: rounding is then no part of any difference."""

Vector = Sequence[Any]


def numbers(values: Any) -> list[Any]:
    """Exact high-precision copies of floats."""
    return [mpmath.mpf(float(value)) for value in values]


def dot(a: Vector, b: Vector) -> Any:
    return sum(x * y for x, y in zip(a, b, strict=True))


def along(start: Vector, direction: Vector, distance: Any) -> list[Any]:
    return [x + distance * y for x, y in zip(start, direction, strict=True)]


def unit(vector: Vector) -> list[Any]:
    length = mpmath.sqrt(dot(vector, vector))
    return [x / length for x in vector]


def snell(direction: Vector, normal: Vector, n_before: Any, n_behind: Any) -> list[Any] | None:
    """Conserve n times the tangential part of the direction; None for total reflection."""
    tangential = along(direction, normal, -dot(direction, normal))
    tangential = [n_before * x / n_behind for x in tangential]
    cosine2 = 1 - dot(tangential, tangential)
    return None if cosine2 <= 0 else along(tangential, normal, mpmath.sqrt(cosine2))


@dataclass(frozen=True, kw_only=True)
class PlainFlat:
    """Plane-parallel window: distance and thickness along the normal; indices inside, of the window, outside."""

    normal: Vector
    distance: Any
    thickness: Any
    indices: Vector

    def normal_at(self, _point: Vector) -> Vector:
        return self.normal

    def reach(self, start: Vector, direction: Vector, face: int) -> list[Any]:
        height = self.distance + face * self.thickness
        return along(start, direction, (height - dot(start, self.normal)) / dot(direction, self.normal))


@dataclass(frozen=True, kw_only=True)
class PlainDome:
    """Spherical shell: inner radius and thickness."""

    centre: Vector
    radius: Any
    thickness: Any
    indices: Vector

    def normal_at(self, point: Vector) -> Vector:
        return unit(along(point, self.centre, -1))

    def reach(self, start: Vector, direction: Vector, face: int) -> list[Any]:
        radius = self.radius + face * self.thickness
        to_closest = dot(along(self.centre, start, -1), direction)
        closest = along(start, direction, to_closest)
        miss = along(closest, self.centre, -1)
        return along(closest, direction, mpmath.sqrt(radius**2 - dot(miss, miss)))


def faces(port: PlainFlat | PlainDome, direction: Vector) -> tuple[list[Any], list[Any], list[Any] | None]:
    """Where a ray from the pinhole crosses the inner and the outer face, and its direction in the water."""
    inside, window, water = port.indices
    inner = port.reach([0, 0, 0], direction, 0)
    in_window = snell(direction, port.normal_at(inner), inside, window)
    if in_window is None:
        return inner, inner, None
    outer = port.reach(inner, in_window, 1)
    return inner, outer, snell(in_window, port.normal_at(outer), window, water)


def optical_path(port: PlainFlat | PlainDome, stops: Sequence[Vector]) -> Any:
    """Sum of n times the length over the three media; stops: pinhole, both crossings, point."""
    legs = [along(to, start, -1) for start, to in pairwise(stops)]
    return dot(port.indices, [mpmath.sqrt(dot(leg, leg)) for leg in legs])


def moved_on_face(port: PlainFlat | PlainDome, point: Vector, shift: Vector) -> list[Any]:
    """Move a point of a face along two tangents and bring it back to the face: of a dome, around its centre."""
    normal = port.normal_at(point)
    first = unit([normal[2], 0 * normal[2], -normal[0]])
    second = [
        normal[1] * first[2] - normal[2] * first[1],
        normal[2] * first[0] - normal[0] * first[2],
        normal[0] * first[1] - normal[1] * first[0],
    ]
    moved = along(along(point, first, shift[0]), second, shift[1])
    if isinstance(port, PlainFlat):
        return moved
    radial = along(point, port.centre, -1)
    return along(port.centre, port.normal_at(moved), mpmath.sqrt(dot(radial, radial)))


def seen_direction(port: PlainFlat | PlainDome, point: Vector) -> np.ndarray:
    """Direction at the pinhole in which a point in the water is seen, by bisection in the plane of refraction.

    The plane contains the pinhole, the point and the port's axis of symmetry through the pinhole; of all rays in it
    one passes the point. What is driven to zero is the signed distance by which the traced ray misses it.
    """
    axis = np.array(port.normal if isinstance(port, PlainFlat) else port.centre, dtype=float)
    axis = axis / np.linalg.norm(axis)
    target = np.array(point, dtype=float)
    sideways = target - axis * (target @ axis)
    sideways = sideways / np.linalg.norm(sideways)

    def direction(angle: float) -> np.ndarray:
        return np.cos(angle) * axis + np.sin(angle) * sideways

    def miss(angle: float) -> float:
        _, outer, outgoing = faces(port, [float(x) for x in direction(angle)])
        assert outgoing is not None
        start, heading = np.array(outer, dtype=float), np.array(outgoing, dtype=float)
        # Twice the area spanned with the target, signed by the side on which the ray passes it.
        return float(np.cross(heading, target - start) @ np.cross(axis, sideways))

    straight = float(np.arctan2(target @ sideways, target @ axis))
    # Rays at and beyond a right angle to a flat port's normal never reach it.
    largest = 1.55 if isinstance(port, PlainFlat) else np.inf
    angle = brentq(miss, straight - 0.5, min(straight + 0.5, largest), xtol=1e-15, rtol=1e-14)
    return direction(angle)
