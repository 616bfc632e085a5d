"""A target of which the crop's edge or the robot hides a part: where its middle is.

The centroid of what is left stays in view while the target goes out of it: a target that swims on would seem to slow
down and stop at the edge. Its other side is still where it is, one radius from the middle.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tracking.records import Blob

AT_EDGE_PX = 4
"""From a blob within which an edge cuts it: a cell of the detector, and the smear of one."""

CUT_SHARE = 0.3
"""Of a side's length along which it must be hidden to be cut there: the chord of a disc that has lost 2 % of its height
is as long."""


def cut_sides(blob: Blob, hidden: NDArray[np.uint8]) -> tuple[int, int]:
    """On which sides of its box a blob is cut.

    Parameters
    ----------
    blob : Blob
    hidden : array, shape (crop height, crop width)
        Above 0 in pixels that do not show a target; beyond the crop none does.

    Returns
    -------
    across, down : int
        -1 when it is cut on the left (at the top), 1 on the right (at the bottom), 0 on neither or both.
    """
    left, right, top, bottom = _cut(blob, hidden)
    return right - left, bottom - top


def is_cut(blob: Blob, hidden: NDArray[np.uint8]) -> bool:
    """Whether a blob is cut on any side of its box; `hidden` as in `cut_sides`."""
    return any(_cut(blob, hidden))


def _cut(blob: Blob, hidden: NDArray[np.uint8]) -> list[bool]:
    """Whether it is cut on the left, on the right, at the top, at the bottom."""
    x, y, width, height = blob.box_px
    beside = np.ones((height + 2 * AT_EDGE_PX, width + 2 * AT_EDGE_PX), dtype=bool)
    top, left = y - AT_EDGE_PX, x - AT_EDGE_PX
    inside = hidden[max(top, 0) : y + height + AT_EDGE_PX, max(left, 0) : x + width + AT_EDGE_PX]
    first_row, first_column = max(-top, 0), max(-left, 0)
    beside[first_row : first_row + inside.shape[0], first_column : first_column + inside.shape[1]] = inside
    middle_rows, middle_columns = beside[AT_EDGE_PX:-AT_EDGE_PX], beside[:, AT_EDGE_PX:-AT_EDGE_PX]
    return [
        float(strip.any(axis=axis).mean()) > CUT_SHARE
        for strip, axis in (
            (middle_rows[:, :AT_EDGE_PX], 1),
            (middle_rows[:, -AT_EDGE_PX:], 1),
            (middle_columns[:AT_EDGE_PX], 0),
            (middle_columns[-AT_EDGE_PX:], 0),
        )
    ]


def middle_of_cut(
    blob: Blob, sides: tuple[int, int], whole_px2: float, *, by_edge: bool
) -> tuple[tuple[float, float], float]:
    """Middle of a disc that is cut on some sides: one radius from those that are not.

    Along an axis on which no side is cut, or on which there is as much of it as of the whole, it is the centroid.

    Parameters
    ----------
    blob : Blob
    sides : tuple of int
        As `cut_sides` has them.
    whole_px2 : float
        Area of the whole disc; 0 when it is not known.
    by_edge : bool
        Whether it is the crop's edge alone that cuts it: then a disc of which more is seen than of the whole is as wide
        as it is high. What the robot cuts may be in pieces.

    Returns
    -------
    middle, deviation : tuple of float, float
        Pixels of the crop, and the standard deviation that being cut adds to it: half of its way from the centroid, or
        the radius where nothing tells how large the disc is.
    """
    if sides == (0, 0):
        return blob.centroid_px, 0.0
    first, size = blob.box_px[:2], blob.box_px[2:]
    radius_px = math.sqrt(whole_px2 / math.pi)
    if blob.area_px >= whole_px2:
        if all(sides) or not by_edge:
            return blob.centroid_px, math.sqrt(blob.area_px / math.pi)
        radius_px = size[0 if sides[1] else 1] / 2
    x, y = (
        _one_radius_from(low - 0.5, extent, side, radius_px) if side and extent < 2 * radius_px else centroid
        for centroid, side, low, extent in zip(blob.centroid_px, sides, first, size, strict=True)
    )
    return (x, y), math.dist((x, y), blob.centroid_px) / 2


def middle_of_part(blob: Blob, whole_px2: float, expected_px: tuple[float, float]) -> tuple[tuple[float, float], float]:
    """Middle of a disc that something unknown hides in part, or that is in one piece with something else.

    Along each axis of the blob's box the middle lies in the interval between the point that is one radius inside the
    box's one end and the point one radius inside the other: a part of a disc is shorter than its diameter, a piece that
    contains the disc is longer. Within the interval it is taken to be as near as can be to where it is expected.

    Parameters
    ----------
    blob : Blob
    whole_px2 : float
        Area of the whole disc.
    expected_px : tuple of float
        Pixel of the crop.

    Returns
    -------
    middle, deviation : tuple of float, float
        Pixels of the crop, and half of the longer of the two intervals.
    """
    radius_px = math.sqrt(whole_px2 / math.pi)
    middle, longest = [], 0.0
    for expected, low, extent in zip(expected_px, blob.box_px[:2], blob.box_px[2:], strict=True):
        first, last = sorted((low - 0.5 + radius_px, low - 0.5 + extent - radius_px))
        middle.append(min(max(expected, first), last))
        longest = max(longest, last - first)
    return (middle[0], middle[1]), longest / 2


def _one_radius_from(low: float, extent: float, side: int, radius: float) -> float:
    """Middle of a whole whose other end than the cut one is where the part's is."""
    return low + radius if side > 0 else low + extent - radius
