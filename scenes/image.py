"""Images of frames: what a camera would show of the radiance, and image files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from optics.kernels.backend import mi
from optics.srgb import srgb_encode
from rigs.atomic_files import write_bytes
from scenes.stage.frame import Frame
from scenes.stage.scene import Scene

WHITE_LEVEL = 0.8
"""Fraction of full scale at which the white card that sets exposure and white balance is shown."""

PIXELS_AT_ONCE = 1 << 13
"""Brought into sRGB: what fits a processor's cache takes a tenth of the time."""


def display_image(frame: Frame, scene: Scene) -> NDArray[np.uint8]:
    """Frame as an sRGB image, shape (height, width, 3).

    Exposure and white balance are those of a camera set on a white card held level at the robot's depth, as a diver
    sets them; what is brighter than the card by more than the headroom saturates.
    """
    return display_colours(frame.radiance, scene)


def display_colours(radiance: NDArray[np.float32], scene: Scene) -> NDArray[np.uint8]:
    """SRGB of radiance, shape (..., 3), in front of the lens, as `display_image` has it."""
    card = scene.light.white_radiance(scene.depth_m) / scene.light.n_water**2
    pixels = radiance.reshape(-1, 3)
    shown = np.empty(pixels.shape, dtype=np.uint8)
    for start in range(0, len(pixels), PIXELS_AT_ONCE):
        some = slice(start, start + PIXELS_AT_ONCE)
        linear = np.clip(pixels[some] / card * WHITE_LEVEL, 0, 1)
        shown[some] = np.round(srgb_encode(linear) * 255)
    return shown.reshape(radiance.shape)


def write_image(image: NDArray[np.uint8], path: Path, *, light: str | None = None) -> None:
    """Write an sRGB image, shape (height, width, 3), as PNG; the file appears whole or not at all.

    `light`, draft or full, is said in the file.
    """
    bitmap = mi.Bitmap(np.ascontiguousarray(image))
    if light is not None:
        bitmap.metadata()["light"] = light
    # Through memory: where a file cannot be written Mitsuba raises no OSError.
    stream = mi.MemoryStream()
    bitmap.write(stream, mi.Bitmap.FileFormat.PNG)
    write_bytes(path, stream.raw_buffer())


def check_image_path(path: Path, *suffixes: str) -> None:
    """Raise a sentence when no file with one of the endings can be written there: `ValueError` or an `OSError`."""
    if path.suffix.lower() not in suffixes:
        raise ValueError(f"expected an image file that ends in {' or '.join(suffixes)}, got {path.name!r}")
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{path}: expected an existing folder, but there is no {path.parent}")
    if path.is_dir():
        raise IsADirectoryError(f"{path}: expected a file, found a folder")
