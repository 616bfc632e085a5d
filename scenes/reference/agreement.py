"""How far one renderer is from the other: bias by region and by what is seen, with its statistical error."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.status import Region
from scenes.reference.render import ReferenceFrame
from scenes.stage.frame import Frame, Label

WHOLE = "whole image"
TARGET_ERROR = 0.03
"""Relative error of a pixel at which the two renderers' times are compared: what the fast one may be off."""


@dataclass(frozen=True, kw_only=True)
class Agreement:
    """Mean radiance of a set of pixels in both frames; a value for each of the three channels.

    Attributes
    ----------
    name : str
        Which pixels: the whole image, a region, or what is seen there.
    pixels : int
    fast, reference : tuple
        Mean radiance, W / (m^2 sr nm).
    bias, standard_error : tuple
        fast / reference - 1, and how far it may be off by the reference's noise.
    z : tuple
        Bias in units of its standard error.
    """

    name: str
    pixels: int
    fast: tuple[float, ...]
    reference: tuple[float, ...]
    bias: tuple[float, ...]
    standard_error: tuple[float, ...]
    z: tuple[float, ...]

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        return asdict(self)


def agreements(frame: Frame, reference: ReferenceFrame) -> list[Agreement]:
    """Whole image, then every region, then every label that there is; a pixel is where its first sample is.

    Pixels that see the housing are black in both frames and left out.
    """
    seen = frame.region != Region.HOUSING
    masks = {WHOLE: seen}
    masks |= {region.name.lower(): seen & (frame.region == region) for region in Region}
    masks |= {label.name.lower().replace("_", " "): seen & (frame.label == label) for label in Label}
    return [_agreement(name, mask, frame, reference) for name, mask in masks.items() if mask.any()]


def _agreement(name: str, mask: NDArray[np.bool_], frame: Frame, reference: ReferenceFrame) -> Agreement:
    fast = frame.radiance[mask].astype(np.float64).mean(axis=0)
    true = reference.radiance[mask].mean(axis=0)
    error = np.sqrt((reference.standard_error[mask] ** 2).sum(axis=0)) / mask.sum()
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = fast / true
        columns = {"bias": ratio - 1, "standard_error": ratio * error / true, "z": (fast - true) / error}
    return Agreement(
        name=name,
        pixels=int(mask.sum()),
        fast=tuple(map(float, fast)),
        reference=tuple(map(float, true)),
        **{key: tuple(map(float, values)) for key, values in columns.items()},
    )


def pixel_error(frame: Frame, reference: ReferenceFrame) -> float:
    """Median over pixels and channels of the reference's standard error, relative to the (noiseless) fast frame.

    The median, not the mean square: a few pixels with a rare bright path would make the reference look worse than the
    image does.
    """
    lit = frame.radiance > 0
    if not lit.any():
        raise ValueError("expected a frame that sees some light, got a black one")
    return float(np.median(reference.standard_error[lit] / frame.radiance[lit]))


def time_to_target_error_s(time_s: float, relative_error: float) -> float:
    """Time that a renderer whose error falls with the root of its time needs to reach `TARGET_ERROR`."""
    return time_s * (relative_error / TARGET_ERROR) ** 2
