"""Kernel of the ambient volume: irradiance between the points of a grid, and between the six sides known at each.

Between sides it goes by the squares of the normal's components (the ambient cube of McTaggart 2004).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from optics.kernels.backend import Float32, UInt32, dr
from optics.kernels.packing import row_of
from scenes.kernels.grid import GridTable, cell_in

SIDES = np.concatenate([np.eye(3), -np.eye(3)])
"""Normals of a point's planes: x, y, z, and the opposite ones."""

ROW = 4


def changed_irradiance(volume: GridTable, point: Any, normal: Any) -> list[Any]:
    """Kernel: what the world adds to open water's irradiance of planes, by channel; zero outside the grid."""
    cells, shares, inside = cell_in(volume, point)
    # One of each axis's two sides faces the normal.
    sides = [dr.select(n >= 0, UInt32(axis), UInt32(axis + 3)) for axis, n in enumerate(normal)]
    squares = [dr.square(n) for n in normal]
    total = [Float32(0)] * 3
    for corner_of_cell in np.ndindex(2, 2, 2):
        weight = Float32(1)
        node = UInt32(0)
        for step, cell, share, count in zip(corner_of_cell, cells, shares, volume.count, strict=True):
            weight = weight * (share if step else 1 - share)
            node = node * UInt32(count) + UInt32(cell) + step
        for side, square in zip(sides, squares, strict=True):
            values = row_of(volume.values, node * len(SIDES) + side, ROW)
            total = [dr.fma(values[k], weight * square, total[k]) for k in range(3)]
    return [dr.select(inside, t, 0) for t in total]
