"""Where something redder than its surroundings stands out, over places and sizes.

Water takes the red out of everything, and white balance, gain and exposure multiply each channel by a number of its
own. In the logarithm of linear light these are sums, and the difference between a place and its surroundings is free of
them: what is left of it is the paint's contrast, faded by the water. So no camera setting need be known.

An image becomes a pyramid of redness ``ln R - (ln G + ln B) / 2``, greenness ``ln G - ln B`` and lightness ``ln G``. At
each level a box is compared with the frame around it (centre minus surround), and the difference is divided by how much
such differences spread over the same image, which is noise and clutter together: what stands out does so at the same
rate of false alarms in any scene (CFAR; Robey et al. 1992, IEEE Trans. Aerosp. Electron. Syst. 28, 208-216).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from optics.srgb import srgb_decode

FloatImage = NDArray[np.float32]
Mask = NDArray[np.uint8]

FINEST_PX = 2
"""Pixels of the crop along a cell of the finest level."""

LEVELS = 4
"""Each half as fine as the one before; all but the finest are searched."""

BOX, HOLE, FRAME = 7, 11, 21
"""Sides in cells of the box that is compared, of the hole in the frame around it, and of that frame."""

WIDTH = 9
"""Of a disc that fills the box best: 36, 72 and 144 px of the crop. Twice as many sizes found no more."""

FLOOR = 0.02
"""Least spread of log contrasts: about one step of an 8-bit image at a mean level."""

STANDS_OUT = 1.0
"""Spreads by which a place is redder than its surroundings to be looked at."""

MOST_PLACES = 6

FEWEST = 30
"""Cells at least that tell a spread."""

MANY = 1000
"""Of more cells than this, every fourth tells it."""

DARKEST = 1e-4
"""Of full scale: below, light is not told from none."""

BORDER = cv2.BORDER_CONSTANT
NEIGHBOURS = np.ones((5, 5), dtype=np.uint8)

MAD_TO_SIGMA = 1.4826
"""Rousseeuw and Croux 1993, J. Am. Stat. Assoc. 88, 1273-1283."""


@dataclass(frozen=True)
class Place:
    """Where something stands out.

    Attributes
    ----------
    standing_out : float
        Redness of its box above the frame's, in spreads of that difference over the image.
    level, x, y : int
        Cell of a level of the pyramid.
    """

    standing_out: float
    level: int
    x: int
    y: int

    def coarser(self) -> Place:
        """The same place one level up."""
        return replace(self, level=self.level + 1, x=self.x // 2, y=self.y // 2)

    def distance_px(self, point_px: tuple[float, float]) -> float:
        """From a point of the crop."""
        x, y = ((at + 0.5) * (FINEST_PX << self.level) - 0.5 for at in (self.x, self.y))
        return math.dist((x, y), point_px)

    def is_near(self, point_px: tuple[float, float]) -> bool:
        """Whether a point of the crop is nearer than the disc that fills its box best is wide."""
        return self.distance_px(point_px) < WIDTH * (FINEST_PX << self.level)

    def is_apart(self, other: Place) -> bool:
        """Whether it is farther away than 0.7 of the larger's width."""
        own, others = 1 << self.level, 1 << other.level
        x = (self.x + 0.5) * own - (other.x + 0.5) * others
        y = (self.y + 0.5) * own - (other.y + 0.5) * others
        return x * x + y * y > (0.7 * WIDTH * max(own, others)) ** 2


