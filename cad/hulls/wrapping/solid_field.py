"""A field on a grid that is negative inside the solid around a surface: what the wrap is cut out of."""

from __future__ import annotations

import math
from dataclasses import dataclass

import igl
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import KDTree

from cad.hulls.facing import faced_outwards
from cad.hulls.triangle_samples import Faces, lattice
from cad.hulls.wrapping.winding import WindingGrid
from optics.kernels.arrays import FloatArray
from optics.mesh import double_area_vectors

MOST_NODES = 6_000_000
MOST_CELLS = 120_000
"""Of those that the surface goes through, about."""
CELLS_ALONG = 300
"""Cells of the finest grid along the longest side."""
SPACING = 0.5
"""Of the samples that stand for the surface, in cells: none of its places is further than 0.36 cells from one."""
OFFSET = 1.25
"""How far the first wrap lies off the samples, in cells. Any place of the surface then has the nearest corner of its
cell (0.87 cells away at most) inside."""
BAND = 4.0
"""How far distances are known, in cells."""
MARGIN = 6
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
"""Of a cell, in the order of libigl's marching cubes."""
INSIDE_TURNS = 0.5


@dataclass(frozen=True, kw_only=True)
class Samples:
    """Places that stand for a surface.

    Attributes
    ----------
    vertices : array, shape (n, 3)
    faces : array, shape (m, 3)
        Of the surface, their fronts outwards where that has a meaning.
    places, owners : arrays, shape (k, 3) and (k,)
        Places on it, and the triangle of each.
    tree : KDTree
        The places.
    """

    vertices: FloatArray
    faces: Faces
    places: FloatArray
    owners: Faces
    tree: KDTree


@dataclass(frozen=True, kw_only=True)
class SolidField:
    """Values at the nodes of a grid, negative inside, whose first node is at `low`; `cell` is its step."""

    low: FloatArray
    cell: float
    values: NDArray[np.float32]

    def nodes(self, numbers: NDArray[np.int64]) -> FloatArray:
        """Positions of nodes given by their indices, shape (n, 3)."""
        return np.asarray(self.low + self.cell * numbers)

    def surface(self) -> tuple[FloatArray, Faces]:
        """Corners and triangles where the field is zero, closed and without crossings, outward."""
        inside = (self.values < 0).view(np.int8)
        shape = np.array(inside.shape)
        windows = (tuple(slice(c, n - 1 + c) for c, n in zip(corner, shape, strict=True)) for corner in CORNERS)
        count = np.zeros(shape - 1, dtype=np.int8)
        for window in windows:
            count += inside[window]
        cells = np.argwhere((count > 0) & (count < len(CORNERS)))
        nodes = np.ravel_multi_index(tuple((cells[:, np.newaxis] + CORNERS).reshape(-1, 3).T), inside.shape)
        used, owners = np.unique(nodes, return_inverse=True)
        positions = self.nodes(np.stack(np.unravel_index(used, inside.shape), axis=1))
        values = self.values.ravel()[used].astype(np.float64)
        vertices, faces, _ = igl.marching_cubes(values, positions, owners.reshape(-1, len(CORNERS)), 0.0)
        return vertices, np.ascontiguousarray(faces)


def cell_of(vertices: FloatArray, faces: Faces) -> float:
    """Step of the grid for a surface: by its longest side, coarser where that would be too many cells or nodes."""
    size = np.ptp(vertices, axis=0)
    corners = vertices[faces]
    across = double_area_vectors(corners)
    area = float(np.linalg.norm(across, axis=1).sum()) / 2
    cell = max(float(size.max()) / CELLS_ALONG, math.sqrt(area / MOST_CELLS))
    while np.prod(size / cell + 2 * MARGIN + 2) > MOST_NODES:
        cell *= 1.02
    return cell


def samples_of(vertices: FloatArray, faces: Faces, cell: float) -> Samples:
    """Samples of a surface for a grid of a given step."""
    outward = faced_outwards(vertices, faces)
    places, owners = lattice(vertices, outward, SPACING * cell)
    tree = KDTree(places, balanced_tree=False, compact_nodes=False)
    return Samples(vertices=vertices, faces=outward, places=places, owners=owners, tree=tree)


def solid_field(samples: Samples, cell: float) -> SolidField:
    """Field whose inside holds the surface, what it winds around, and what water cannot reach.

    Inside is where the surface is nearer than `OFFSET` cells, where its winding number is above a half, and every room
    that a flood from without does not get into.
    """
    low = samples.vertices.min(axis=0) - MARGIN * cell
    shape = tuple(int(count) for count in np.ceil(np.ptp(samples.vertices, axis=0) / cell) + 2 * MARGIN + 1)
    distance = _distances(samples, low, cell, shape)
    turns = np.abs(_winding(samples, cell).at([low[axis] + cell * np.arange(shape[axis]) for axis in range(3)]))
    field = np.minimum(distance - OFFSET, BAND * (INSIDE_TURNS - turns)).astype(np.float32)
    rooms, _ = ndimage.label(field > 0)
    # No node is on the surface itself: its triangles would have no area.
    size = np.maximum(np.abs(field), np.float32(1e-3))
    return SolidField(low=low, cell=cell, values=np.where(rooms == rooms[0, 0, 0], size, -size))


def _distances(samples: Samples, low: FloatArray, cell: float, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Distance of each node from the samples in cells; `BAND` where it is more."""
    touched = np.zeros(shape, dtype=bool)
    touched[tuple(np.round((samples.places - low) / cell).astype(int).T)] = True
    near = ndimage.binary_dilation(touched, np.ones((3, 3, 3), dtype=bool), iterations=2)
    nodes = np.argwhere(near)
    found, _ = samples.tree.query(low + cell * nodes, distance_upper_bound=BAND * cell)
    distances = np.full(shape, BAND, dtype=np.float32)
    distances[near] = np.minimum(found / cell, BAND)
    return distances


def _winding(samples: Samples, cell: float) -> WindingGrid:
    corners = samples.vertices[samples.faces]
    areas = double_area_vectors(corners) / 2
    shares = np.bincount(samples.owners, minlength=len(samples.faces))
    return WindingGrid.of(samples.places, (areas / shares[:, np.newaxis])[samples.owners], 2 * cell)
