"""The followed target by its own colours, as they were a moment ago beside those of what is around it.

Contrast asks how a thing differs from what is around it now, so that it finds nothing where little is around it: of a
ball that fills the window of a frame, or of which hull or mount hides the half. But how a target looks that has been
followed is known. In the logarithm of light its cells and those around it are two clouds, each taken for normal, and
exposure and white balance move both of them slowly: within two seconds by little, later by more. A cell is the target's
if that is likelier by its colour than that it is not: quadratic discriminant analysis (Hastie, Tibshirani & Friedman
2009, The Elements of Statistical Learning, section 4.3), learned from the images before, as Collins, Liu & Leordeanu
2005 (IEEE Trans. Pattern Anal. Mach. Intell. 27, 1631-1643) do with histograms. It is learned only where contrast finds
the target, or most of what its colours find, and where one that was lost has shown that it is it again, so that it
does not drift.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray
from tracking.perception.clusters import weighted_centroid
from tracking.perception.contrast import ACQUIRED_LOG_ODDS
from tracking.perception.contrast_pyramid import FINEST_PX, FloatImage, Mask, log_light
from tracking.perception.cut_blobs import is_cut
from tracking.perception.patches import Patch, blob_of, filled
from tracking.records import Blob, Detection

LEVEL = 1
"""Of cells, as `ContrastPyramid` counts them: 4 px of the crop."""

CELL_PX = FINEST_PX << LEVEL

MEMORY_S, EVERY_S = 1.0, 0.2
"""Over which colours are averaged, exponentially, and how often they are looked at."""

FEWEST_INSIDE, FEWEST_AROUND = 8, 50
"""Cells that tell how the target looks, and what is around it."""

SPREAD = 0.05
"""Least standard deviation of the logarithm of a channel: two steps of an 8-bit image at a mean level."""

MOST_SQUARED = 11.3
"""Squared Mahalanobis distance within which 99 of 100 of the target's cells are: of chi-square with 3 degrees."""

MOST_MEDIAN = 4.0
"""Median of the squared distances of a thing's cells from which they are another's colours: 2.4 in the mean of the
target's. Of 551 things of the target's colours found in images of 14 dives 0.96 have less, of 339 others 0.11."""

LEAST_WAY = 0.7
"""Of the way from what is around the target to the target, along Fisher's discriminant, that the mean of a thing's
cells has gone: of things of the target's colours that were found in 16 dives of the arena 0.995 of 1,027 that are the
target have, and 0.09 of 421 others, most of them grey balls that hide it. Of such a ball that was learned before, most
have."""

OPENING = np.ones((3, 3), dtype=np.uint8)
"""Cells: what is narrower is no thing."""

AS_LARGE = 2.0
"""Times the target's area, or part of it, that a thing has which may be it."""

RAGGED = 0.05
"""Share of its ellipse (`tracking.perception.outline`) that a target's outline lacks more than it usually does, from
which it is in one piece with something, or found in pieces. A ball whose outline lacks less than 0.01 lacks 0.055 and
more beside the one that begins to hide it."""

GROWING_S = 2.0
"""In which a target grows to twice its area if it comes nearer by a sixth of its distance in a second."""

REMEMBERED_S = 12.0
"""For which a target that was lost is sought where it can have gone, and as it looked; then it may be anywhere, or look
otherwise."""


@dataclass(frozen=True, kw_only=True)
class Colours:
    """First and second moments of the logarithms of red, green and blue light, shapes (3,) and (3, 3)."""

    first: FloatArray
    second: FloatArray

    def averaged(self, other: Colours, share: float) -> Colours:
        """With a share of others."""
        first, second = (
            (1 - share) * own + share * others
            for own, others in ((self.first, other.first), (self.second, other.second))
        )
        return Colours(first=first, second=second)

    @property
    def covariance(self) -> FloatArray:
        """Of the logarithms, shape (3, 3), with that of an image's steps."""
        return self.second - np.outer(self.first, self.first) + SPREAD**2 * np.eye(3)

    def log_likelihood(self, logs: FloatImage) -> tuple[FloatImage, FloatImage]:
        """Squared Mahalanobis distances of cells, shape (n, 3) to (n,), and logarithms of their likelihood.

        Of a normal distribution, up to a constant that is the same for all.
        """
        root = np.linalg.inv(np.linalg.cholesky(self.covariance))
        standardised = (logs - self.first.astype(np.float32)) @ root.T.astype(np.float32)
        squared = np.einsum("ij,ij->i", standardised, standardised)
        return squared, np.float32(np.log(np.diag(root)).sum()) - squared / 2

    def are_of(self, logs: FloatImage, around: Colours) -> bool:
        """Whether cells may be of what these colours are of, and not of a thing between that and what is around it.

        Cell by cell a grey ball is as near to a red one, lit from one side, as its own shaded cells are. But its mean
        lies between the red one's and the water's, along Fisher's discriminant (1936, Annals of Eugenics 7, 179).

        Parameters
        ----------
        logs : array, shape (n, 3)
            Logarithms of the light of the cells.
        around : Colours
            Of what is around the target.
        """
        if np.median(self.log_likelihood(logs)[0]) >= MOST_MEDIAN:
            return False
        across = self.first - around.first
        normal = np.linalg.solve(self.covariance + around.covariance, across)
        return bool(normal @ (logs.mean(axis=0) - around.first) >= LEAST_WAY * (normal @ across))


