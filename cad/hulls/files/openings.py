"""Where a surface is open, crowded or in several pieces: said, not judged."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from cad.hulls.files.found import Faces, FoundHull
from cad.hulls.mesh_repair import welded
from optics.kernels.arrays import FloatArray


@dataclass(frozen=True, kw_only=True)
class Openings:
    """How a surface hangs together.

    Attributes
    ----------
    pieces : int
        Parts of it that share no corner.
    holes : int
        Connected runs of open edges: edges of one triangle only.
    open_length : float
        Their length together, in the unit of the corners.
    crowded_edges : int
        Edges of more than two triangles.
    """

    pieces: int
    holes: int
    open_length: float
    crowded_edges: int

    @property
    def closed(self) -> bool:
        """Whether each edge has two triangles."""
        return not self.holes and not self.crowded_edges


def openings(found: FoundHull) -> Openings:
    """How a file's surface hangs together when corners in one place are one; lengths in the file's numbers."""
    return surface_openings(*welded(found.vertices, found.faces))


def surface_openings(vertices: FloatArray, faces: Faces) -> Openings:
    """How a surface hangs together, by its corners' numbers."""
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    numbers, counts = np.unique(edges[:, 0] * len(vertices) + edges[:, 1], return_counts=True)
    rims = np.stack(np.divmod(numbers[counts == 1], len(vertices)), axis=1)
    return Openings(
        # Two sides of a triangle already join its corners.
        pieces=_parts(edges[: 2 * len(faces)], len(vertices)),
        holes=_parts(rims, len(vertices)),
        open_length=float(np.linalg.norm(vertices[rims[:, 0]] - vertices[rims[:, 1]], axis=1).sum()),
        crowded_edges=int((counts > 2).sum()),
    )


def _parts(edges: Faces, corners: int) -> int:
    """How many connected parts there are among the corners that edges use."""
    used = np.zeros(corners, dtype=bool)
    used[edges.reshape(-1)] = True
    graph = coo_array((np.ones(len(edges), dtype=bool), (edges[:, 0], edges[:, 1])), shape=(corners, corners))
    return int(connected_components(graph, directed=False)[0]) - int((~used).sum())
