"""The mosaic and back: patterns, colours, places."""

from __future__ import annotations

import numpy as np
import pytest

from scenes.sensor.bayer import demosaic, mosaic

PATTERNS = ["rggb", "bggr", "grbg", "gbrg"]


def test_each_pixel_sees_its_filters_colour():
    """RGGB by hand: red at even rows and columns, blue at odd ones, green elsewhere."""
    image = np.broadcast_to(np.float32([1, 2, 3]), (4, 6, 3))
    assert mosaic(image, "rggb").tolist() == [[1, 2, 1, 2, 1, 2], [2, 3, 2, 3, 2, 3]] * 2
    assert mosaic(image, "grbg").tolist() == [[2, 1, 2, 1, 2, 1], [3, 2, 3, 2, 3, 2]] * 2


@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("shape", [(8, 10), (7, 9)])
def test_one_colour_comes_back_whole(pattern, shape):
    """Interpolation between equal values is exact."""
    image = np.broadcast_to(np.array([100, 2000, 40000], dtype=np.uint16), (*shape, 3))
    assert (demosaic(mosaic(image, pattern), pattern) == image).all()


@pytest.mark.parametrize("pattern", PATTERNS)
def test_a_slope_comes_back_in_place(pattern):
    """Bilinear interpolation holds a plane exactly, away from the rim: no shift of half a pixel."""
    v, u = np.indices((20, 24))
    image = np.stack([40 * u + 8 * v, 8 * u + 40 * v + 100, 1500 - 20 * u - 20 * v], axis=-1).astype(np.uint16)
    back = demosaic(mosaic(image, pattern), pattern).astype(np.int64)
    assert (back[2:-2, 2:-2] == image[2:-2, 2:-2]).all()


def test_without_filters_the_image_stays():
    image = np.arange(24, dtype=np.uint16).reshape(2, 4, 3)
    assert mosaic(image, "none") is image
    assert demosaic(image, "none") is image