class AppearanceModel:
    """Colours of a target and of what is around it, learned while it is followed.

    Parameters
    ----------
    area_min_px : float
        Least area of what has them.
    """

    def __init__(self, area_min_px: float):
        self._area_min_px = area_min_px
        self._target: Colours | None = None
        self._around: Colours | None = None
        self._area_px2 = self._whole_px2 = self._missing = 0.0
        self._noted_s = self._whole_s = -math.inf

    def note(
        self, crop: NDArray[np.uint8], hidden: Mask | None, target: Detection, time_s: float, *, regained: bool
    ) -> None:
        """Learn from an image that shows the target, and shows that it is one.

        Parameters
        ----------
        crop : array, shape (height, width, 3)
            uint8 sRGB.
        hidden : array, shape (height, width), optional
            uint8: pixels that are 255 show neither the target nor what is around it.
        target : Detection
            What was taken for it.
        time_s : float
            Of the image.
        regained : bool
            Whether it was lost, and has shown now that it is the target again: how it looks has changed meanwhile.
            Else nothing is learned from what its colours have found.
        """
        area_px2 = sum(blob.area_px for blob in target.blobs)
        blob = target.blobs[0]
        if time_s - self._noted_s < EVERY_S or blob.log_odds < ACQUIRED_LOG_ODDS or (blob.recalled and not regained):
            return
        cut, missing = _is_cut(blob, crop, hidden), 1 - blob.ellipse_share
        ragged = not cut and missing > self._missing + RAGGED
        if time_s - self._whole_s < GROWING_S and (ragged or area_px2 > AS_LARGE * self._whole_px2):
            # In one piece with something that passes before or behind it.
            return
        logs, known = log_cells(crop, hidden)
        covered = shrunk(target.mask)
        inside = logs[known & (covered == 255)]
        around = logs[known & (cv2.dilate(covered, OPENING) == 0)]
        if len(inside) < FEWEST_INSIDE or len(around) < FEWEST_AROUND:
            return
        share = -math.expm1((self._noted_s - time_s) / MEMORY_S)
        self._target = _learned(self._target, inside, share)
        self._around = _learned(self._around, around, share)
        if not cut:
            self._area_px2 += share * (area_px2 - self._area_px2)
            # Of the first whole image it is known at once, however long parts of it have been seen.
            self._missing += (share if math.isfinite(self._whole_s) else 1.0) * (missing - self._missing)
            self._whole_px2, self._whole_s = area_px2, time_s
        self._area_px2 = max(self._area_px2, area_px2 / AS_LARGE)
        self._noted_s = time_s

    def is_asked(self, detection: Detection, expected_px: tuple[float, float] | None, time_s: float) -> bool:
        """Whether its colours are remembered, and nothing that may be the target looks like one.

        Where a target, or a candidate, is expected, what may be it is there.
        """
        return time_s - self._noted_s <= REMEMBERED_S and not any(
            blob.log_odds >= ACQUIRED_LOG_ODDS and (expected_px is None or blob.is_near(expected_px))
            for blob in detection.blobs
        )

    def recalled(
        self,
        detection: Detection,
        crop: NDArray[np.uint8],
        hidden: Mask | None,
        bare: Mask | None,
        expected_px: tuple[float, float] | None,
        *,
        followed: bool,
    ) -> Detection:
        """A detection with what has the target's colours.

        Parameters
        ----------
        detection : Detection
        crop, hidden : array
            As in `note`: what meets a hidden pixel may go on behind it.
        bare : array, shape (height, width), optional
            The same without a margin: what is hidden there is not looked at.
        expected_px : tuple of float, optional
            Where the target, or a candidate, is expected: what is nearest is taken, and else the largest.
        followed : bool
            Whether the target is followed still: place and size tell it, whatever contrast says of it. Of one that was
            lost its colours are a mark, and what has them a candidate.
        """
        cells = self._cells(crop, bare, expected_px)
        if cells is None:
            return detection
        patch = Patch(blob=blob_of(cells, filled(cells), LEVEL, (0, 0), 0.0), cells=cells, level=LEVEL, first=(0, 0))
        within = [each for each in detection.blobs if patch.shows(each.centroid_px) and not each.silhouette]
        apart = [each for each in detection.blobs if each not in within]
        log_odds, by_both = ACQUIRED_LOG_ODDS, False
        if followed:
            # What contrast says for it is still evidence, though it finds a piece alone; but nothing that it says
            # against it, as before a bright wall.
            found = max((each for each in within if each.log_odds >= 0), key=lambda each: each.log_odds, default=None)
            log_odds = -math.inf if found is None else found.log_odds
            if found is not None and AS_LARGE * found.area_px >= patch.blob.area_px:
                by_both = found.log_odds >= ACQUIRED_LOG_ODDS
        blob = replace(patch.blob, log_odds=log_odds, recalled=not by_both)
        if blob.area_px > AS_LARGE * self._area_px2:
            return detection
        if AS_LARGE * blob.area_px < self._area_px2 and not _is_cut(blob, crop, hidden):
            return detection
        mask, blobs = detection.mask.copy(), (*apart, blob)
        patch.mark(mask)
        return Detection(mask=mask, blobs=blobs, centroid_px=weighted_centroid(blobs))

    def forget(self) -> None:
        """What is followed next may have any colours."""
        self._target = self._around = None
        self._area_px2 = self._whole_px2 = self._missing = 0.0
        self._noted_s = self._whole_s = -math.inf

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""
        colours = [
            None if each is None else [each.first.tolist(), each.second.tolist()]
            for each in (self._target, self._around)
        ]
        noted_s, whole_s = (None if math.isinf(each) else each for each in (self._noted_s, self._whole_s))
        areas = {"area_px2": self._area_px2, "whole_px2": self._whole_px2, "missing": self._missing}
        return {"colours": colours, "noted_s": noted_s, "whole_s": whole_s, **areas}

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot."""
        self._target, self._around = (
            None if each is None else Colours(first=np.array(each[0]), second=np.array(each[1]))
            for each in snapshot["colours"]
        )
        self._area_px2, self._whole_px2 = snapshot["area_px2"], snapshot["whole_px2"]
        self._missing = snapshot["missing"]
        self._noted_s, self._whole_s = (
            -math.inf if snapshot[name] is None else snapshot[name] for name in ("noted_s", "whole_s")
        )

    def _cells(self, crop: NDArray[np.uint8], hidden: Mask | None, point_px: tuple[float, float] | None) -> Mask | None:
        """Cells of the thing that has the target's colours nearest to a point of the crop, or of the largest."""
        if self._target is None or self._around is None:
            return None
        logs, known = log_cells(crop, hidden)
        squared, log_likelihood = self._target.log_likelihood(logs.reshape(-1, 3))
        may_be = known.ravel() & (squared < MOST_SQUARED)
        _, others = self._around.log_likelihood(logs.reshape(-1, 3)[may_be])
        may_be[may_be] = log_likelihood[may_be] > others
        likely = may_be.reshape(known.shape).astype(np.uint8)
        opened = np.asarray(cv2.morphologyEx(likely, cv2.MORPH_OPEN, OPENING), dtype=np.uint8)
        count, labels, stats, _ = cv2.connectedComponentsWithStats(opened, connectivity=4)
        areas = stats[:, cv2.CC_STAT_AREA]
        things = [index for index in range(1, count) if areas[index] * CELL_PX**2 >= self._area_min_px]
        if not things:
            return None
        if point_px is None:
            thing = max(things, key=lambda index: int(areas[index]))
        else:
            thing = min(things, key=lambda index: _distance(labels == index, point_px))
        found = np.asarray(labels == thing, dtype=np.uint8)
        return found if self._target.are_of(logs[known & (found > 0)], self._around) else None


