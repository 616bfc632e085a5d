"""Triangles without what lies in a convex body: openings in surfaces that need not be closed."""

from __future__ import annotations

import manifold3d
import numpy as np
import trimesh
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray
from optics.mesh import double_area_vectors

FINEST = 1 / 200
"""Share of the body's longest side: triangles on its skin are quartered until they are no longer than that."""
BATCH = 1_000


def outside_of(surface: trimesh.Trimesh, body: manifold3d.Manifold) -> trimesh.Trimesh:
    """Part of a surface that is outside of a convex body, less a rim no wider than `FINEST` of the body.

    Triangles that lie on both sides are quartered again and again. What is small and still on both sides is left out:
    nothing that is kept reaches into the body.
    """
    normals, heights = _planes(body)
    low, high = np.array(body.bounding_box()).reshape(2, 3)
    finest = FINEST * float((high - low).max())
    undecided = np.asarray(surface.vertices, dtype=np.float64)[np.asarray(surface.faces, dtype=np.int64)]
    kept = []
    while len(undecided):
        near = (undecided.min(axis=1) <= high).all(axis=1) & (undecided.max(axis=1) >= low).all(axis=1)
        kept.append(undecided[~near])
        undecided = undecided[near]
        beyond, within = _sides(undecided, normals, heights)
        kept.append(undecided[beyond])
        undecided = undecided[~beyond & ~within]
        sides = np.linalg.norm(undecided - np.roll(undecided, 1, axis=1), axis=2)
        undecided = _quartered(undecided[sides.max(axis=1, initial=0) > finest])
    corners, owner = np.unique(np.concatenate(kept).reshape(-1, 3), axis=0, return_inverse=True)
    return trimesh.Trimesh(corners, owner.reshape(-1, 3), process=False)


def _planes(body: manifold3d.Manifold) -> tuple[FloatArray, FloatArray]:
    """Outward normals of a convex body's faces, shape (n, 3), and the heights of their planes along them."""
    mesh = body.to_mesh64()
    corners = np.asarray(mesh.vert_properties)[:, :3][np.asarray(mesh.tri_verts)]
    across = double_area_vectors(corners)
    length = np.linalg.norm(across, axis=1)
    normals = across[length > 0] / length[length > 0, np.newaxis]
    return normals, np.einsum("ij,ij->i", normals, corners[length > 0, 0])


def _sides(triangles: FloatArray, normals: FloatArray, heights: FloatArray) -> tuple[NDArray[np.bool_], ...]:
    """Whether triangles are in front of one of a convex body's planes, and whether behind all of them."""
    beyond, within = np.zeros(len(triangles), dtype=bool), np.zeros(len(triangles), dtype=bool)
    for start in range(0, len(triangles), BATCH):
        batch = slice(start, start + BATCH)
        above = triangles[batch] @ normals.T - heights
        beyond[batch] = (above.min(axis=1) >= 0).any(axis=1)
        within[batch] = above.max(axis=(1, 2)) <= 0
    return beyond, within & ~beyond


def _quartered(triangles: FloatArray) -> FloatArray:
    middles = (triangles + np.roll(triangles, -1, axis=1)) / 2
    a, b, c = np.moveaxis(triangles, 1, 0)
    ab, bc, ca = np.moveaxis(middles, 1, 0)
    quarters = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
    return np.concatenate([np.stack(quarter, axis=1) for quarter in quarters])
