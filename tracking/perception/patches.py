"""Cells of a crop that belong to one thing, and what a blob says of them."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from cv2.typing import MatLike

from tracking.perception.clusters import circularity
from tracking.perception.contrast_pyramid import FINEST_PX, Mask, Place
from tracking.perception.outline import ellipse_share
from tracking.records import Blob


@dataclass(frozen=True, kw_only=True)
class Patch:
    """Something cut out of its surroundings.

    Attributes
    ----------
    blob : Blob
    cells : array, shape (rows, columns)
        uint8: 1 in its cells, of a part of a level of `ContrastPyramid`.
    level : int
    first : tuple of int
        Column and row at which that part begins.
    """

    blob: Blob
    cells: Mask
    level: int
    first: tuple[int, int]

    def covers(self, place: Place) -> bool:
        """Whether a place lies within it."""
        scale = 2.0 ** (place.level - self.level)
        x, y = (int((at + 0.5) * scale) - first for at, first in zip((place.x, place.y), self.first, strict=True))
        rows, columns = self.cells.shape
        return 0 <= x < columns and 0 <= y < rows and bool(self.cells[y, x])

    def shows(self, point_px: tuple[float, float]) -> bool:
        """Whether a point of the crop lies within it."""
        cell_px = FINEST_PX << self.level
        x, y = (int((at + 0.5) / cell_px) - first for at, first in zip(point_px, self.first, strict=True))
        rows, columns = self.cells.shape
        return 0 <= x < columns and 0 <= y < rows and bool(self.cells[y, x])

    def mark(self, mask: Mask) -> None:
        """Set its pixels in a mask of the crop to 255."""
        cell_px = FINEST_PX << self.level
        (x, y), (rows, columns) = (first * cell_px for first in self.first), self.cells.shape
        part = mask[y : y + rows * cell_px, x : x + columns * cell_px]
        np.maximum(part, cv2.resize(255 * self.cells, part.shape[::-1], interpolation=cv2.INTER_NEAREST), out=part)


def filled(cells: Mask) -> MatLike:
    """Add to cells of one thing, uint8 of 1 and 0, shape (rows, columns), those that they enclose; their contour."""
    contours, _ = cv2.findContours(cells, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(cells, contours, -1, 1, cv2.FILLED)
    return contours[0]


def blob_of(cells: Mask, contour: MatLike, level: int, first: tuple[int, int], log_odds: float) -> Blob:
    """Blob of the cells of one thing, as `Patch` has them, which `filled` has filled; `log_odds` are its."""
    cell_px = FINEST_PX << level
    (x0, y0), box = first, cv2.boundingRect(cells)
    moments = cv2.moments(cells, binaryImage=True)
    u, v = (moments[name] / moments["m00"] + first for name, first in (("m10", x0), ("m01", y0)))
    return Blob(
        area_px=moments["m00"] * cell_px**2,
        centroid_px=((u + 0.5) * cell_px - 0.5, (v + 0.5) * cell_px - 0.5),
        box_px=((box[0] + x0) * cell_px, (box[1] + y0) * cell_px, box[2] * cell_px, box[3] * cell_px),
        circularity=circularity(contour),
        log_odds=log_odds,
        ellipse_share=ellipse_share(moments),
    )
