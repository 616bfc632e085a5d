"""One frame of a camera: exposure, image, and the settings of the next frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.sensor.automatic import next_settings
from scenes.sensor.colour import develop
from scenes.sensor.model import ImageSensor
from scenes.sensor.readout import CameraSettings, FloatImage, RawImage, expose


@dataclass(frozen=True, kw_only=True)
class Capture:
    """An image (uint8 sRGB, shape (height, width, 3)), the raw image behind it, and the settings for the next."""

    image: NDArray[np.uint8]
    raw: RawImage
    next_settings: CameraSettings


def capture(
    radiance: FloatImage,
    sensor: ImageSensor,
    settings: CameraSettings,
    key: int | None = None,
    *,
    weight: FloatImage | None = None,
) -> Capture:
    """Take one frame: `expose`, `develop` and `next_settings` in a row; arguments as there."""
    raw = expose(radiance, sensor, settings, key)
    return Capture(image=develop(raw, sensor), raw=raw, next_settings=next_settings(raw, sensor, weight))
