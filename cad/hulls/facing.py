"""Triangles turned so that their fronts look outwards, as far as a surface with holes has an outside."""

from __future__ import annotations

import igl
import numpy as np
from numpy.typing import NDArray

from cad.hulls.triangle_samples import Faces
from optics.kernels.arrays import FloatArray
from optics.kernels.crossings import MISSED, CrossedSurface
from optics.mesh import double_area_vectors

PLACES_OF_A_PATCH = 24
RAYS_OF_A_PLACE = 8
OFF_THE_SURFACE = 1e-4
"""Share of the diagonal."""


def faced_outwards(vertices: FloatArray, faces: Faces) -> Faces:
    """Turn each patch so that its front sees more of the open than its back.

    A patch is what hangs together by edges of two triangles. A patch that is in the dark on both sides faces as most
    of its triangles do.

    Parameters
    ----------
    vertices : array, shape (n, 3)
    faces : array, shape (m, 3)
    """
    alike, patch = igl.bfs_orient(faces)
    score = _openness(vertices, alike, patch)
    as_given = np.bincount(patch, np.where((alike == faces).all(axis=1), 1, -1))
    turned = (score < 0) | ((score == 0) & (as_given < 0))
    return np.asarray(np.where(turned[patch][:, np.newaxis], alike[:, ::-1], alike))


def _openness(vertices: FloatArray, faces: Faces, patch: NDArray[np.int64]) -> FloatArray:
    """By how many more rays get out in front of each patch than behind it."""
    rng = np.random.default_rng(0)
    corners = vertices[faces]
    across = double_area_vectors(corners)
    area = np.linalg.norm(across, axis=1)
    # Exponential races of the triangles of a patch: larger ones win more often.
    race = np.where(area > 0, rng.exponential(size=len(faces)) / np.where(area > 0, area, 1), np.inf)
    order = np.lexsort((race, patch))
    counts = np.bincount(patch)
    rank = np.arange(len(faces)) - (np.cumsum(counts) - counts)[patch[order]]
    chosen = order[(rank < PLACES_OF_A_PATCH) & (area[order] > 0)]
    normals = across[chosen] / area[chosen, np.newaxis]
    ways = rng.normal(size=(len(chosen), RAYS_OF_A_PLACE, 3))
    ways *= np.sign(np.einsum("ijk,ik->ij", ways, normals))[:, :, np.newaxis]
    ways /= np.linalg.norm(ways, axis=2, keepdims=True)
    diagonal = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    surface, score = CrossedSurface.of(vertices, faces), np.zeros(len(counts))
    for side in (1, -1):
        places = corners[chosen].mean(axis=1) + side * OFF_THE_SURFACE * diagonal * normals
        start = np.repeat(places, RAYS_OF_A_PLACE, axis=0)
        out = surface.first(start, start + side * 2 * diagonal * ways.reshape(-1, 3)) == MISSED
        score += side * np.bincount(np.repeat(patch[chosen], RAYS_OF_A_PLACE), out, minlength=len(counts))
    return score
