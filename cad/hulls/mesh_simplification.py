"""Fewer triangles for a surface, and how far that moved it."""

from __future__ import annotations

import fast_simplification
import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import KDTree

from cad.hulls.mesh_repair import welded
from cad.hulls.triangle_samples import lattice
from optics.kernels.arrays import FloatArray

MOST_TRIANGLES = 200_000
MOST_AT_ONCE = 1_500_000
"""Quadrics of a million triangles take half a gigabyte."""
FIRST_GRID = 2**12
SAMPLES = 20_000
NEIGHBOURS = 12
STEPS_ACROSS = 500


def decimated(surface: trimesh.Trimesh, most: int | None = None) -> trimesh.Trimesh:
    """At most `most` triangles (`MOST_TRIANGLES`) for a surface, open or closed.

    Edges are collapsed where that moves it least.

    M. Garland and P. S. Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH 1997.
    """
    most = MOST_TRIANGLES if most is None else most
    if len(surface.faces) <= most:
        return surface
    vertices, faces = _thinned(np.asarray(surface.vertices), np.asarray(surface.faces, dtype=np.int64))
    fewer = 1 - most / len(faces)
    corners, triangles = fast_simplification.simplify(
        vertices.astype(np.float32), faces.astype(np.int32), target_reduction=float(np.clip(fewer, 0, 1))
    )
    return trimesh.Trimesh(*welded(corners, np.asarray(triangles, dtype=np.int64)), process=False)


def _thinned(vertices: FloatArray, faces: NDArray[np.int64]) -> tuple[FloatArray, NDArray[np.int64]]:
    """Join neighbouring corners of a mesh until it has at most `MOST_AT_ONCE` triangles.

    What was closed stays closed: for each side that a triangle loses, its neighbour loses the same.
    """
    coarse, kept, grid = vertices, faces, FIRST_GRID
    while len(kept) > MOST_AT_ONCE:
        coarse, kept = welded(vertices, faces, grid=grid)
        grid //= 2
    return coarse, kept


def surface_distance(first: trimesh.Trimesh, second: trimesh.Trimesh) -> float:
    """Largest distance between two surfaces, sampled both ways (Hausdorff's, from below by the sampling)."""
    return max(_one_way(first, second), _one_way(second, first))


def _one_way(source: trimesh.Trimesh, target: trimesh.Trimesh) -> float:
    """Largest distance of samples of one surface from another.

    The candidates for the nearest triangle are those with the nearest places on a lattice. A wrong candidate can only
    make the distance larger.
    """
    vertices, faces = np.asarray(target.vertices), np.asarray(target.faces)
    places, owners = lattice(vertices, faces, float(np.linalg.norm(target.extents)) / STEPS_ACROSS)
    samples = _samples(source)
    _, nearest = KDTree(places, balanced_tree=False, compact_nodes=False).query(samples, NEIGHBOURS)
    best = np.full(len(samples), np.inf)
    for candidate in range(NEIGHBOURS):
        triangles = vertices[faces[owners[nearest[:, candidate]]]]
        closest = trimesh.triangles.closest_point(triangles, samples)
        best = np.minimum(best, np.linalg.norm(closest - samples, axis=1))
    return float(best.max())


def _samples(mesh: trimesh.Trimesh) -> FloatArray:
    """Corners and middles of triangles, evenly chosen among them."""
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    corners = vertices[:: max(1, len(vertices) // (SAMPLES // 2))]
    middles = vertices[faces[:: max(1, len(faces) // (SAMPLES // 2))]].mean(axis=1)
    return np.concatenate([corners, middles])
