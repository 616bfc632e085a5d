"""Clusters of the target's colour: their contours, the filters they must pass, and their common centroid (eq. 7)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np
from cv2.typing import MatLike
from numpy.typing import NDArray

from tracking.perception.colour import RED_BALL, DetectorSettings, Mask, colour_mask
from tracking.records import Blob, Detection

CHAIN_TO_CURVE = math.pi / 8 * (1 + math.sqrt(2))
"""Length of a curve over that of the chain of pixels that follows it, 0.948 in the mean over all directions.

Kulpa 1977, Computer Graphics and Image Processing 6, 434-451.
"""


def detect(crop: NDArray[np.uint8], settings: DetectorSettings = RED_BALL, ignored: Mask | None = None) -> Detection:
    """Find the target in a crop (uint8 sRGB, shape (height, width, 3)); a black crop holds nothing.

    Parameters
    ----------
    crop : array
    settings : DetectorSettings
    ignored : array, shape (height, width), optional
        uint8: pixels that are 255 are not the target, whatever their colour, such as those of `RobotView.mask`.

    Raises
    ------
    ValueError
        For anything but an image.
    """
    mask = colour_mask(crop, settings)
    if ignored is not None:
        mask = np.asarray(cv2.bitwise_and(mask, cv2.bitwise_not(ignored)), dtype=np.uint8)
    blobs = find_blobs(mask, settings)
    return Detection(mask=mask, blobs=blobs, centroid_px=weighted_centroid(blobs))


def taken(detection: Detection, blobs: tuple[Blob, ...]) -> Detection:
    """The part of a detection that is some of its blobs."""
    if blobs == detection.blobs:
        return detection
    mask = np.zeros_like(detection.mask)
    for x, y, width, height in (blob.box_px for blob in blobs):
        box = slice(y, y + height), slice(x, x + width)
        mask[box] = detection.mask[box]
    return Detection(mask=mask, blobs=blobs, centroid_px=weighted_centroid(blobs))


def weighted_centroid(blobs: Sequence[Blob]) -> tuple[float, float] | None:
    """Eq. 7: mean of the blobs' centroids weighted by their areas; None without blobs."""
    total = sum(blob.area_px for blob in blobs)
    if not total > 0:
        return None
    x, y = (sum(blob.area_px * blob.centroid_px[axis] for blob in blobs) / total for axis in (0, 1))
    return x, y


def find_blobs(mask: Mask, settings: DetectorSettings = RED_BALL) -> tuple[Blob, ...]:
    """Clusters of a mask (uint8, shape (height, width)) that pass the filters of the settings, the largest first.

    A cluster is what one outer contour encloses, over edges and corners of pixels. Its area and centroid are those of
    its pixels, without holes; its circularity is that of the contour.
    """
    contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    blobs = []
    for contour in contours:
        x, y, width, height = cv2.boundingRect(contour)
        # Its box is the most that it can fill, and costs next to nothing to find.
        if width * height < settings.area_min_px:
            continue
        if max(width, height) > settings.aspect_max * min(width, height):
            continue
        roundness = circularity(contour)
        if roundness < settings.circularity_min:
            continue
        box = (x, y, width, height)
        area, centroid = _area_and_centroid(mask, contour, box)
        if area >= settings.area_min_px:
            blobs.append(Blob(area_px=area, centroid_px=centroid, box_px=box, circularity=roundness))
    return tuple(sorted(blobs, key=lambda blob: (-blob.area_px, blob.box_px)))


def circularity(contour: MatLike) -> float:
    """4 pi area / perimeter^2 of an outer contour as OpenCV finds it, shape (n, 1, 2); 1 for a disc.

    It runs through the middles of the outermost pixels, so it is grown by half a pixel to go around them (Steiner: the
    area by half the perimeter and pi / 4, the perimeter by pi); small clusters would else be lines and points.
    """
    perimeter = CHAIN_TO_CURVE * cv2.arcLength(contour, closed=True)
    area = cv2.contourArea(contour) + perimeter / 2 + math.pi / 4
    return float(4 * math.pi * area / (perimeter + math.pi) ** 2)


def _area_and_centroid(
    mask: Mask, contour: MatLike, box: tuple[int, int, int, int]
) -> tuple[float, tuple[float, float]]:
    """Number and mean place of the mask's pixels within a contour."""
    x, y, width, height = box
    within = np.zeros((height, width), dtype=np.uint8)
    cv2.drawContours(within, [contour], 0, 1, cv2.FILLED, offset=(-x, -y))
    cv2.bitwise_and(within, mask[y : y + height, x : x + width], dst=within)
    moments = cv2.moments(within, binaryImage=True)
    area = moments["m00"]
    return area, (x + moments["m10"] / area, y + moments["m01"] / area)
