"""Boards that are found in images: chessboards, ChArUco boards, and Kalibr's AprilGrids."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray

GrayImage = NDArray[np.uint8]

QUICK = cv2.CALIB_CB_ACCURACY | cv2.CALIB_CB_NORMALIZE_IMAGE
THOROUGH = QUICK | cv2.CALIB_CB_EXHAUSTIVE

SEARCHED_PX = 1000
"""Longer side of the image in which a chessboard is looked for first."""
REFINED = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 50, 1e-3)
SMALLEST_WINDOW, LARGEST_WINDOW = 2, 11
"""Half sides of the window in which a corner is refined, pixels."""

APRILTAGS = cv2.aruco.DICT_APRILTAG_36h11
KALIBR_BORDER = 2
"""Widths of a bit of the black border that Kalibr draws around a tag; the AprilTag family has 1."""

BIT = 1 / 8
"""Least width of the black border in parts of a tag's side: six bits and a border of one."""

FEWEST_TAGS = 3
"""Of which the corners are ordered: a homography has eight numbers, three centres of tags and one of their corners."""


class Board(ABC):
    """A flat pattern whose points are found in images."""

    coded: bool
    """Whether it cannot be read in a mirror."""

    @abstractmethod
    def found_in(self, image: GrayImage) -> tuple[FloatArray, FloatArray]:
        """Points of the board, shape (n, 2), metres, and their pixels, shape (n, 2); none where it is not found."""


@dataclass(frozen=True, kw_only=True)
class Chessboard(Board):
    """`columns` x `rows` inner corners, as OpenCV counts them."""

    columns: int
    rows: int
    square_m: float
    coded = False

    def found_in(self, image: GrayImage) -> tuple[FloatArray, FloatArray]:
        """All corners or none."""
        rough = self._roughly(image)
        if rough is None:
            return _nothing()
        corners = self._finely(image, rough)
        pixels: FloatArray = np.asarray(corners, dtype=np.float64).reshape(-1, 2)
        x, y = np.meshgrid(np.arange(self.columns), np.arange(self.rows))
        board_m: FloatArray = np.asarray(self.square_m * np.stack([x.ravel(), y.ravel()], axis=1))
        return board_m, self._from_above(pixels)

    def _roughly(self, image: GrayImage) -> FloatArray | None:
        """Corners to a pixel or two, in a smaller image first, where the search takes a tenth of the time."""
        size, scale = (self.columns, self.rows), min(1.0, SEARCHED_PX / max(image.shape))
        small = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        for flags in (QUICK, THOROUGH):
            found, corners = cv2.findChessboardCornersSB(small, size, flags=flags)
            if found:
                return np.asarray((corners.reshape(-1, 2) + 0.5) / scale - 0.5, dtype=np.float64)
        found, corners = cv2.findChessboardCornersSB(image, size, flags=0)
        if not found:
            found, corners = cv2.findChessboardCorners(image, size)
        return np.asarray(corners, dtype=np.float64).reshape(-1, 2) if found else None

    def _finely(self, image: GrayImage, rough: FloatArray) -> FloatArray:
        """The same to a part of a pixel, in the part of the whole image that shows the board."""
        spacing = _spacing(rough.reshape(self.rows, self.columns, 2))
        margin = 2 * np.linalg.norm(np.diff(rough, axis=0), axis=1).max(initial=0.0, where=self._neighbours())
        low = np.maximum(np.floor(rough.min(axis=0) - margin), 0).astype(int)
        high = np.ceil(rough.max(axis=0) + margin).astype(int) + 1
        part = np.ascontiguousarray(image[low[1] : high[1], low[0] : high[0]])
        found, corners = cv2.findChessboardCornersSB(part, (self.columns, self.rows), flags=THOROUGH)
        if found:
            return np.asarray(corners.reshape(-1, 2) + low, dtype=np.float64)
        return _refined(image, rough, spacing)

    def _neighbours(self) -> NDArray[np.bool_]:
        """Which steps from a corner to the next stay in a row."""
        return np.asarray(np.arange(1, self.columns * self.rows) % self.columns != 0)

    def _from_above(self, pixels: FloatArray) -> FloatArray:
        """The same way up in cameras side by side, where the board looks the same upside down."""
        if (self.columns + self.rows) % 2:
            return pixels
        return pixels if pixels[0].sum() <= pixels[-1].sum() else pixels[::-1]


