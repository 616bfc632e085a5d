"""Checkerboards and the poses in which they are shown to a camera."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.spatial.transform import Rotation

from optics.kernels.arrays import FloatArray

TILTS = (-0.45, 0.0, 0.45)
"""Turns of the board about its two axes, radians; all pairs are shown."""


@dataclass(frozen=True, kw_only=True)
class Board:
    """A checkerboard and where it is shown.

    Attributes
    ----------
    columns, rows : int
        Of inner corners.
    square_m : float
    distances_m : tuple of float
        Pinhole to the board's centre, along the optical axis.
    sideways : tuple of float
        Where the board's centre is, to the right and down, as slopes x / z and y / z; all pairs are shown.
    """

    columns: int
    rows: int
    square_m: float
    distances_m: tuple[float, ...]
    sideways: tuple[float, ...]

    def corners_m(self) -> FloatArray:
        """Inner corners in the board's own frame, shape (columns * rows, 3), z = 0."""
        x, y = np.meshgrid(np.arange(self.columns), np.arange(self.rows))
        across = np.stack([x.ravel() - (self.columns - 1) / 2, y.ravel() - (self.rows - 1) / 2, np.zeros(x.size)])
        return self.square_m * across.T

    def poses(self) -> Iterator[FloatArray]:
        """The corners in the camera frame, pose after pose, shape (columns * rows, 3)."""
        corners = self.corners_m()
        for distance, right, down, about_x, about_y in product(
            self.distances_m, self.sideways, self.sideways, TILTS, TILTS
        ):
            turned = Rotation.from_rotvec([about_x, about_y, 0.0]).apply(corners)
            yield turned + distance * np.array([right, down, 1.0])


BOARDS = {
    "large": Board(columns=41, rows=29, square_m=0.02, distances_m=(0.16, 0.2, 0.26), sideways=(0.0,)),
    "small": Board(columns=9, rows=7, square_m=0.03, distances_m=(0.35,), sideways=(-0.6, 0.0, 0.6)),
}
"""One that fills a wide image (840 x 600 mm with its outer squares), one that is carried around in it (300 x 240)."""
