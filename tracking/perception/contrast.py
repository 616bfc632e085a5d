"""The target by its contrast: what stands out by its colour is cut from its surroundings and judged by odds.

What is said here of red is true of each colour along which a target may stand out (`target_colours`).
`contrast_pyramid` tells where something redder than its surroundings is. There a finer image is cut at a redness above
the surroundings', and the piece is compared with what is around it in numbers that no camera setting changes: how far
it stands out, how clearly, how red, green and light it is beside them, and how long. A seventh number is known
beforehand: how much red the water leaves the target. A near ball is much redder than the water and a far one hardly,
but then it is dark; a black thing is dark and hardly redder at any distance, and so is the ball where little red is
left; a brown or yellow thing is greener the redder it is. So the logarithm of the odds to be the target is quadratic
in these numbers, as between two normal distributions of different covariance (Hastie, Tibshirani & Friedman 2009, The
Elements of Statistical Learning, section 4.3). The weights are those of a logistic regression (Cox 1958, J. R. Stat.
Soc. B 20, 215-242) on images with ground truth (`./run bench detector --fit`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray
from tracking.perception.clusters import weighted_centroid
from tracking.perception.colour import OVER_WATER
from tracking.perception.contrast_pyramid import (
    FEWEST,
    FLOOR,
    LEVELS,
    STANDS_OUT,
    WIDTH,
    ContrastPyramid,
    FloatImage,
    Mask,
    Place,
    median_and_spread,
)
from tracking.perception.crop import check_image
from tracking.perception.patches import Patch, blob_of, filled
from tracking.perception.target_colours import DARKER, RED, TargetColour, contrast_matrix
from tracking.records import Blob, Detection

JUDGED = 2
"""Pieces of an image that are cut out and judged, those that stand out most, and beside them as many where a target is
expected; with three times as many, 2 of 100 more targets are found."""

CUT_SHARE, CUT_SPREADS, MOST_SHARE = 0.2, 2.0, 0.6
"""Redness above the surroundings from which a cell belongs to a piece: a share of its middle's, or spreads of theirs if
that is more, up to another share; half of that is enough where it is darker than they are by as many spreads. A ball
lit from above is a fifth as red below, and dark."""

LARGEST_PART = 0.5
"""Of a piece, that what stands out most in it may be for another thing: of one thing it is 0.8 or more."""

SMOOTHING, GAP = 3, 5
"""Sides in cells over which is averaged at least before a piece is cut, and of the gap around it."""

LEAST_CELLS = 8

FEW = np.float32(1e-3)
"""Less of a cell than this is none of it."""

PLAIN = 10.0
"""Spreads from which a thing is there without doubt: more of them do not tell a target from other things."""

LEAST_LOG_ODDS = -2.0
"""Of what may be the target: what is followed already is in the right place, which counts as much as its looks."""

ACQUIRED_LOG_ODDS = 2.0
"""From which it is taken for a target of which nothing is known yet (`dives.known_target.LEAST_WEIGHED_SHARE`)."""

DARKNESS = contrast_matrix(DARKER, (0.0, 0.0, 0.0))

SILHOUETTE = 1.0
"""Darkness above the surroundings', in natural logarithms, of a silhouette: 0.37 of their light. A ball before the sun
has 0.14 to 0.3, a dark tile 0.5 to 0.6."""

SILHOUETTE_LOG_ODDS = 0.0
"""That a silhouette where the target is expected is it: its place and size must tell."""


@dataclass(frozen=True, kw_only=True)
class Contrast:
    """How a piece differs from what is around it.

    Attributes
    ----------
    standing_out : float
        As `Place` has it.
    clearness : float
        Its mean redness above that of the ring, in standard deviations of the ring's.
    along, across, lightness : float
        Mean differences from the ring, the first two as `TargetColour` has them: of red, of
        ``ln R - (ln G + ln B) / 2`` and ``ln G - ln B``; the third of ``ln G``.
    aspect : float
        Longer over shorter side of the upright box.
    over_water : float
        Of the target, whatever the piece is (`tracking.perception.DetectorSettings`).
    """

    standing_out: float
    clearness: float
    along: float
    across: float
    lightness: float
    aspect: float
    over_water: float

    def features(self) -> FloatArray:
        """Numbers that are weighed, shape (7,)."""
        return np.array(
            [
                math.log(min(max(self.standing_out, STANDS_OUT), PLAIN)),
                math.log(min(max(self.clearness, 1 / PLAIN), PLAIN)),
                self.along,
                self.across,
                self.lightness,
                math.log(self.aspect),
                self.over_water,
            ]
        )


@dataclass(frozen=True, kw_only=True)
class Piece(Patch):
    """Something that stands out, cut out of its surroundings; `contrast` is how it differs from them."""

    contrast: Contrast


def detect_by_contrast(
    crop: NDArray[np.uint8],
    area_min_px: float = 100.0,
    ignored: Mask | None = None,
    expected_px: tuple[float, float] | None = None,
    *,
    colour: TargetColour = RED,
    over_water: float = OVER_WATER,
) -> Detection:
    """Find what may be the target in a crop, the likeliest first.

    Parameters
    ----------
    crop : array, shape (height, width, 3)
        uint8 sRGB.
    area_min_px : float
        Least area of a blob.
    ignored : array, shape (height, width), optional
        uint8: pixels that are 255 belong neither to a target nor to its surroundings.
    expected_px : tuple of float, optional
        Where a target is expected that is followed already: what is there is judged first, and when it looks like the
        target nothing else is.
    colour : TargetColour
        Of the target.
    over_water : float
        Likewise (`tracking.perception.DetectorSettings`).

    Raises
    ------
    ValueError
        For anything but an image.
    """
    check_image("crop", crop)
    pyramid = ContrastPyramid(crop, ignored, colour.contrasts)

    def is_expected(thing: Place | Blob) -> bool:
        return expected_px is not None and thing.is_near(expected_px)

    places = [(place, is_expected(place)) for place in pyramid.places()]
    likely: list[Piece] = []
    judged = {True: 0, False: 0}
    for place, near in sorted(places, key=lambda each: not each[1]):
        if judged[near] == JUDGED or any(each.covers(place) for each in likely):
            continue
        judged[near] += 1
        piece = cut_out(pyramid, place, colour, over_water)
        if piece is None or piece.blob.area_px < area_min_px:
            continue
        # A part of less has not the least area.
        if piece.blob.log_odds < ACQUIRED_LOG_ODDS and LARGEST_PART * piece.blob.area_px >= area_min_px:
            part = cut_out(pyramid, place, colour, over_water, MOST_SHARE)
            if part is not None and part.blob.area_px >= area_min_px and _is_other_thing(part, piece):
                piece = part
        if piece.blob.log_odds < LEAST_LOG_ODDS:
            continue
        likely.append(piece)
        # Of a large thing a place far from its middle may stand out most.
        if (near or is_expected(piece.blob)) and piece.blob.log_odds >= ACQUIRED_LOG_ODDS:
            break
    else:
        # What looks like the target elsewhere says nothing of what is dark there.
        likely += [] if expected_px is None else silhouettes(crop, area_min_px, ignored, expected_px)
    mask = np.zeros(crop.shape[:2], dtype=np.uint8)
    for piece in likely:
        piece.mark(mask)
    blobs = tuple(sorted((piece.blob for piece in likely), key=lambda each: -each.log_odds))
    return Detection(mask=mask, blobs=blobs, centroid_px=weighted_centroid(blobs))


def silhouettes(
    crop: NDArray[np.uint8], area_min_px: float, ignored: Mask | None, expected_px: tuple[float, float]
) -> list[Piece]:
    """What is dark nearest to where a target is expected, one piece at most: before the sun it has no colour left."""
    pyramid = ContrastPyramid(crop, ignored, DARKNESS)
    for place in sorted(pyramid.places(), key=lambda each: each.distance_px(expected_px))[:JUDGED]:
        piece = cut_out(pyramid, place, RED, OVER_WATER)
        if piece is None or piece.contrast.along < SILHOUETTE or piece.blob.area_px < area_min_px:
            continue
        if all(side < whole for side, whole in zip(piece.blob.box_px[2:], crop.shape[1::-1], strict=True)):
            return [replace(piece, blob=replace(piece.blob, log_odds=SILHOUETTE_LOG_ODDS, silhouette=True))]
    return []


def _is_other_thing(part: Piece, whole: Piece) -> bool:
    """Whether what stands out most in a piece looks like the target and is too little of it to be the same thing.

    A ball before or beside another is in one piece with it, and together they look like neither.
    """
    return part.blob.log_odds >= ACQUIRED_LOG_ODDS and part.blob.area_px <= LARGEST_PART * whole.blob.area_px


def cut_out(
    pyramid: ContrastPyramid, place: Place, colour: TargetColour, over_water: float, least_share: float = CUT_SHARE
) -> Piece | None:
    """What stands out at a place, cut out of a finer level; None when nothing of it holds together.

    `colour` is the target's, and that of the pyramid's contrasts; so is `over_water`
    (`tracking.perception.DetectorSettings`). `least_share` stands for `CUT_SHARE`: more for what stands out most of it.
    """
    level = min(place.level - 1, 1)
    rows, columns = pyramid.shape(level)
    scale = 1 << (place.level - level)
    x, y, width = scale * place.x + scale // 2, scale * place.y + scale // 2, scale * WIDTH
    x0, x1 = max(x - 2 * width, 0), min(x + 2 * width, columns)
    y0, y1 = max(y - 2 * width, 0), min(y + 2 * width, rows)
    part = pyramid.part(level, slice(y0, y1), slice(x0, x1))
    side = max(SMOOTHING, width // 6 | 1)
    *sums, counted = cv2.split(np.asarray(cv2.blur(part, (side, side))))
    smooth = [np.asarray(plane / np.maximum(counted, FEW), dtype=np.float32) for plane in sums]
    middle, known = (x - x0, y - y0), part[..., 3] > 0.5
    cells = _held_together(smooth, known, middle, width, most_across=colour.most_across, least_share=least_share)
    if cells is None:
        return None
    box = cv2.boundingRect(cells)
    if place.level + 1 < LEVELS and _goes_on(box, (x0, y0), cells.shape, (rows, columns)):
        return cut_out(pyramid, place.coarser(), colour, over_water, least_share)
    contour = filled(cells)
    contrast = _compared(part, smooth[0], cells, box, standing_out=place.standing_out, over_water=over_water)
    if contrast is None:
        return None
    blob = blob_of(cells, contour, level, (x0, y0), colour.log_odds(contrast.features()))
    return Piece(contrast=contrast, blob=blob, cells=cells, level=level, first=(x0, y0))


def _held_together(
    smooth: Sequence[FloatImage],
    known: NDArray[np.bool_],
    middle: tuple[int, int],
    width: int,
    *,
    most_across: float | None,
    least_share: float,
) -> Mask | None:
    """Cells about a middle that are red enough and not too green, 1 or 0; None when there are none."""
    redness, greenness, lightness = smooth
    inner, outer = _square(middle, width // 4), _square(middle, 3 * width // 4)
    around = known.copy()
    around[outer] = False
    around = around[::2, ::2]
    if np.count_nonzero(around) < FEWEST or not known[inner].any():
        return None
    (red, red_spread), (green, green_spread), (light, light_spread) = (
        median_and_spread(plane[::2, ::2][around]) for plane in smooth
    )
    height = float(redness[inner][known[inner]].mean()) - red
    if not height > 0:
        return None
    cut = min(max(least_share * height, CUT_SPREADS * red_spread), MOST_SHARE * height)
    dark = lightness < light - CUT_SPREADS * light_spread
    target = (redness > red + cut) | (dark & (redness > red + cut / 2))
    if most_across is not None:
        target &= greenness < green + green_spread + most_across * (redness - red)
    opened = cv2.morphologyEx((target & known).astype(np.uint8), cv2.MORPH_OPEN, _disc(max(width // 5 | 1, 3)))
    _, labels = cv2.connectedComponents(opened, connectivity=4)
    met = np.bincount(labels[inner].ravel())
    met[0] = 0
    return (labels == met.argmax()).astype(np.uint8) if met.any() else None


def _square(middle: tuple[int, int], half: int) -> tuple[slice, slice]:
    x, y = middle
    return slice(max(y - half, 0), y + half + 1), slice(max(x - half, 0), x + half + 1)


def _goes_on(box: Sequence[int], first: tuple[int, int], part: tuple[int, int], whole: tuple[int, int]) -> bool:
    """Whether a box in a part of an image meets the part's border where the image goes on."""
    x, y, width, height = box
    rows, columns = part
    return (
        (x == 0 and first[0] > 0)
        or (y == 0 and first[1] > 0)
        or (x + width == columns and first[0] + columns < whole[1])
        or (y + height == rows and first[1] + rows < whole[0])
    )


