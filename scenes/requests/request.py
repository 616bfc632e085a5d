"""What can be asked of a view, where it goes, and what is reported of it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from scenes.image import check_image_path

Light = Literal["full", "draft"]

FEWEST_REFERENCE_SAMPLES = 2
"""Paths of a pixel from whose spread the error is found."""

MOST_FAST_SAMPLES = 1024
"""All of a frame's samples are in memory at once."""


@dataclass(frozen=True, kw_only=True)
class RenderRequest:
    """One pose, and how it is rendered.

    Attributes
    ----------
    q1_deg, q2_deg : float
    time_s : float
        Clock of waves, flicker and snow.
    stowed : bool
        With the fold mirror swung out of the view.
    width_px, height_px : int, optional
        The camera's own by default.
    samples : int
        Per pixel; paths, of the reference.
    renderer : {"fast", "reference"}
    seed : int
        Of the reference's paths and of the sensor's noise.
    blur : bool
        With the blur of light scattered by less than a degree (`scenes.forward_scatter`).
    light : {"full", "draft"}
        How finely the light between surfaces is found, where it is not kept in full; the reference finds its own.
    """

    q1_deg: float = 0.0
    q2_deg: float = 0.0
    time_s: float = 0.0
    stowed: bool = False
    width_px: int | None = None
    height_px: int | None = None
    samples: int = 1
    renderer: Literal["fast", "reference"] = "fast"
    seed: int = 0
    blur: bool = False
    light: Light = "full"

    def __post_init__(self) -> None:
        problems = []
        if not np.isfinite(self.time_s):
            problems.append(f"expected a time in seconds, got {self.time_s}")
        if self.renderer == "fast" and not 1 <= self.samples <= MOST_FAST_SAMPLES:
            problems.append(f"expected 1 to {MOST_FAST_SAMPLES} samples per pixel, got {self.samples}")
        if self.renderer == "reference":
            if self.samples < FEWEST_REFERENCE_SAMPLES:
                problems.append(f"expected at least 2 samples per pixel for the reference, got {self.samples}")
            if self.stowed:
                problems.append("expected a fold mirror in use: the reference renderer knows no stowed one")
            if self.blur:
                problems.append("expected no blur: the reference renderer scatters light itself")
            if self.time_s:
                problems.append(f"expected no time: nothing moves for the reference renderer, got {self.time_s:g} s")
        if problems:
            raise ValueError("; ".join(problems))


@dataclass(frozen=True, kw_only=True)
class Output:
    """Where a view goes, and as what.

    Attributes
    ----------
    path : Path
        PNG: an image. EXR: radiance and all that is known about each pixel (`scenes.truth.layers`).
    sensor : bool
        The image is what the rig's image sensor takes of it, not what a diver's white card would show.
    truth : Path, optional
        Folder for layers, masks and boxes.
    """

    path: Path
    sensor: bool = False
    truth: Path | None = None

    def __post_init__(self) -> None:
        check_image_path(self.path, ".png", ".exr")
        if self.sensor and self.layered:
            raise ValueError(f"expected an image (.png) of what the sensor takes, got {self.path.name!r}")
        if self.truth is not None and self.truth.exists() and not self.truth.is_dir():
            raise NotADirectoryError(f"{self.truth}: expected a folder, found a file")

    @property
    def layered(self) -> bool:
        """Whether the file holds layers, not an image."""
        return self.path.suffix.lower() == ".exr"

    @property
    def has_truth(self) -> bool:
        """Whether ground truth is in any of the files."""
        return self.layered or self.truth is not None


@dataclass(frozen=True, kw_only=True)
class RenderResult:
    """Facts of a rendered pose.

    Attributes
    ----------
    file : str
    q1_deg, q2_deg : float
    width_px, height_px : int
    region_px : dict
        Pixels of each region (housing, direct, fold, gaze).
    gaze_deg : dict, optional
        Azimuth, elevation and image roll of the virtual camera; None for a rig without mirrors.
    target_px : tuple, optional
        Centroid of the visible target; None when it is not seen.
    sun_deg : dict
        Elevation and azimuth of the sun (from the world's east towards north).
    exposure : dict, optional
        Time and gain of the image sensor; None when it was not asked for.
    truth_files : int
        Written beside the view.
    notes : tuple of str
        What of the scene was left out.
    light : {"full", "draft"}
    time_s : float
        Of the frame itself.
    """

    file: str
    q1_deg: float
    q2_deg: float
    width_px: int
    height_px: int
    region_px: dict[str, int]
    gaze_deg: dict[str, float] | None
    target_px: tuple[float, float] | None
    sun_deg: dict[str, float]
    exposure: dict[str, float] | None
    truth_files: int
    notes: tuple[str, ...]
    light: Light
    time_s: float

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        return asdict(self)
