"""A checkerboard's corners in an image, looked for where the gaze mirror is."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from optics.kernels.arrays import FloatArray
from tracking.perception.crop import check_image

ENLARGED = 3
"""The finder's own templates are some pixels wide: on three times larger an image its error falls by half."""

FLAGS = cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY | cv2.CALIB_CB_NORMALIZE_IMAGE


def board_corners(image: NDArray[np.uint8], outline_px: ArrayLike, *, columns: int, rows: int) -> FloatArray | None:
    """Find the inner corners of a checkerboard within an outline (Duda & Frese 2018, OpenCV's SB finder).

    Parameters
    ----------
    image : array, shape (height, width, 3)
        uint8, sRGB.
    outline_px : array, shape (4, 2)
        Of the gaze mirror in the image; only its surrounding rectangle is looked at.
    columns, rows : int
        Squares of the board, one even and one odd (`scenes.worlds.checkerboard.Checkerboard`).

    Returns
    -------
    array, shape ((rows - 1) * (columns - 1), 2), or None
        Pixels, row by row from the white end; None where the whole board is not found.

    Notes
    -----
    A board that the outline cuts may be taken for a whole one, one square further on: look only where all of it is
    expected, with a square to spare.
    """
    check_image("image", image)
    outline = np.asarray(outline_px, dtype=np.float64)
    if outline.shape != (4, 2) or not np.isfinite(outline).all():
        raise ValueError(f"expected an outline of four finite corners, got {outline.tolist()}")
    size = np.array(image.shape[1::-1])
    left, top = np.clip(np.floor(outline.min(axis=0)).astype(int), 0, size)
    right, bottom = np.clip(np.ceil(outline.max(axis=0)).astype(int) + 1, 0, size)
    if right <= left or bottom <= top:
        return None
    part = cv2.cvtColor(image[top:bottom, left:right], cv2.COLOR_RGB2GRAY)
    larger = cv2.resize(part, None, fx=ENLARGED, fy=ENLARGED, interpolation=cv2.INTER_CUBIC)
    found, corners = cv2.findChessboardCornersSB(larger, (columns - 1, rows - 1), flags=FLAGS)
    if not found:
        return None
    # The centre of the first pixel is at zero in both images.
    return np.asarray((corners.reshape(-1, 2) + 0.5) / ENLARGED - 0.5 + [left, top], dtype=np.float64)
