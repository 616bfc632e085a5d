"""Pictures of frames: what a camera would show of the radiance, and files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from optics.backend import mi
from scenes.frame import Frame
from scenes.stage import Stage

WHITE_LEVEL = 0.8
"""Fraction of full scale at which the white card that sets exposure and white balance is shown."""

LAYERS = ("R", "G", "B", "distance.Z", "label.Y", "region.Y", "target.Y")


def display_image(frame: Frame, stage: Stage) -> NDArray[np.uint8]:
    """Frame as an sRGB picture, shape (height, width, 3).

    Exposure and white balance are those of a camera set on a white card held level at the robot's depth, as a diver
    sets them; what is brighter than the card by more than the headroom saturates.
    """
    card = stage.light.white_radiance(stage.depth_m) / stage.light.n_water**2
    linear = np.clip(frame.radiance / card * WHITE_LEVEL, 0, 1)
    # IEC 61966-2-1.
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.round(encoded * 255).astype(np.uint8)


def write_image(frame: Frame, stage: Stage, path: Path) -> None:
    """Write a frame as PNG (a picture) or EXR (radiance and ground truth, single precision, one layer each).

    EXR layers: R, G, B in W / (m^2 sr nm); distance.Z in metres; label.Y, region.Y (numbers of `Label`, `Region`);
    target.Y, the fraction of the pixel that shows the target. The file appears whole or not at all.

    Raises
    ------
    ValueError
        For another file extension.
    """
    check_image_path(path)
    suffix = path.suffix.lower()
    if suffix == ".png":
        bitmap = mi.Bitmap(display_image(frame, stage))
    else:
        bitmap = mi.Bitmap(_layers(frame), channel_names=list(LAYERS))
    partial = path.with_name(f".{path.stem}.partial{suffix}")
    bitmap.write(str(partial))
    partial.replace(path)


def check_image_path(path: Path) -> None:
    """Raise a sentence when an image cannot be written there: `ValueError` or `FileNotFoundError`."""
    if path.suffix.lower() not in (".png", ".exr"):
        raise ValueError(f"expected an image file that ends in .png or .exr, got {path.name!r}")
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{path}: expected an existing folder, but there is no {path.parent}")


def _layers(frame: Frame) -> NDArray[np.float32]:
    flat = (frame.distance_m, frame.label, frame.region, frame.target_fraction)
    return np.concatenate([frame.radiance, np.stack(flat, axis=-1)], axis=-1).astype(np.float32)