class ContrastPyramid:
    """Redness, greenness, lightness and 1, each times whether a cell counts, at levels of halved fineness.

    A cell of level k is 2^(k + 1) px wide. The finest is made only where it is asked for. What is hidden does not
    count, nor what is black, for there image or mirror end.

    Parameters
    ----------
    crop : array, shape (height, width, 3)
        uint8 sRGB.
    hidden : array, shape (height, width), optional
        uint8: 255 in pixels that do not count.
    contrasts : array, shape (4, 5)
        What is made of the logarithms (`contrast_matrix`): of what is red, or of another colour in its place.
    """

    def __init__(self, crop: NDArray[np.uint8], hidden: Mask | None, contrasts: FloatImage):
        black = np.asarray(cv2.inRange(crop, (0, 0, 0), (0, 0, 0)), dtype=np.uint8)
        self._crop, self._contrasts = crop, contrasts
        hidden = black if hidden is None else np.asarray(cv2.bitwise_or(black, hidden), dtype=np.uint8)
        rows, columns = self.shape(0)
        # Above 0 in cells of the finest level that have a hidden pixel.
        whole = hidden[: rows * FINEST_PX, : columns * FINEST_PX]
        self._hidden = cv2.resize(whole, (columns, rows), interpolation=cv2.INTER_AREA)
        everything = slice(None), slice(None)
        self._levels = [self._made(1, *everything)]
        for level in range(2, LEVELS):
            coarser = cv2.resize(self._levels[-1], self.shape(level)[::-1], interpolation=cv2.INTER_AREA)
            self._levels.append(np.asarray(coarser, dtype=np.float32))

    def shape(self, level: int) -> tuple[int, int]:
        """Rows and columns of a level."""
        height, width = self._crop.shape[:2]
        cell_px = FINEST_PX << level
        return max(height // cell_px, 1), max(width // cell_px, 1)

    def part(self, level: int, rows: slice, columns: slice) -> FloatImage:
        """Part of a level, shape (h, w, 4)."""
        return self._made(0, rows, columns) if level == 0 else self._levels[level - 1][rows, columns]

    def places(self) -> list[Place]:
        """Maxima over place and size, those that stand out most first; none within another's reach."""
        found = [place for level in range(1, LEVELS) for place in self._maxima(level)]
        apart: list[Place] = []
        for place in sorted(found, key=lambda each: -each.standing_out):
            if all(place.is_apart(other) for other in apart):
                apart.append(place)
                if len(apart) == MOST_PLACES:
                    break
        return apart

    def _made(self, level: int, rows: slice, columns: slice) -> FloatImage:
        """Part of a level from the crop itself."""
        cell_px = FINEST_PX << level
        (y0, y1, _), (x0, x1, _) = (part.indices(n) for part, n in zip((rows, columns), self.shape(level), strict=True))
        crop, hidden = (
            cv2.resize(fine[y0 * n : y1 * n, x0 * n : x1 * n], (x1 - x0, y1 - y0), interpolation=cv2.INTER_AREA)
            for fine, n in ((self._crop, cell_px), (self._hidden, 1 << level))
        )
        logs = cv2.LUT(cv2.cvtColor(crop, cv2.COLOR_RGB2RGBA), log_light())
        shown = (np.asarray(hidden) == 0).view(np.uint8)
        return np.asarray(cv2.copyTo(cv2.transform(logs, self._contrasts), shown), dtype=np.float32)

    def _maxima(self, level: int) -> list[Place]:
        """Maxima of redness above the frame's at one level."""
        image = self._levels[level - 1]
        (red_inside, red_hole, red_frame), (inside, hole, frame) = (
            [cv2.boxFilter(plane, -1, (side, side), normalize=False, borderType=BORDER) for side in (BOX, HOLE, FRAME)]
            for plane in (cv2.extractChannel(image, 0), cv2.extractChannel(image, 3))
        )
        frame = cv2.subtract(frame, hole)
        known = (inside > 0.6 * BOX**2) & (frame > 0.25 * (FRAME**2 - HOLE**2))
        around = cv2.divide(cv2.subtract(red_frame, red_hole), frame)
        redness = np.asarray(cv2.subtract(cv2.divide(red_inside, inside), around), dtype=np.float32)
        sample = redness[::2, ::2][known[::2, ::2]] if redness.size > MANY else redness[known]
        if sample.size < FEWEST:
            return []
        least = math.hypot(median_and_spread(sample)[1], FLOOR)
        redness[~known] = -np.inf
        top = (cv2.dilate(redness, NEIGHBOURS) == redness) & (redness > STANDS_OUT * least)
        return [
            Place(height / least, level, x, y)
            for height, y, x in zip(redness[top].tolist(), *(each.tolist() for each in np.nonzero(top)), strict=True)
        ]


def median_and_spread(values: FloatImage) -> tuple[float, float]:
    """Median, and standard deviation of a normal distribution that has the values' median absolute deviation."""
    median = _median(values)
    return median, MAD_TO_SIGMA * _median(np.abs(values - np.float32(median)))


def _median(values: FloatImage) -> float:
    """The upper one of an even number: `numpy.median` takes four times as long to find both."""
    flat = values.ravel()
    half = flat.size // 2
    return float(np.partition(flat, half)[half])


@cache
def log_light() -> FloatImage:
    """Logarithm of the light of an sRGB value from 0 to 255, of full scale."""
    return np.log(np.maximum(srgb_decode(np.arange(256) / 255), DARKEST)).astype(np.float32)[np.newaxis]
