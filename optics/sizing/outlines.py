"""Smallest outlines around what a mirror has to reflect: rectangles, an octagon, the convex hull; in its plane."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull

from optics.kernels.arrays import FloatArray

OCTAGON_NORMALS = np.radians(np.arange(8) * 45.0)
"""Directions of the octagon's edge normals in the mirror's plane, from its x axis."""

ROUNDED_CORNERS = 16
"""Sides of the polygon that stands for the disc by which a point is grown; it holds the disc, and 2 % more radius."""

STRAIGHT_M = 1e-6
"""Corners of the hull that stick out less than this are left out: a thousandth of a print's layer."""


@dataclass(frozen=True, kw_only=True)
class Outlines:
    """Outlines in a mirror's axes (x, y), metres, each the smallest of its kind that holds a set of discs.

    Attributes
    ----------
    rectangle_m : (2,)
        Width and height of the rectangle centred on the origin: what a rig file can say.
    free_rectangle_m : array, shape (4, 2)
        Corners of the rectangle along the axes that may lie anywhere.
    octagon_m : array, shape (k, 2), k <= 8
        Corners of the octagon with edges at 0, 45, ... degrees.
    convex_m : array, shape (k, 2)
        Corners of the convex hull. All corners run counter-clockwise.
    """

    rectangle_m: tuple[float, float]
    free_rectangle_m: FloatArray
    octagon_m: FloatArray
    convex_m: FloatArray

    def corners_m(self, kind: str) -> FloatArray:
        """Corners of an outline: "rectangle", "free rectangle", "octagon" or "convex"; shape (k, 2)."""
        outlines = {
            "rectangle": _rectangle(*(side / 2 * np.array([-1, 1]) for side in self.rectangle_m)),
            "free rectangle": self.free_rectangle_m,
            "octagon": self.octagon_m,
            "convex": self.convex_m,
        }
        if kind not in outlines:
            raise ValueError(f"expected an outline out of {', '.join(outlines)}, got {kind!r}")
        return outlines[kind]

    def area_m2(self, kind: str) -> float:
        """Area of an outline."""
        x, y = self.corners_m(kind).T
        return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def outlines_around(points_m: FloatArray, growth_m: FloatArray) -> Outlines:
    """Outlines around discs.

    Parameters
    ----------
    points_m : array, shape (n, 2)
        Their centres.
    growth_m : array, shape (n,)
        Their radii.
    """
    half = (np.abs(points_m) + growth_m[:, np.newaxis]).max(axis=0)
    low = (points_m - growth_m[:, np.newaxis]).min(axis=0)
    high = (points_m + growth_m[:, np.newaxis]).max(axis=0)
    normals = np.stack([np.cos(OCTAGON_NORMALS), np.sin(OCTAGON_NORMALS)], axis=1)
    limits = np.array([(points_m @ normal + growth_m).max() for normal in normals])
    return Outlines(
        rectangle_m=(float(2 * half[0]), float(2 * half[1])),
        free_rectangle_m=_rectangle(*np.column_stack([low, high])),
        octagon_m=_where_lines_meet(normals, limits),
        convex_m=_hull_of_discs(points_m, growth_m),
    )


def _rectangle(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.array([[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]])


def _where_lines_meet(normals: FloatArray, limits: FloatArray) -> FloatArray:
    """Corners between neighbouring edges ``normal . x = limit``; edges that have shrunk to a point give one corner."""
    following = np.roll(normals, -1, axis=0)
    pairs = np.stack([normals, following], axis=1)
    corners = np.linalg.solve(pairs, np.stack([limits, np.roll(limits, -1)], axis=1)[..., np.newaxis])[..., 0]
    apart = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1) > STRAIGHT_M
    return np.asarray(corners[apart])


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
