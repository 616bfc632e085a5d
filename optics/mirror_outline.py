"""Outlines of mirrors in their own axes: rectangle, octagon, ellipse, or any convex polygon.

The one definition: tracing, rendering, sizing and solids ask it for what is inside, for points of the rim and for the
area. Lengths may be numbers, arrays, or a kernel's numbers: what is computed here uses their operators alone.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from optics.kernels.arrays import FloatArray, check_points, opaque
from rigs.gaze import FlatMirror

OCTAGON_CUT = 2 - 2**0.5
"""Legs of an octagon's cut corners over half of its shorter side: a square becomes a regular octagon."""

RIM_POINTS = 96
"""Points that stand for an ellipse where a polygon is needed: it leaves out 0.05 % of the half axes."""

TINY = 1e-30
"""Keeps the slope of an ellipse's equation from being zero in its centre."""


class Outline(ABC):
    """Where a mirror ends, metres in its own axes."""

    @abstractmethod
    def beyond(self, x: Any, y: Any) -> tuple[Any, ...]:
        """Signed distances of points from each line of the rim, none above zero inside; also a kernel.

        To a straight line exactly, to an ellipse to first order (Sampson 1982).
        """

    @abstractmethod
    def rim(self, count: int = RIM_POINTS) -> FloatArray:
        """Corners counter-clockwise, shape (k, 2); of an ellipse, which has none, `count` points."""

    @abstractmethod
    def parameters(self) -> Outline:
        """The same with a kernel's numbers."""

    @property
    def kind(self) -> tuple[Any, ...]:
        """What a compiled kernel depends on; everything else is its input."""
        return (type(self),)

    @property
    def has_corners(self) -> bool:
        """Whether the rim is made of straight edges."""
        return True

    def contains(self, x: Any, y: Any) -> Any:
        """Whether points are inside or on the rim; also a kernel."""
        first, *others = (distance <= 0 for distance in self.beyond(x, y))
        for each in others:
            first = first & each
        return first

    @property
    def area_m2(self) -> Any:
        """Area."""
        x, y = self.rim().T
        return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2

    @property
    def radius_m(self) -> Any:
        """Distance from the origin to the farthest point."""
        return float(np.linalg.norm(self.rim(), axis=1).max())


