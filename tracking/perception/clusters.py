"""Clusters of the target's colour: their contours, the filters they must pass, and their common centroid (eq. 7)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from tracking.perception.colour import RED_BALL, DetectorSettings, Mask, colour_mask
from tracking.records import Detection, Spot

NEIGHBOURS = 8


def detect(crop: NDArray[np.uint8], settings: DetectorSettings = RED_BALL) -> Detection:
    """Find the target in a crop (uint8 sRGB, shape (height, width, 3)); a black crop holds nothing.

    Raises
    ------
    ValueError
        For anything but a picture.
    """
    mask = colour_mask(crop, settings)
    spots = find_spots(mask, settings)
    return Detection(mask=mask, spots=spots, centroid_px=weighted_centroid(spots))


def weighted_centroid(spots: Sequence[Spot]) -> tuple[float, float] | None:
    """Eq. 7: mean of the spots' centroids weighted by their areas; None without spots."""
    total = sum(spot.area_px for spot in spots)
    if not total > 0:
        return None
    x, y = (sum(spot.area_px * spot.centroid_px[axis] for spot in spots) / total for axis in (0, 1))
    return x, y


def find_spots(mask: Mask, settings: DetectorSettings = RED_BALL) -> tuple[Spot, ...]:
    """Clusters of a mask (uint8, shape (height, width)) that pass the filters of the settings, the largest first.

    A cluster is what holds together over edges and corners of pixels. Its area and centroid are those of its pixels,
    its circularity that of its outer contour.
    """
    count, labels, boxes, centroids = cv2.connectedComponentsWithStats(mask, connectivity=NEIGHBOURS)
    if count == 1:
        return ()
    area = boxes[1:, cv2.CC_STAT_AREA]
    sides = boxes[1:, [cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT]]
    passing = (area >= settings.area_min_px) & (sides.max(axis=1) <= settings.aspect_max * sides.min(axis=1))
    found = []
    for label in (np.flatnonzero(passing) + 1).tolist():
        x, y, width, height, size = boxes[label].tolist()
        roundness = circularity((labels[y : y + height, x : x + width] == label).astype(np.uint8))
        if roundness >= settings.circularity_min:
            centre = centroids[label].tolist()
            found.append(
                Spot(
                    area_px=float(size),
                    centroid_px=(centre[0], centre[1]),
                    box_px=(x, y, width, height),
                    circularity=roundness,
                )
            )
    return tuple(sorted(found, key=lambda spot: (-spot.area_px, spot.box_px)))


def circularity(cluster: Mask) -> float:
    """4 pi area / perimeter^2 of the outer contour of one cluster, a mask that it touches all four sides of.

    OpenCV's contour runs through the middles of the outermost pixels. It is grown by half a pixel to go around them
    (Steiner: the area by half the perimeter and pi / 4, the perimeter by pi), which matters for small clusters.
    """
    contours, _ = cv2.findContours(cluster, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    contour = contours[0]
    perimeter = cv2.arcLength(contour, closed=True)
    area = cv2.contourArea(contour) + perimeter / 2 + math.pi / 4
    return float(4 * math.pi * area / (perimeter + math.pi) ** 2)
