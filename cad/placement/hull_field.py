"""A hull's surroundings as a grid of signed distances: thousands of candidate places are judged by it in one look.

The grid answers to within its step; what is chosen is built and checked on the solids afterwards.
"""

from __future__ import annotations

from dataclasses import dataclass

import manifold3d
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, label, map_coordinates

from optics.kernels.arrays import FloatArray

LARGEST_GRID = 6_000_000
"""Cells; the step grows with the hull until there are no more."""
FINEST_STEP_MM = 4.0


@dataclass(frozen=True, kw_only=True)
class HullField:
    """Signed distances around a hull, in the frame that its solid is given in, millimetres.

    Attributes
    ----------
    origin_mm : array, shape (3,)
        Centre of the first cell.
    step_mm : float
        Edge of a cell.
    inside : array of bool, shape (nx, ny, nz)
        Cells whose centre is in the hull.
    distance_mm : array, shape (nx, ny, nz)
        From the centre of each cell to the hull's surface, negative inside; good to half a step.
    """

    origin_mm: FloatArray
    step_mm: float
    inside: NDArray[np.bool_]
    distance_mm: NDArray[np.float32]

    def distances_mm(self, points_mm: FloatArray) -> FloatArray:
        """Distance of points from the hull, shape (...) for points of shape (..., 3); beyond the grid that of its edge.

        Linear between the cells.
        """
        cells = (np.asarray(points_mm) - self.origin_mm) / self.step_mm
        flat = cells.reshape(-1, 3).T
        found = map_coordinates(self.distance_mm, flat, order=1, mode="nearest", output=np.float64)
        return np.asarray(found.reshape(cells.shape[:-1]))

    def nearest_mm(self, points_mm: FloatArray) -> NDArray[np.float32]:
        """Distance at the nearest cell of points: coarser than `distances_mm`, and ten times as fast."""
        cells = np.rint((points_mm - self.origin_mm) / self.step_mm).astype(np.int32)
        cells = np.clip(cells, 0, np.array(self.inside.shape, dtype=np.int32) - 1)
        return np.asarray(self.distance_mm[cells[..., 0], cells[..., 1], cells[..., 2]])

    def axis(self, number: int) -> FloatArray:
        """Coordinates of the cells' centres along an axis, millimetres."""
        return np.asarray(self.origin_mm[number] + self.step_mm * np.arange(self.inside.shape[number]))

    def index(self, axis: int, value_mm: float) -> int:
        """Cell in which a coordinate lies, the nearest one of the grid beyond it."""
        cell = round((value_mm - self.origin_mm[axis]) / self.step_mm)
        return int(np.clip(cell, 0, self.inside.shape[axis] - 1))


def hull_field(hull: manifold3d.Manifold, low_mm: FloatArray, high_mm: FloatArray) -> HullField:
    """Distances around a closed hull within a box, millimetres.

    The hull is cut into slices across x, each filled by the even-odd rule, closed cavities are filled, and the
    distances are the exact Euclidean transform of the cells. The hull ends before the box does at its front.
    """
    size = np.asarray(high_mm) - low_mm
    step = max(FINEST_STEP_MM, float((size.prod() / LARGEST_GRID) ** (1 / 3)))
    counts = np.ceil(size / step).astype(int)
    origin = np.asarray(low_mm) + step / 2
    # The kernel slices across z: x takes its place.
    turned = hull.rotate((0.0, -90.0, 0.0))
    inside = np.zeros(tuple(counts), dtype=bool)
    for number, x in enumerate(origin[0] + step * np.arange(counts[0])):
        inside[number] = _filled(turned.slice(float(x)).to_polygons(), origin, step, counts)
    inside = _without_cavities(inside)
    outwards = distance_transform_edt(~inside) if not inside.all() else np.zeros(inside.shape)
    inwards = distance_transform_edt(inside) if inside.any() else np.zeros(inside.shape)
    # Centres on either side of the surface are half a step from it.
    distance = np.where(inside, 0.5 - inwards, outwards - 0.5) * step
    return HullField(origin_mm=origin, step_mm=step, inside=inside, distance_mm=distance.astype(np.float32))


def _without_cavities(inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Cells that no way leads to from in front of the hull are hull too: the inside of a hollow shell is no place."""
    regions, _ = label(~inside)
    ahead = np.unique(regions[-1])
    return np.asarray(~np.isin(regions, ahead[ahead > 0]))


def _filled(
    outlines: list[FloatArray], origin: FloatArray, step: float, counts: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Cells of one slice whose centres lie within its outlines, shape (ny, nz).

    Outlines are (-z, y) of the turned hull. Along each row of cells every crossing with an outline turns outside into
    inside and back.
    """
    if not outlines:
        return np.zeros((counts[1], counts[2]), dtype=bool)
    starts = np.concatenate([np.asarray(outline) for outline in outlines])
    ends = np.concatenate([np.roll(outline, -1, axis=0) for outline in outlines])
    row1, row2 = ((corners[:, 1] - origin[1]) / step for corners in (starts, ends))
    column1, column2 = ((-corners[:, 0] - origin[2]) / step for corners in (starts, ends))
    first = np.clip(np.ceil(np.minimum(row1, row2)), 0, counts[1]).astype(np.int64)
    last = np.clip(np.ceil(np.maximum(row1, row2)), 0, counts[1]).astype(np.int64)
    edge = np.repeat(np.arange(len(starts)), last - first)
    rows = first[edge] + np.arange(len(edge)) - np.repeat(np.cumsum(last - first) - (last - first), last - first)
    columns = column1[edge] + (rows - row1[edge]) / (row2 - row1)[edge] * (column2 - column1)[edge]
    crossings = np.zeros((counts[1], counts[2] + 1), dtype=np.int64)
    np.add.at(crossings, (rows, np.clip(np.ceil(columns), 0, counts[2]).astype(np.int64)), 1)
    return np.asarray(np.cumsum(crossings, axis=1)[:, :-1] % 2 == 1)
