"""Which detector a loop looks with: a learned model, the contrast with what is around, or a window of colours."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tracking.perception.clusters import detect
from tracking.perception.colour import RED_IN_WATER, DetectorSettings, Mask
from tracking.perception.contrast import detect_by_contrast
from tracking.perception.learned import LearnedModel, detect_by_model
from tracking.perception.target_colours import TARGET_COLOURS
from tracking.records import Detection

Detector = Callable[[NDArray[np.uint8], Mask | None, tuple[float, float] | None], Detection]
"""Finds what may be the target in a crop: gets the crop, the pixels of the robot itself, and where in the crop a target
is expected."""


def detector_of(settings: DetectorSettings, *, contrast: bool) -> Detector:
    """The detector of settings: their learned model's if they name one; else by their window of colours.

    With `contrast` the contrast takes the window's place as long as the window is the usual one, `RED_IN_WATER`.

    Raises
    ------
    ValueError, FileNotFoundError
        For a model that cannot be used (`LearnedModel`).
    """
    if settings.onnx is not None:
        model = LearnedModel(settings.onnx)
        return lambda crop, ignored, _: detect_by_model(crop, model, settings, ignored)
    if weighs_contrast(settings, contrast=contrast):
        colour = TARGET_COLOURS[settings.colour]
        return lambda crop, ignored, expected: detect_by_contrast(
            crop, settings.area_min_px, ignored, expected, colour=colour, over_water=settings.over_water
        )
    return lambda crop, ignored, _: detect(crop, settings, ignored)


def plainness(settings: DetectorSettings, *, contrast: bool) -> float:
    """How plainly a target that is found by its contrast looks like one, from 0 to 1 where water leaves it its colour.

    What never looks so is another thing.
    """
    if not weighs_contrast(settings, contrast=contrast):
        return 0.0
    return min(max(settings.over_water / TARGET_COLOURS[settings.colour].plain_from, 0.0), 1.0)


def keeps_colour(settings: DetectorSettings, *, contrast: bool) -> bool:
    """Whether the water leaves a target, found by its contrast, so much of its colour that it shines by it."""
    known = math.isfinite(TARGET_COLOURS[settings.colour].plain_from)
    return weighs_contrast(settings, contrast=contrast) and known and settings.over_water >= 0


def weighs_contrast(settings: DetectorSettings, *, contrast: bool) -> bool:
    """Whether a loop that finds its target by its contrast, or not, does so with these settings."""
    return contrast and settings.onnx is None and settings.window == RED_IN_WATER
