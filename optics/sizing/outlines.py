"""Smallest outlines around what a mirror has to reflect: those a rig file can say, and two that show what they cost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from optics.kernels.arrays import FloatArray
from optics.mirror_outline import OCTAGON_CUT, OUTLINES, Centred, Polygon

ROUNDED_CORNERS = 16
"""Sides of the polygon that stands for the disc by which a point is grown; it holds the disc, and 2 % more radius."""

STRAIGHT_M = 1e-6
"""Corners of the hull that stick out less than this are left out: a thousandth of a print's layer."""

REACH_DIRECTIONS = {"rectangle": 2, "octagon": 3, "ellipse": 33}
"""From the x axis to the y axis: how far points reach along them tells how large an outline must be. An ellipse is made
around the polygon of these reaches, which is at most 0.03 % too large."""

HALVINGS = 60
"""Golden sections of the range of an ellipse's proportions: to rounding."""

STEEPEST = 12.0
"""Natural logarithm of the largest ratio of the squares of an ellipse's half axes: 400 to 1."""


@dataclass(frozen=True, kw_only=True)
class Outlines:
    """Outlines in a mirror's axes (x, y), metres, each the smallest of its kind that holds a set of discs.

    Attributes
    ----------
    centred : dict of Centred
        What a rig file can say, by its name there.
    free_rectangle_m : array, shape (4, 2)
        Corners of the rectangle along the axes that may lie anywhere.
    convex_m : array, shape (k, 2)
        Corners of the convex hull. All corners run counter-clockwise.
    """

    centred: dict[str, Centred]
    free_rectangle_m: FloatArray
    convex_m: FloatArray

    @property
    def kinds(self) -> tuple[str, ...]:
        """Names of all outlines."""
        return (*self.centred, "free rectangle", "convex")

    def sides_m(self, name: str) -> tuple[float, float]:
        """Width and height of an outline of the rig file."""
        outline = self.centred[name]
        return 2 * outline.half_width, 2 * outline.half_height

    def corners_m(self, kind: str) -> FloatArray:
        """Corners of an outline of the rig file, "free rectangle" or "convex", shape (k, 2); points of an ellipse."""
        if kind not in self.kinds:
            raise ValueError(f"expected an outline out of {', '.join(self.kinds)}, got {kind!r}")
        if kind in self.centred:
            return self.centred[kind].rim()
        return self.convex_m if kind == "convex" else self.free_rectangle_m

    def area_m2(self, kind: str) -> float:
        """Area of an outline."""
        if kind in self.centred:
            return float(self.centred[kind].area_m2)
        return float(Polygon.of(self.corners_m(kind)).area_m2)


def outlines_around(points_m: FloatArray, growth_m: FloatArray) -> Outlines:
    """Outlines around discs.

    Parameters
    ----------
    points_m : array, shape (n, 2)
        Their centres.
    growth_m : array, shape (n,)
        Their radii.
    """
    low = (points_m - growth_m[:, np.newaxis]).min(axis=0)
    high = (points_m + growth_m[:, np.newaxis]).max(axis=0)
    x, y = np.abs(points_m).T
    centred = {}
    for name, outline in OUTLINES.items():
        reaches = np.array([(x * c + y * s + growth_m).max() for c, s in reach_directions(name)])
        half_width, half_height = smallest_halves(name, reaches)
        centred[name] = outline(half_width=float(half_width), half_height=float(half_height))
    return Outlines(
        centred=centred,
        free_rectangle_m=_rectangle(*np.column_stack([low, high])),
        convex_m=_hull_of_discs(points_m, growth_m),
    )


def reach_directions(name: str) -> FloatArray:
    """Directions along which points (|x|, |y|) are measured for an outline, unit vectors, shape (k, 2)."""
    angles = np.linspace(0, np.pi / 2, REACH_DIRECTIONS[name])
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    # A quarter turn's cosine is not quite zero.
    directions[-1] = 0.0, 1.0
    return directions


def smallest_halves(name: str, reaches_m: FloatArray) -> FloatArray:
    """Half width and height of the outline of least area around points that reach that far.

    Parameters
    ----------
    name : str
        Of the outline.
    reaches_m : array, shape (..., k)
        Along `reach_directions`; infinite where no mirror does.

    Returns
    -------
    array, shape (..., 2)
    """
    if name == "rectangle":
        return np.stack([reaches_m[..., 0], reaches_m[..., -1]], axis=-1)
    finite = np.isfinite(reaches_m).all(axis=-1, keepdims=True)
    known = np.where(finite, reaches_m, 1.0)
    halves = _smallest_octagon(known) if name == "octagon" else _smallest_ellipse(known)
    return np.where(finite, halves, np.inf)


