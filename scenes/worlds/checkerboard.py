"""Checkerboards to calibrate with: plates in the world whose corners are known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from optics.kernels.arrays import FloatArray
from scenes.light.materials import Material
from scenes.surfaces.surface import Surface, joined, surface

THICKNESS_M = 0.01


@dataclass(frozen=True, kw_only=True)
class Checkerboard:
    """A checkered plate with a white margin one square wide.

    An even number of squares one way and an odd number the other: turned by half a turn it looks different, so its
    corners can be told apart. The square at the top left is white.

    Attributes
    ----------
    name : str
    columns, rows : int
        Squares, without the margin; one even, one odd.
    square_m : float
        Side of a square.
    world_from_board : RigidTransform
        Pose of the board: x along the rows to the right, y down the columns, z into the board, origin in the middle of
        the checkered face (OpenCV's frame of a board seen upright).
    """

    name: str
    columns: int
    rows: int
    square_m: float
    world_from_board: RigidTransform

    def __post_init__(self) -> None:
        if min(self.columns, self.rows) < 2 or (self.columns + self.rows) % 2 == 0:
            raise ValueError(
                f"expected columns and rows of 2 or more, one even and one odd, got {self.columns} and {self.rows}"
            )
        if not self.square_m > 0:
            raise ValueError(f"expected square_m > 0, got {self.square_m}")

    @property
    def corners_m(self) -> FloatArray:
        """Inner corners in the world frame, row by row from the top left, shape ((rows - 1) * (columns - 1), 3).

        The order is that in which OpenCV's `findChessboardCornersSB` finds them: it begins at the white end.
        """
        x, y = np.meshgrid(np.arange(1, self.columns), np.arange(1, self.rows))
        return np.asarray(self.world_from_board.apply(self._plane(x, y).reshape(-1, 3)))

    def surface(self) -> Surface:
        """Closed plate in the world frame: checkered and white in front, grey behind and on its edges."""
        x, y = np.meshgrid(np.arange(-1, self.columns + 2), np.arange(-1, self.rows + 2))
        index = np.arange(x.size).reshape(x.shape)
        a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
        # x to the right and y down: clockwise in the board's axes is counter-clockwise for who looks along its z.
        faces = np.stack([a, d, c, a, c, b], axis=-1).reshape(-1, 3)
        margin = (x < 0) | (x >= self.columns) | (y < 0) | (y >= self.rows)
        white = (margin | ((x + y) % 2 == 0))[:-1, :-1]
        material = np.repeat(np.where(white, int(Material.TILE_WHITE), int(Material.TILE_BLACK)).ravel(), 2)
        front = surface(self._plane(x, y), faces, material)
        whole = joined([front, self._back()])
        return surface(self.world_from_board.apply(whole.vertices_m), whole.faces, whole.material)

    def _plane(self, x: NDArray[np.signedinteger], y: NDArray[np.signedinteger]) -> FloatArray:
        """Points of the checkered face in the board's frame, from squares counted from its top left corner."""
        across, down = x - self.columns / 2, y - self.rows / 2
        return self.square_m * np.stack([across, down, np.zeros_like(across)], axis=-1)

    def _back(self) -> Surface:
        """Grey box behind the checkered face, open in front."""
        half = self.square_m * np.array([self.columns / 2 + 1, self.rows / 2 + 1])
        corners = np.array([[x, y, z] for z in (0.0, THICKNESS_M) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
        corners[:, :2] *= half
        quads = np.array([[4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
        faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
        return surface(corners, faces, Material.TILE_GREY)