@dataclass(frozen=True, kw_only=True)
class Centred(Outline):
    """What a rig file can say: an outline about the origin that fills a width and a height."""

    half_width: Any
    half_height: Any

    def parameters(self) -> Self:
        """The same with a kernel's numbers."""
        return replace(self, half_width=opaque(self.half_width), half_height=opaque(self.half_height))

    @abstractmethod
    def drawn_in(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Points, those beyond the rim brought to it: on a straight side across, elsewhere towards the centre."""

    def _clipped(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        return np.clip(x, -self.half_width, self.half_width), np.clip(y, -self.half_height, self.half_height)


@dataclass(frozen=True, kw_only=True)
class Rectangle(Centred):
    """Rectangle."""

    def beyond(self, x: Any, y: Any) -> tuple[Any, ...]:
        """As `Outline.beyond`."""
        return abs(x) - self.half_width, abs(y) - self.half_height

    def drawn_in(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """As `Centred.drawn_in`."""
        return self._clipped(x, y)

    def rim(self, count: int = RIM_POINTS) -> FloatArray:
        """As `Outline.rim`."""
        signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
        return np.asarray(signs * [self.half_width, self.half_height])

    @property
    def area_m2(self) -> Any:
        """Area."""
        return 4 * self.half_width * self.half_height

    @property
    def radius_m(self) -> Any:
        """Distance from the origin to the farthest point."""
        return np.hypot(self.half_width, self.half_height)


@dataclass(frozen=True, kw_only=True)
class Octagon(Centred):
    """Rectangle whose corners are cut at 45 degrees, by `OCTAGON_CUT` of half the shorter side.

    It holds the ellipse of the same sides, and touches it where both are as wide as high.
    """

    @property
    def leg_m(self) -> Any:
        """How far a cut reaches along each side."""
        # The smaller of two, by operators that a kernel's numbers have too.
        return OCTAGON_CUT / 2 * (self.half_width + self.half_height - abs(self.half_width - self.half_height))

    def beyond(self, x: Any, y: Any) -> tuple[Any, ...]:
        """As `Outline.beyond`."""
        across, along = abs(x), abs(y)
        cut = (across + along - self.half_width - self.half_height + self.leg_m) / 2**0.5
        return across - self.half_width, along - self.half_height, cut

    def drawn_in(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """As `Centred.drawn_in`."""
        x, y = self._clipped(x, y)
        limit = self.half_width + self.half_height - self.leg_m
        over = np.maximum((abs(x) + abs(y)) / limit, 1)
        return x / over, y / over

    def rim(self, count: int = RIM_POINTS) -> FloatArray:
        """As `Outline.rim`."""
        w, h, leg = self.half_width, self.half_height, self.leg_m
        quarter = np.array([[w - leg, -h], [w, leg - h]])
        right = np.concatenate([quarter, quarter[::-1] * [1, -1]])
        return np.concatenate([[[leg - w, -h]], right, right[:0:-1] * [-1, 1]])

    @property
    def area_m2(self) -> Any:
        """Area."""
        return 4 * self.half_width * self.half_height - 2 * self.leg_m**2

    @property
    def radius_m(self) -> Any:
        """Distance from the origin to the farthest point."""
        longer, shorter = np.maximum(self.half_width, self.half_height), np.minimum(self.half_width, self.half_height)
        return np.hypot(longer, shorter - self.leg_m)


@dataclass(frozen=True, kw_only=True)
class Ellipse(Centred):
    """Ellipse."""

    def beyond(self, x: Any, y: Any) -> tuple[Any, ...]:
        """As `Outline.beyond`."""
        a, b = x / self.half_width, y / self.half_height
        slope = ((a / self.half_width) ** 2 + (b / self.half_height) ** 2 + TINY) ** 0.5
        return ((a**2 + b**2 - 1) / (2 * slope),)

    def contains(self, x: Any, y: Any) -> Any:
        """As `Outline.contains`, without a root."""
        return (x / self.half_width) ** 2 + (y / self.half_height) ** 2 <= 1

    def drawn_in(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """As `Centred.drawn_in`."""
        over = np.maximum(np.hypot(x / self.half_width, y / self.half_height), 1)
        return x / over, y / over

    def rim(self, count: int = RIM_POINTS) -> FloatArray:
        """As `Outline.rim`."""
        angles = 2 * np.pi * np.arange(count) / count
        return np.stack([self.half_width * np.cos(angles), self.half_height * np.sin(angles)], axis=1)

    @property
    def has_corners(self) -> bool:
        """None."""
        return False

    @property
    def area_m2(self) -> Any:
        """Area."""
        return np.pi * self.half_width * self.half_height

    @property
    def radius_m(self) -> Any:
        """Distance from the origin to the farthest point."""
        return np.maximum(self.half_width, self.half_height)


@dataclass(frozen=True)
class Polygon(Outline):
    """Any convex polygon.

    Attributes
    ----------
    corners : tuple of (x, y)
        Counter-clockwise, as `of` makes them.
    """

    corners: tuple[tuple[Any, Any], ...]

    @classmethod
    def of(cls, corners_m: ArrayLike) -> Self:
        """Polygon of corners, shape (k, 2), either way round; `ValueError` where it has a dent or no corner."""
        corners = check_points("outline", corners_m, 2)
        turn = _check_convex(corners)
        return cls(tuple((float(x), float(y)) for x, y in corners[::turn]))

    def beyond(self, x: Any, y: Any) -> tuple[Any, ...]:
        """As `Outline.beyond`."""
        ends = zip(self.corners, self.corners[1:] + self.corners[:1], strict=True)
        sides = [(x0, y0, x1 - x0, y1 - y0) for (x0, y0), (x1, y1) in ends]
        return tuple(((x - x0) * dy - (y - y0) * dx) / (dx**2 + dy**2) ** 0.5 for x0, y0, dx, dy in sides)

    def rim(self, count: int = RIM_POINTS) -> FloatArray:
        """As `Outline.rim`."""
        return np.array(self.corners)

    def parameters(self) -> Self:
        """The same with a kernel's numbers."""
        return replace(self, corners=tuple((opaque(x), opaque(y)) for x, y in self.corners))

    @property
    def kind(self) -> tuple[Any, ...]:
        """As `Outline.kind`."""
        return (type(self), len(self.corners))


OUTLINES: dict[str, type[Centred]] = {"rectangle": Rectangle, "octagon": Octagon, "ellipse": Ellipse}
"""By their names in the rig file."""


def mirror_outline(mirror: FlatMirror) -> Centred:
    """Outline of a mirror of a rig."""
    return OUTLINES[mirror.outline](half_width=mirror.width_mm / 2000, half_height=mirror.height_mm / 2000)


def _check_convex(corners: FloatArray) -> int:
    """1 for corners counter-clockwise around a convex polygon, -1 for clockwise; `ValueError` for others."""
    if len(corners) < 3 or not np.isfinite(corners).all():
        raise ValueError(f"expected outline with at least three finite corners, got {corners.tolist()}")
    steps = np.diff(np.vstack([corners, corners[:1]]), axis=0)
    turns = steps[:, 0] * np.roll(steps[:, 1], -1) - steps[:, 1] * np.roll(steps[:, 0], -1)
    smallest = 1e-9 * np.abs(corners).max() ** 2
    one_way = (turns > smallest).all() or (turns < -smallest).all()
    # A pentagram turns one way at every corner too, but goes round twice.
    heading = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    if not one_way or abs(heading[-1] - heading[0]) >= 2 * np.pi:
        raise ValueError(f"expected outline to be convex with a real corner everywhere, got {corners.tolist()}")
    return 1 if turns[0] > 0 else -1
