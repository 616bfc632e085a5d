"""What each part of the loop says about one image: the loop hands these on, the log writes them down."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray

APART = 2.0
"""Times their radii between two blobs of different things: a bar before a ball leaves pieces that nearly touch."""


@dataclass(frozen=True, kw_only=True)
class Blob:
    """One cluster of target-coloured pixels in the crop.

    Attributes
    ----------
    area_px : float
    centroid_px : tuple of float
        (x, y), the centre of the crop's top-left pixel at (0, 0).
    box_px : tuple of int
        x, y, width, height.
    circularity : float
        4 pi area / perimeter^2; 1 for a disc.
    log_odds : float
        Natural logarithm of the odds that it is the target; infinite from a detector that does not weigh, and minus
        infinite of what is recalled and has less than even odds otherwise, or none.
    ellipse_share : float
        Its area over that of the ellipse that has its second moments: 1 for a ball seen from anywhere, less for any
        other outline.
    silhouette : bool
        Whether it is told by its darkness alone, where a target is expected.
    recalled : bool
        Whether it is told by the colours that the followed target had in the images before.
    """

    area_px: float
    centroid_px: tuple[float, float]
    box_px: tuple[int, int, int, int]
    circularity: float
    log_odds: float = math.inf
    ellipse_share: float = 1.0
    silhouette: bool = False
    recalled: bool = False

    def is_near(self, point_px: tuple[float, float]) -> bool:
        """Whether a point of the crop is no farther from its middle than its disc is wide."""
        return math.dist(self.centroid_px, point_px) < 2 * math.sqrt(self.area_px / math.pi)

    def is_apart(self, other: Blob) -> bool:
        """Whether two discs of their areas are so far apart that they are no pieces of one thing."""
        radii = math.sqrt(self.area_px / math.pi) + math.sqrt(other.area_px / math.pi)
        return math.dist(self.centroid_px, other.centroid_px) > APART * radii


@dataclass(frozen=True, kw_only=True)
class Detection:
    """What the detector found in one crop.

    Attributes
    ----------
    mask : array, shape (height, width)
        uint8, 255 where a pixel has the target's colour, after opening and closing.
    blobs : tuple of Blob
        Clusters that passed the filters, the largest first.
    centroid_px : tuple of float, optional
        Mean of the blobs' centroids weighted by their areas (eq. 7); None without blobs.
    """

    mask: NDArray[np.uint8]
    blobs: tuple[Blob, ...]
    centroid_px: tuple[float, float] | None


class Mode(StrEnum):
    """States of figure 12."""

    CHECK = "check"
    """Functional check: the joints are driven over their range."""
    SCAN = "scan"
    TRACK = "track"
    PREDICT = "predict"


@dataclass(frozen=True, kw_only=True)
class Step:
    """What the loop made of one image.

    Attributes
    ----------
    time_s : float
        Of the image.
    mode : Mode
        In which the command was decided.
    q_estimated : array, shape (2,)
        Joint values the image was read with, radians.
    q_command : array, shape (2,)
        Pan and tilt asked for, radians.
    corners_px : array, shape (4, 2)
        Of the gaze mirror in the image, in the crop's order; nan where it is not seen.
    crop : array, shape (crop height, crop width, 3)
        uint8, sRGB.
    detection : Detection
    predicted_px : tuple of float, optional
        Where the filter expects the target in the crop; None before the first detection.
    error_px : tuple of float, optional
        Of the detected or, without a detection, the predicted target from the crop's centre (eqs. 11, 12).
    target_direction : array, shape (3,), optional
        Unit vector to the target in the body frame as the loop estimates it, None when it does not know or does not use
        directions (the paper's own loop).
    beyond_reach : bool
        Whether the loop takes the target to be where no gaze within the joint limits shows it: the mirror waits at the
        limit next to it.
    """

    time_s: float
    mode: Mode
    q_estimated: FloatArray
    q_command: FloatArray
    corners_px: FloatArray
    crop: NDArray[np.uint8]
    detection: Detection
    predicted_px: tuple[float, float] | None
    error_px: tuple[float, float] | None
    target_direction: FloatArray | None
    beyond_reach: bool
