"""Seeing: the gaze mirror's corners in the image, the crop between them, and the target's colour in the crop.

Section 3 of Cortes-Perez & Torres-Mendez 2021, one module a step.
"""

from tracking.perception.clusters import detect, find_blobs, taken, weighted_centroid
from tracking.perception.colour import (
    DETECTORS,
    NARROW_HUE,
    RED_BALL,
    RED_IN_WATER,
    WIDE_HUE,
    ColourWindow,
    DetectorSettings,
    colour_mask,
)
from tracking.perception.contrast import ACQUIRED_LOG_ODDS, detect_by_contrast
from tracking.perception.corners.errors import corner_error, exact_samples, pose_grid
from tracking.perception.corners.exact import ExactCorners
from tracking.perception.corners.inverse_distance import CornerModel, InverseDistanceCorners
from tracking.perception.corners.samples import CornerSamples
from tracking.perception.crop import Crop
from tracking.perception.detectors import detector_of
from tracking.perception.learned import LearnedModel, detect_by_model

__all__ = [
    "ACQUIRED_LOG_ODDS",
    "DETECTORS",
    "NARROW_HUE",
    "RED_BALL",
    "RED_IN_WATER",
    "WIDE_HUE",
    "ColourWindow",
    "CornerModel",
    "CornerSamples",
    "Crop",
    "DetectorSettings",
    "ExactCorners",
    "InverseDistanceCorners",
    "LearnedModel",
    "colour_mask",
    "corner_error",
    "detect",
    "detect_by_contrast",
    "detect_by_model",
    "detector_of",
    "exact_samples",
    "find_blobs",
    "pose_grid",
    "taken",
    "weighted_centroid",
]
