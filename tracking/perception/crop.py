"""The crop: the gaze mirror's face as an image of constant size, by the homography of its four corners."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Self

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from optics.kernels.arrays import FloatArray
from optics.mirror_outline import Centred, Rectangle

WIDTH_PX, HEIGHT_PX = 320, 240
"""Size of the crop unless said otherwise."""

WHOLE = Rectangle(half_width=1.0, half_height=1.0)
"""Outline of a mirror that fills the crop."""

CORNER_COUNT = 4
NEXT_CORNER = [1, 2, 3, 0]


@dataclass(frozen=True, kw_only=True)
class Crop:
    """Maps between an image and the crop of the gaze mirror in it.

    The rectangle that the mirror's outline fills is the crop's border: the outer corner of its first pixel, at
    (-0.5, -0.5), is its top left corner. Right is right and down is down as the virtual camera has it, which turns with
    the mirror. What an octagon or an ellipse leaves of the rectangle shows something else, and is black.

    Attributes
    ----------
    width_px, height_px : int
    image_from_crop : array, shape (3, 3)
        Homography of pixels (x, y, 1); all nan when there is no mirror to be seen.
    outline : Centred
        Of the mirror, in any unit.
    """

    width_px: int
    height_px: int
    image_from_crop: FloatArray
    outline: Centred = WHOLE

    @classmethod
    def of(
        cls, corners_px: ArrayLike, width_px: int = WIDTH_PX, height_px: int = HEIGHT_PX, outline: Centred = WHOLE
    ) -> Self:
        """Crop between four corners, shape (4, 2): top left, top right, bottom right, bottom left.

        Corners that are not finite, or not clockwise around a convex outline, give an empty crop: there is no mirror to
        be seen. They may lie outside the image.
        """
        corners = np.asarray(corners_px, dtype=np.float64)
        if corners.shape != (CORNER_COUNT, 2):
            raise ValueError(f"expected corners_px of shape (4, 2), got {corners.shape}")
        if min(width_px, height_px) < 1:
            raise ValueError(f"expected a crop of at least 1 x 1 px, got {width_px} x {height_px}")
        if not runs_clockwise(corners):
            empty = np.full((3, 3), np.nan)
            return cls(width_px=width_px, height_px=height_px, image_from_crop=empty, outline=outline)
        right, bottom = width_px - 0.5, height_px - 0.5
        border = np.array([[-0.5, -0.5], [right, -0.5], [right, bottom], [-0.5, bottom]], dtype=np.float32)
        matrix = cv2.getPerspectiveTransform(border, corners.astype(np.float32))
        return cls(width_px=width_px, height_px=height_px, image_from_crop=np.asarray(matrix), outline=outline)

    @property
    def empty(self) -> bool:
        """Whether there is no mirror to be seen."""
        return bool(np.isnan(self.image_from_crop[0, 0]))

    @property
    def centre_px(self) -> tuple[float, float]:
        """Middle of the crop, in its own pixels."""
        return (self.width_px - 1) / 2, (self.height_px - 1) / 2

    def take(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Crop of an image, shape (height_px, width_px, 3), bilinear; black where image and mirror end.

        Parameters
        ----------
        image : array, shape (height, width, 3)
            uint8.
        """
        check_image("image", image)
        if self.empty:
            return np.zeros((self.height_px, self.width_px, 3), dtype=np.uint8)
        size = (self.width_px, self.height_px)
        columns, rows = self._within(image)
        # OpenCV warps four channels in half of the time that it needs for three.
        part = cv2.cvtColor(image[rows, columns], cv2.COLOR_RGB2RGBA)
        part_from_image = np.array([[1, 0, -columns.start], [0, 1, -rows.start], [0, 0, 1]])
        warped = cv2.warpPerspective(
            part, part_from_image @ self.image_from_crop, size, flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        )
        crop = cv2.cvtColor(warped, cv2.COLOR_RGBA2RGB)
        if not isinstance(self.outline, Rectangle):
            crop[beside(self.outline, *size)] = 0
        return np.asarray(crop, dtype=np.uint8)

    def _within(self, image: NDArray[np.uint8]) -> tuple[slice, slice]:
        """Columns and rows of an image that the crop is made of; one of each where it lies beside the image."""
        right, bottom = self.width_px - 0.5, self.height_px - 0.5
        border = self.to_image([[-0.5, -0.5], [right, -0.5], [right, bottom], [-0.5, bottom]])
        most = np.array(image.shape[1::-1])
        first = np.clip(np.floor(border.min(axis=0)) - 1, 0, most - 1).astype(int)
        last = np.clip(np.ceil(border.max(axis=0)) + 2, first + 1, most).astype(int)
        columns, rows = (slice(*ends) for ends in zip(first.tolist(), last.tolist(), strict=True))
        return columns, rows

    def rim_px(self) -> FloatArray:
        """The mirror's outline in the image, shape (k, 2), straight between its points; nan for an empty crop."""
        size, half = np.array([self.width_px, self.height_px]), [self.outline.half_width, self.outline.half_height]
        return self.to_image((self.outline.rim() / half + 1) / 2 * size - 0.5)

    def to_image(self, points_px: ArrayLike) -> FloatArray:
        """Where points of the crop, shape (n, 2), are in the image; nan for an empty crop."""
        return _mapped(self.image_from_crop, points_px)

    def from_image(self, points_px: ArrayLike) -> FloatArray:
        """Where points of the image, shape (n, 2), are in the crop; nan for an empty crop."""
        # nan stays nan: the inverse of nothing is nothing.
        return _mapped(np.asarray(np.linalg.inv(self.image_from_crop), dtype=np.float64), points_px)


@lru_cache(maxsize=8)
def beside(outline: Centred, width_px: int, height_px: int) -> NDArray[np.bool_]:
    """Pixels of a crop whose centres are beside the mirror, shape (height_px, width_px)."""
    x = (2 * np.arange(width_px) + 1) / width_px - 1
    y = (2 * np.arange(height_px)[:, np.newaxis] + 1) / height_px - 1
    return np.asarray(~outline.contains(x * outline.half_width, y * outline.half_height))


def runs_clockwise(corners_px: FloatArray) -> NDArray[np.bool_]:
    """Whether quadrilaterals, shape (..., 4, 2), are finite, convex and clockwise as the image is seen (v down)."""
    edges = corners_px[..., NEXT_CORNER, :] - corners_px
    following = edges[..., NEXT_CORNER, :]
    turns = edges[..., 0] * following[..., 1] - edges[..., 1] * following[..., 0]
    # Four right turns are one way round: a pentagram needs five corners. nan compares as false.
    return np.asarray((turns > 0).all(axis=-1))


def check_image(name: str, image: NDArray[np.uint8]) -> None:
    """Raise a `ValueError` for anything that is not an image of three channels of uint8."""
    shape, kind = getattr(image, "shape", None), getattr(image, "dtype", type(image).__name__)
    if shape is None or len(shape) != 3 or shape[2] != 3 or kind != np.uint8 or 0 in shape:
        raise ValueError(f"expected {name} of uint8, shape (height, width, 3), got {kind}, shape {shape}")


def _mapped(matrix: FloatArray, points_px: ArrayLike) -> FloatArray:
    points = np.asarray(points_px, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError(f"expected points of shape (n, 2), got {points.shape}")
    lifted = points @ matrix[:, :2].T + matrix[:, 2]
    return np.asarray(lifted[:, :2] / lifted[:, 2:])