def log_cells(crop: NDArray[np.uint8], hidden: Mask | None) -> tuple[FloatImage, NDArray[np.bool_]]:
    """Logarithms of the light of a crop's cells, shape (rows, columns, 3), and which of them show anything."""
    small = shrunk(crop)
    unknown = np.asarray(cv2.inRange(small, (0, 0, 0), (0, 0, 0)), dtype=np.uint8)
    if hidden is not None:
        unknown |= shrunk(hidden)
    known = unknown == 0
    return np.asarray(cv2.LUT(small, log_light()), dtype=np.float32), known


def shrunk(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Means over the cells of an image or a mask."""
    height, width = image.shape[:2]
    rows, columns = max(height // CELL_PX, 1), max(width // CELL_PX, 1)
    whole = image[: rows * CELL_PX, : columns * CELL_PX]
    return np.asarray(cv2.resize(whole, (columns, rows), interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _learned(before: Colours | None, logs: FloatImage, share: float) -> Colours:
    exact = logs.astype(np.float64)
    now = Colours(first=exact.mean(axis=0), second=exact.T @ exact / len(exact))
    return now if before is None else before.averaged(now, share)


def _distance(cells: NDArray[np.bool_], point_px: tuple[float, float]) -> float:
    """From a point of the crop to the nearest of some cells, cells."""
    rows, columns = np.nonzero(cells)
    x, y = (at / CELL_PX for at in point_px)
    return float(np.hypot(columns - x, rows - y).min())


def _is_cut(blob: Blob, crop: NDArray[np.uint8], hidden: Mask | None) -> bool:
    """Whether the crop's edge or the robot cuts a blob."""
    return is_cut(blob, np.zeros(crop.shape[:2], dtype=np.uint8) if hidden is None else hidden)
