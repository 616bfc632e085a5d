"""Where light is gathered on a mesh: at one vertex of each cell and facing, which the others there share it with.

A screw head has as many vertices as a hull, and all of them lie within a pixel or two.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray
from optics.mesh import double_area_vectors
from scenes.stage.group_mesh import GroupMesh

FACINGS = 1.5
"""Normals are told apart by their components in steps of one over this number."""


@dataclass(frozen=True)
class Places:
    """Vertices that stand for others.

    Attributes
    ----------
    vertices : array of int, shape (k,)
        Where light is gathered.
    owner : array of int, shape (n,)
        Which of them each vertex of the mesh takes its share of open water's light from.
    """

    vertices: NDArray[np.int64]
    owner: NDArray[np.int64]


def places_on(vertices_m: FloatArray, normals: FloatArray, areas: FloatArray, apart_m: float) -> Places:
    """Places among vertices with normals, and the area around each: one in a cell of a grid, for those that face alike.

    It is the vertex with the largest faces: what is seen of a cell, not what lies in a hole of it.
    """
    cells = np.floor(vertices_m / apart_m).astype(np.int64)
    numbers = np.column_stack([cells, np.round(normals * FACINGS).astype(np.int64)])
    lowest = numbers.min(axis=0)
    key = np.ravel_multi_index((numbers - lowest).T, tuple(np.ptp(numbers, axis=0) + 1))
    order = np.lexsort([-areas, key])
    is_first = np.diff(key[order], prepend=-1) > 0
    owner = np.empty(len(key), dtype=np.int64)
    owner[order] = np.cumsum(is_first) - 1
    # In the order of the vertices: neighbours look at about the same.
    vertices = order[is_first]
    rank = np.argsort(np.argsort(vertices))
    return Places(np.sort(vertices), rank[owner])


def double_areas_around(mesh: GroupMesh) -> FloatArray:
    """Twice the area of the faces around each vertex, shape (n,)."""
    double = np.linalg.norm(double_area_vectors(np.take(mesh.vertices_m, mesh.faces, axis=0)), axis=1)
    return np.asarray(np.bincount(mesh.faces.ravel(), np.repeat(double, 3), minlength=len(mesh.vertices_m)))
