"""The direct view: what the camera sees past both mirrors, in the same image, whatever the joints do.

It is small (0.05 to 0.4 sr for the presets) and cannot be turned, but it is there all the time: a target in it tells a
search where to look. Which parts of the image it takes, and where they look, is computed from the meshes beforehand
(`dives.views.direct_view`) and handed to the loop as arrays.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray

FINEST_PX = 640
"""Columns of the image from which on pixels are averaged before it is looked at: a target that is worth turning to is
tens of them wide."""


@dataclass(frozen=True, kw_only=True)
class DirectView:
    """Cells of the image that show the water past both mirrors at all joint values.

    Attributes
    ----------
    water : array, shape (rows, columns)
        Which cells do; at least one.
    direction : array, shape (rows, columns, 3)
        Unit vectors, body frame: from the centre of the gaze mirror to what a cell shows at an assumed distance.
    """

    water: NDArray[np.bool_]
    direction: NDArray[np.float32]

    def pixels(self, width_px: int, height_px: int) -> NDArray[np.bool_]:
        """Which pixels of an image belong to it, shape (height_px, width_px)."""
        size = (width_px, height_px)
        return np.asarray(cv2.resize(self.water.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST)) > 0

    def direction_at(self, place: FloatArray) -> FloatArray:
        """Direction of a place of the image, shape (2,), from 0 to 1 across and down; unit vector, shape (3,)."""
        rows, columns = self.water.shape
        column, row = (np.clip(place, 0, 1 - 1e-9) * [columns, rows]).astype(int)
        return np.asarray(self.direction[row, column], dtype=np.float64)

    def taken_from(self, image: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Image as it is looked at, shape (h, w, 3), and 255 in what is not the direct view, shape (h, w); uint8."""
        height, width = image.shape[:2]
        coarser = max(round(width / FINEST_PX), 1)
        size = width // coarser, height // coarser
        looked_at = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
        return looked_at, np.where(self.pixels(*size), 0, 255).astype(np.uint8)