def _smallest_octagon(reaches: FloatArray) -> FloatArray:
    """One that is as narrow or as low as can be, or as wide as high.

    In between, with the cut corners held where they must be, the area is a concave function of either side.
    """
    x, slant, y = np.moveaxis(reaches, -1, 0)
    slant = slant * 2**0.5
    other = 1 - OCTAGON_CUT

    def beside(half: FloatArray) -> FloatArray:
        """Other half side that holds the cut's line: it is the longer one, or the shorter one."""
        return np.asarray(np.minimum((slant - half) / other, slant - other * half))

    even = np.maximum(np.maximum(x, y), slant / (1 + other))
    halves = np.stack(
        [
            np.stack([x, np.maximum(y, beside(x))], axis=-1),
            np.stack([np.maximum(x, beside(y)), y], axis=-1),
            np.stack([even, even], axis=-1),
        ]
    )
    areas = OUTLINES["octagon"](half_width=halves[..., 0], half_height=halves[..., 1]).area_m2
    return np.asarray(np.take_along_axis(halves, areas.argmin(axis=0)[np.newaxis, ..., np.newaxis], axis=0)[0])


def _smallest_ellipse(reaches: FloatArray) -> FloatArray:
    """Around the corners of the polygon of the reaches: the area's logarithm is convex in that of the proportions."""
    normals = reach_directions("ellipse")
    pairs = np.stack([normals[:-1], normals[1:]], axis=1)
    limits = np.stack([reaches[..., :-1], reaches[..., 1:]], axis=-1)
    squares = np.linalg.solve(pairs, limits[..., np.newaxis])[..., 0] ** 2

    def width_squared(log_ratio: FloatArray) -> FloatArray:
        return np.asarray((squares[..., 0] + np.exp(log_ratio)[..., np.newaxis] * squares[..., 1]).max(axis=-1))

    def log_area(log_ratio: FloatArray) -> FloatArray:
        return np.asarray(2 * np.log(width_squared(log_ratio)) - log_ratio)

    low, high = (np.full(reaches.shape[:-1], limit) for limit in (-STEEPEST, STEEPEST))
    golden = (5**0.5 - 1) / 2
    for _ in range(HALVINGS):
        near, far = high - golden * (high - low), low + golden * (high - low)
        lower: NDArray[np.bool_] = log_area(near) < log_area(far)
        low, high = np.where(lower, low, near), np.where(lower, far, high)
    ratio = (low + high) / 2
    width = width_squared(ratio)
    return np.asarray(np.sqrt(np.stack([width, width / np.exp(ratio)], axis=-1)))


def _rectangle(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.array([[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]])


def _hull_of_discs(points_m: FloatArray, growth_m: FloatArray) -> FloatArray:
    """Convex hull of discs, each replaced by the polygon around it."""
    points_m, growth_m = _near_the_rim(points_m, growth_m)
    if not growth_m.any():
        return _without_straight_corners(_hull(points_m))
    angles = 2 * np.pi * np.arange(ROUNDED_CORNERS) / ROUNDED_CORNERS
    rim = np.stack([np.cos(angles), np.sin(angles)], axis=1) / np.cos(np.pi / ROUNDED_CORNERS)
    shifted = [_hull(points_m + growth_m[:, np.newaxis] * corner) for corner in rim]
    return _without_straight_corners(_hull(np.concatenate(shifted)))


def _near_the_rim(points_m: FloatArray, growth_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Leave out discs inside the polygon of the furthest points in a few directions (Akl & Toussaint 1978)."""
    angles = 2 * np.pi * np.arange(ROUNDED_CORNERS) / ROUNDED_CORNERS
    # Column by column: the points are many, and rows of two make NumPy slow.
    x, y = np.ascontiguousarray(points_m.T)
    furthest = [int((x * np.cos(angle) + y * np.sin(angle)).argmax()) for angle in angles]
    beyond = np.zeros(len(points_m), dtype=np.bool_)
    for a, b, offset in ConvexHull(points_m[furthest]).equations:
        beyond |= a * x + b * y + growth_m >= -offset - STRAIGHT_M
    return points_m[beyond], growth_m[beyond]


def _hull(points_m: FloatArray) -> FloatArray:
    return np.asarray(points_m[ConvexHull(points_m).vertices])


def _without_straight_corners(corners_m: FloatArray) -> FloatArray:
    """Drop corners that lie within `STRAIGHT_M` of the line between those that stay."""
    kept = [corners_m[0]]
    waiting: list[FloatArray] = []
    for corner, following in zip(corners_m[1:], [*corners_m[2:], corners_m[0]], strict=True):
        waiting.append(corner)
        along = following - kept[-1]
        offsets = [_cross(along, point - kept[-1]) / np.linalg.norm(along) for point in waiting]
        if max(map(abs, offsets)) > STRAIGHT_M:
            kept.append(corner)
            waiting = []
    return np.array(kept)


def _cross(a: FloatArray, b: FloatArray) -> float:
    return float(a[0] * b[1] - a[1] * b[0])