@dataclass(frozen=True, kw_only=True)
class Charuco(Board):
    """`columns` x `rows` squares, with markers of an ArUco dictionary in the white ones."""

    columns: int
    rows: int
    square_m: float
    marker_m: float
    dictionary: str
    coded = True

    @cached_property
    def _detectors(self) -> list[Any]:
        detectors = []
        for legacy in (False, True):
            dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, self.dictionary))
            board = cv2.aruco.CharucoBoard((self.columns, self.rows), self.square_m, self.marker_m, dictionary)
            board.setLegacyPattern(legacy)
            detectors.append(cv2.aruco.CharucoDetector(board))
        return detectors

    def found_in(self, image: GrayImage) -> tuple[FloatArray, FloatArray]:
        """The corners that are seen, of the board as OpenCV draws it since 4.6 or before, whichever fits."""
        best = _nothing()
        for detector in self._detectors:
            corners, ids, _, _ = detector.detectBoard(image)
            if ids is not None and len(ids) > len(best[0]):
                places = np.asarray(detector.getBoard().getChessboardCorners(), dtype=np.float64)[ids.ravel(), :2]
                best = (places, np.asarray(corners, dtype=np.float64).reshape(-1, 2))
        return best


@dataclass(frozen=True, kw_only=True)
class AprilGrid(Board):
    """Kalibr's grid of `columns` x `rows` tags of the family 36h11; `spacing` is the gap in parts of a tag's side.

    Tag 0 is at the bottom left; x is to the right, y up, as Kalibr has it.
    """

    columns: int
    rows: int
    tag_m: float
    spacing: float
    coded = True

    @cached_property
    def _detectors(self) -> list[Any]:
        detectors = []
        for border in (KALIBR_BORDER, 1):
            parameters = cv2.aruco.DetectorParameters()
            parameters.markerBorderBits = border
            dictionary = cv2.aruco.getPredefinedDictionary(APRILTAGS)
            detectors.append(cv2.aruco.ArucoDetector(dictionary, parameters))
        return detectors

    def found_in(self, image: GrayImage) -> tuple[FloatArray, FloatArray]:
        """Corners of the tags that are seen."""
        for detector in self._detectors:
            corners, ids, _ = detector.detectMarkers(image)
            numbers = np.empty(0, dtype=int) if ids is None else ids.ravel()
            own = numbers < self.columns * self.rows
            if own.sum() >= FEWEST_TAGS:
                quads = np.array(corners, dtype=np.float64).reshape(-1, 4, 2)[own]
                return self._ordered(image, numbers[own], quads)
        return _nothing()

    def _ordered(self, image: GrayImage, numbers: NDArray[Any], quads: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Points and pixels; which corner of a tag comes first is what fits the grid best, whoever drew it."""
        pitch = self.tag_m * (1 + self.spacing)
        corner = np.stack([numbers % self.columns, numbers // self.columns], axis=1)[:, np.newaxis] * pitch
        square = self.tag_m * np.array([[0, 1], [1, 1], [1, 0], [0, 0.0]])
        fits = []
        for turn in range(4):
            places = (corner + np.roll(square, turn, axis=0)).reshape(-1, 2)
            fits.append((_misfit(places, quads.reshape(-1, 2)), places))
        places = min(fits, key=lambda fit: fit[0])[1]
        sides = np.linalg.norm(np.diff(quads, axis=1, append=quads[:, :1]), axis=2)
        return places, _refined(image, quads.reshape(-1, 2), float(sides.min()) * min(self.spacing, BIT))


def _nothing() -> tuple[FloatArray, FloatArray]:
    return np.empty((0, 2)), np.empty((0, 2))


def _misfit(places: FloatArray, pixels: FloatArray) -> float:
    """Median distance from the best homography."""
    matrix, _ = cv2.findHomography(places, pixels)
    if matrix is None:
        return np.inf
    seen = cv2.perspectiveTransform(places[:, np.newaxis], matrix)[:, 0]
    return float(np.median(np.linalg.norm(seen - pixels, axis=1)))


def _spacing(grid: FloatArray) -> float:
    """Least distance of neighbours, pixels."""
    steps = [np.linalg.norm(np.diff(grid, axis=axis), axis=2).min() for axis in range(2)]
    return float(min(steps))


def _refined(image: GrayImage, pixels: FloatArray, spacing_px: float) -> FloatArray:
    """Corners to a part of a pixel, looked for within half of their spacing."""
    half = int(np.clip(spacing_px / 2 - 1, SMALLEST_WINDOW, LARGEST_WINDOW))
    start = np.array(pixels, dtype=np.float32).reshape(-1, 1, 2)  # OpenCV writes into it
    return np.asarray(cv2.cornerSubPix(image, start, (half, half), (-1, -1), REFINED), dtype=np.float64).reshape(-1, 2)


DICTIONARIES = tuple(name for name in dir(cv2.aruco) if name.startswith("DICT_"))
"""ArUco dictionaries that OpenCV knows."""
