"""Directions in which points of the water look at a robot: spread over a cone, or drawn by the angle of scattering."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from optics.kernels.backend import Array3f32, Float32, UInt32, dr, mi

FORWARD = 0.9
"""Mean cosine of the angles that are drawn: about that of natural water without its sharpest peak."""


@dataclass(frozen=True)
class SampleDirections:
    """Directions in which each of some points samples, a lane each.

    Attributes
    ----------
    place, number : UInt32
        Which point, and which of its directions.
    count : int
        Directions of a point.
    """

    place: Any
    number: Any
    count: int

    @classmethod
    def of(cls, points: int, count: int, first: int = 0) -> SampleDirections:
        """`count` directions of each of `points` points, whose numbers begin at `first`."""
        lane, each = dr.arange(UInt32, points * count), dr.opaque(UInt32, count)
        return cls(lane // each + dr.opaque(UInt32, first), lane % each, count)

    @property
    def share(self) -> Any:
        """From 0 to 1, even over the directions of a point."""
        # A factor that is no part of the kernel, which would be compiled for each count.
        return (Float32(self.number) + 0.5) * dr.opaque(Float32, 1 / self.count)

    def around(self, axis: Any, cosine: Any) -> Any:
        """Directions at angles from an axis, spread around it, each point's turned."""
        sine = dr.safe_sqrt(1 - dr.square(cosine))
        s, c = dr.sincos(spiral_azimuth(self.place, self.number))
        return Array3f32(mi.Frame3f(mi.Normal3f(axis)).to_world(mi.Vector3f(sine * c, sine * s, cosine)))


def spiral_azimuth(place: Any, number: Any) -> Any:
    """Azimuths, radians, of a spiral of equal shares (Vogel 1979); places turn it by the golden ratio's multiples."""
    turns = Float32(place % 4096) * 0.618033988749895
    return Float32(number) * 2.399963229728653 + 2 * np.pi * (turns - dr.floor(turns))


@dataclass(frozen=True)
class Cone:
    """Directions about an axis down to a cosine, a cone for each lane."""

    axis: Any
    lowest: Any

    def of(self, lane: Any) -> Cone:
        """Cones of some lanes."""
        return Cone(dr.gather(Array3f32, self.axis, lane), dr.gather(Float32, self.lowest, lane))

    def directions(self, samples: SampleDirections) -> Any:
        """Directions spread evenly over the cones, a cone for each."""
        return samples.around(self.axis, 1 - (1 - self.lowest) * samples.share)

    def density(self, direction: Any) -> Any:
        """Of such directions, 1/sr."""
        return dr.select(dr.dot(direction, self.axis) >= self.lowest, dr.rcp(2 * np.pi * (1 - self.lowest)), 0)


def scattered_directions(ahead: Any, samples: SampleDirections) -> Any:
    """Directions about those ahead, drawn by the phase function of Henyey and Greenstein (1941, ApJ 93, 70)."""
    g = FORWARD
    cosine = (1 + g * g - dr.square((1 - g * g) / (1 - g + 2 * g * samples.share))) / (2 * g)
    return samples.around(ahead, cosine)


def scattered_density(cosine: Any) -> Any:
    """Of such directions, 1/sr, at the cosine of the angle from the direction ahead."""
    g = FORWARD
    base = 1 + g * g - 2 * g * cosine
    return (1 - g * g) / (4 * np.pi * base * dr.sqrt(base))
