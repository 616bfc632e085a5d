"""Colour: white balance, and the image that is made of digital numbers."""

from __future__ import annotations

from functools import cache

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from optics.srgb import srgb_encode
from scenes.sensor.bayer import demosaic
from scenes.sensor.model import ImageSensor
from scenes.sensor.readout import RawImage

Rgb = tuple[float, float, float]

Part = tuple[slice, slice]
WHOLE: Part = (slice(None), slice(None))
"""Rows and columns of an image."""

LOOK_UP_SIZE = 2**16
"""OpenCV looks up 16-bit images in tables of this length."""

CURVE_STEPS = 4096
"""Steps of the tabulated transfer curve; where it is steepest, one is an eighth of a step of the 8-bit image."""


def develop(raw: RawImage, sensor: ImageSensor, part: Part = WHOLE) -> NDArray[np.uint8]:
    """Image of a raw image: black level off, white balance, bilinear colours between the filters, sRGB curve.

    Each channel is multiplied by its white-balance gain and cut at full scale; as no gain is below 1, what saturates
    is white.

    Parameters
    ----------
    raw : RawImage
    sensor : ImageSensor
    part : (slice, slice)
        Rows and columns that are developed, from even ones on; the rest of the image is black. Colours are as in the
        whole image but for the pixels at the part's border.

    Returns
    -------
    array
        uint8, shape (height, width, 3): red, green, blue.
    """
    image = np.zeros((sensor.height_px, sensor.width_px, 3), dtype=np.uint8)
    numbers = np.ascontiguousarray(raw.digital_numbers[part])
    if not numbers.size:
        return image
    if numbers.dtype != np.uint16:
        numbers = np.rint(numbers).astype(np.uint16)
    colours = demosaic(numbers, sensor.spec.bayer)
    tables = np.full((1, LOOK_UP_SIZE, 3), 255, dtype=np.uint8)
    linear = (np.arange(sensor.largest_dn + 1) - sensor.spec.black_level_dn) / full_range(sensor)
    for channel, gain in enumerate(raw.settings.white_gains):
        step = np.clip(linear * gain, 0, 1) * CURVE_STEPS
        tables[0, : linear.size, channel] = _curve()[np.rint(step).astype(np.int64)]
    image[part] = cv2.LUT(colours, tables)
    return image


@cache
def _curve() -> NDArray[np.uint8]:
    return np.round(srgb_encode(np.arange(CURVE_STEPS + 1) / CURVE_STEPS) * 255).astype(np.uint8)


def full_range(sensor: ImageSensor) -> int:
    """Digital numbers from black to full scale."""
    return sensor.largest_dn - sensor.spec.black_level_dn


def balancing_gains(level: ArrayLike, largest_gain: float) -> Rgb:
    """Gains that make a colour grey, at least 1 and at most `largest_gain`.

    Parameters
    ----------
    level : array_like, shape (3,)
        Linear signal of the colour in red, green and blue.
    largest_gain : float
    """
    level = np.asarray(level, dtype=np.float64)
    gains = np.clip(level.max() / np.maximum(level, 1e-9 * max(level.max(), 1e-30)), 1, largest_gain)
    return (float(gains[0]), float(gains[1]), float(gains[2]))


def grey_card_gains(card_radiance: ArrayLike, sensor: ImageSensor) -> Rgb:
    """White-balance gains of a camera set on a grey card of a given radiance, shape (3,), any scale."""
    return balancing_gains(np.asarray(card_radiance) * sensor.electron_rate, sensor.spec.white_balance.largest_gain)
