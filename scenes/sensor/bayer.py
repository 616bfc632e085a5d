"""The colour filter array: from a colour image to one number per pixel, and back."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from rigs.image_sensor import BayerPattern

FloatImage = NDArray[np.float32]

SITES = ((0, 0), (0, 1), (1, 0), (1, 1))
"""Rows and columns of a 2 x 2 cell, in the order of a pattern's letters."""

DEMOSAIC = {
    "rggb": cv2.COLOR_BayerRGGB2RGB,
    "bggr": cv2.COLOR_BayerBGGR2RGB,
    "grbg": cv2.COLOR_BayerGRBG2RGB,
    "gbrg": cv2.COLOR_BayerGBRG2RGB,
}


def site_channels(pattern: BayerPattern) -> list[tuple[int, int, int]]:
    """Row and column in the cell and channel (0 red, 1 green, 2 blue) of the four sites of a pattern."""
    return [(row, column, "rgb".index(letter)) for (row, column), letter in zip(SITES, pattern, strict=True)]


def mosaic(image: FloatImage, pattern: BayerPattern) -> FloatImage:
    """What lies behind each pixel's filter: shape (height, width) of an image (height, width, 3), or that image."""
    if pattern == "none":
        return image
    plane = np.empty(image.shape[:2], dtype=image.dtype)
    for row, column, channel in site_channels(pattern):
        plane[row::2, column::2] = image[row::2, column::2, channel]
    return plane


def demosaic(plane: NDArray[np.uint16], pattern: BayerPattern) -> NDArray[Any]:
    """Colours between the filters, bilinear (OpenCV): shape (height, width, 3); an image without filters as it is."""
    return plane if pattern == "none" else np.asarray(cv2.cvtColor(plane, DEMOSAIC[pattern]))