def _compared(
    part: FloatImage, redness: FloatImage, cells: Mask, box: Sequence[int], **known: float
) -> Contrast | None:
    """A piece beside the rest of a box around it; None when it is too small, or too little of the ring is seen.

    `known` are the numbers of the contrast that are known already: how far it stands out, and `over_water`.
    """
    area = cv2.countNonZero(cells)
    if area < LEAST_CELLS:
        return None
    x, y, width, height = box
    thick = int(0.6 * math.sqrt(area)) + GAP // 2
    window = slice(max(y - thick, 0), y + height + thick), slice(max(x - thick, 0), x + width + thick)
    part, redness, cells = part[window], redness[window], cells[window]
    looked_at = (part[..., 3] > 0.5).astype(np.uint8)
    inside = cv2.bitwise_and(cells, looked_at)
    ring = cv2.subtract(looked_at, cv2.dilate(cells, np.ones((GAP, GAP), dtype=np.uint8)))
    if cv2.countNonZero(ring) < 0.3 * area:
        return None
    differences = np.subtract(cv2.mean(part, inside)[:3], cv2.mean(part, ring)[:3])
    (above,), _ = cv2.meanStdDev(redness, mask=inside)
    (below,), (spread,) = cv2.meanStdDev(redness, mask=ring)
    return Contrast(
        **known,
        clearness=float(above[0] - below[0]) / math.hypot(float(spread[0]), FLOOR),
        along=float(differences[0]),
        across=float(differences[1]),
        lightness=float(differences[2]),
        aspect=max(width, height) / min(width, height),
    )


@cache
def _disc(diameter: int) -> Mask:
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (diameter, diameter)))
