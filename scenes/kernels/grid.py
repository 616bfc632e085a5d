"""A grid of points over a mesh of the world, at which its light is known, and where a point lies in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.kernels.backend import Float32, dr
from optics.kernels.packing import opaque_numbers
from scenes.stage.group_mesh import GroupMesh, used_vertices

ABOVE_M = 3.0
"""Water above a mesh that the grid spans: there a floor still lights what swims, and what the water scatters."""

HIGHEST_M = -0.05
"""The grid stays below the surface."""


def grid_axes(mesh: GroupMesh, *, spacing_m: float, most: int, inset_m: float = 0.0) -> list[FloatArray]:
    """Places along x, y and z: a spacing apart, or farther where there would be more than `most`.

    They span the mesh, but for an inset on all sides, and the water above it. What is thin is given a spacing: a floor
    above it, a wall to both sides.
    """
    used = used_vertices(mesh)
    lowest, highest = used.min(axis=0) + inset_m, used.max(axis=0) - inset_m
    highest[2] = max(min(highest[2] + ABOVE_M, HIGHEST_M), lowest[2] + spacing_m)
    thin = np.maximum(spacing_m - (highest - lowest), 0) / 2
    lowest, highest = lowest - thin, highest + thin
    counts = np.clip(np.ceil((highest - lowest) / spacing_m).astype(int) + 1, 2, most)
    return [np.linspace(a, b, n) for a, b, n in zip(lowest, highest, counts, strict=True)]


def grid_points(axes: list[FloatArray]) -> FloatArray:
    """All points, shape (n, 3); z runs fastest."""
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


@dataclass(frozen=True, kw_only=True)
class GridTable:
    """Values at the points of a grid, as kernels look them up.

    Attributes
    ----------
    values : Float32
        Rows of numbers, flat.
    corner, inverse_step, count : list of Float32
        By axis: its first node, nodes per metre, and how many there are.
    """

    values: Any
    corner: list[Any]
    inverse_step: list[Any]
    count: list[Any]

    @classmethod
    def of(cls, axes: list[FloatArray], values: Any) -> GridTable:
        """Table of values on the axes of a grid."""
        return cls(
            values=values,
            corner=opaque_numbers([axis[0] for axis in axes]),
            inverse_step=opaque_numbers([1 / (axis[1] - axis[0]) for axis in axes]),
            count=opaque_numbers([len(axis) for axis in axes]),
        )


def cell_in(grid: GridTable, point: Any) -> tuple[list[Any], list[Any], Any]:
    """Kernel: first node of the cell and share towards its next one along each axis, and whether a point is inside.

    Outside it is that of the nearest point of the grid; half a cell beside it still counts as inside.
    """
    cells, shares, inside = [], [], True
    for p, corner, inverse, count in zip(point, grid.corner, grid.inverse_step, grid.count, strict=True):
        position = (p - corner) * inverse
        inside = inside & (position >= -0.5) & (position <= count - 0.5)
        cell = dr.clip(dr.floor(position), 0, count - 2)
        cells.append(cell)
        shares.append(dr.clip(position - cell, 0, 1))
    return cells, shares, inside


def beside_grid_m(grid: GridTable, point: Any) -> Any:
    """Kernel: distance of points from the grid's box, zero within it."""
    total = Float32(0)
    for p, corner, inverse, count in zip(point, grid.corner, grid.inverse_step, grid.count, strict=True):
        total = total + dr.square(dr.maximum(dr.maximum(corner - p, p - (corner + (count - 1) / inverse)), 0))
    return dr.sqrt(total)
