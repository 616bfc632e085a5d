"""Which pixels of an image the loop and its ground truth look at, where nobody else does."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray

SUBPIXEL_BITS = 6

MARGIN_PX = 3
"""Around an outline: one pixel for the crop's bilinear values, one for colours between filters, one for rounding."""


def filled(outlines_px: Sequence[FloatArray], size: tuple[int, ...]) -> NDArray[np.uint8]:
    """Image of a size (width, height), 255 inside convex polygons, shape (k, 2); those not finite are left out."""
    drawn = np.zeros((size[1], size[0]), dtype=np.uint8)
    for outline in outlines_px:
        if np.isfinite(outline).all():
            corners = np.rint(np.clip(outline, -1e5, 1e5) * (1 << SUBPIXEL_BITS)).astype(np.int32)
            cv2.fillConvexPoly(drawn, corners, 255, lineType=cv2.LINE_8, shift=SUBPIXEL_BITS)
    return drawn


def pixels_around(outlines_px: Sequence[FloatArray], size: tuple[int, ...]) -> NDArray[np.bool_]:
    """Pixels that what is inside convex polygons is made of, shape (height, width): with `MARGIN_PX` around it."""
    return with_margin(filled(outlines_px, size) > 0)


def with_margin(pixels: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Pixels, and those that are at most `MARGIN_PX` beside them."""
    reach = np.ones((2 * MARGIN_PX + 1, 2 * MARGIN_PX + 1), dtype=np.uint8)
    return np.asarray(cv2.dilate(pixels.astype(np.uint8), reach) > 0)


def part_around(pixels: NDArray[np.bool_]) -> tuple[slice, slice]:
    """Rows and columns of the smallest rectangle that holds some pixels, from even ones on; empty without pixels."""
    rows, columns = (np.flatnonzero(pixels.any(axis=axis)) for axis in (1, 0))
    return _from_even(rows), _from_even(columns)


def _from_even(numbers: NDArray[np.intp]) -> slice:
    return slice(int(numbers[0]) // 2 * 2, int(numbers[-1]) + 1) if numbers.size else slice(0, 0)
