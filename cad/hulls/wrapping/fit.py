"""A wrap drawn back onto the surface that it holds, as far as it then still holds it and stays out of itself.

Two surfaces of triangles cross where an edge of one goes through a triangle of the other. As long as no edge does, a
closed surface that held another one before still holds it; that is asked after each step, of all edges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray

from cad.hulls.mesh_repair import NotClosedError, manifold, mesh_of
from cad.hulls.triangle_samples import Faces
from cad.hulls.wrapping.solid_field import OFFSET, Samples
from optics.kernels.arrays import FloatArray
from optics.kernels.crossings import MISSED, CrossedSurface
from optics.mesh import double_area_vectors

MOST_TRIANGLES = 60_000
"""That is tried for; up to twice as many are kept where fewer would cross each other, or the grid is made coarser."""
FIRST_TOLERANCE, LARGEST_TOLERANCE, COARSER = 0.02, 0.4, 1.5
"""By how much of a cell the wrap may move to have fewer triangles, from the first attempt to the last."""
GAP = 0.02
"""Where corners are drawn to: so much of a cell off the surface."""
REACH = 1.7
"""Corners further off than this many offsets span an opening and stay where they are."""
HALVINGS = 5
STEPS_BACK = 12
ROUNDING = 1e-6
"""Share of the diagonal."""
ENDS = 1e-4
"""Share of an edge at both ends that may touch its own surface."""
CANDIDATES = 4


@dataclass(frozen=True, kw_only=True)
class _Held:
    """The surface inside a wrap: its triangles, its edges' ends, and what edges are held against."""

    surface: CrossedSurface
    start: FloatArray
    end: FloatArray

    @classmethod
    def of(cls, samples: Samples) -> _Held:
        edges = edges_of(samples.faces)
        surface = CrossedSurface.of(samples.vertices, samples.faces)
        return cls(surface=surface, start=samples.vertices[edges[:, 0]], end=samples.vertices[edges[:, 1]])


def fitted(vertices: FloatArray, faces: Faces, samples: Samples, cell: float) -> trimesh.Trimesh | None:
    """Draw the corners of a wrap towards what it holds; each as far as no edge then crosses anything.

    How far each may go is found by halving its way `HALVINGS` times; corners whose combination does not do step back
    until it does. None where it needs more than twice `MOST_TRIANGLES`.
    """
    held = _Held.of(samples)
    simple = _simplified(vertices, faces, held, cell)
    if simple is None:
        return None
    vertices, faces = simple
    edges = edges_of(faces)
    way = _ways(vertices, samples, cell)
    reached, least, share = np.zeros(len(vertices)), np.ones(len(vertices)), np.ones(len(vertices))
    for _ in range(HALVINGS):
        wrong = _crossing(vertices + share[:, np.newaxis] * way, faces, edges, held)
        reached[~wrong], least[wrong] = share[~wrong], share[wrong]
        if not wrong.any():
            break
        share = np.where(reached < least, (reached + least) / 2, reached)
    share = reached
    for step in range(STEPS_BACK):
        placed = vertices + share[:, np.newaxis] * way
        wrong = _crossing(placed, faces, edges, held)
        if not wrong.any():
            return trimesh.Trimesh(placed, faces, process=False)
        share[wrong] *= 0.5 if step < STEPS_BACK / 2 else 0.0
    return trimesh.Trimesh(vertices, faces, process=False)


def edges_of(faces: Faces) -> Faces:
    """Edges of triangles, each once, shape (n, 2)."""
    sides = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    count = int(sides.max()) + 1
    keys = np.unique(sides[:, 0] * count + sides[:, 1])
    return np.stack([keys // count, keys % count], axis=1)


def check_that_it_stays_out_of_itself(surface: trimesh.Trimesh) -> None:
    """Refuse a surface that runs through itself.

    Raises
    ------
    NotClosedError
        With the number of edges that go through one of its triangles.
    """
    vertices, faces = np.asarray(surface.vertices), np.asarray(surface.faces, dtype=np.int64)
    edges, through = _through_itself(vertices, faces, edges_of(faces), CrossedSurface.of(vertices, faces))
    corners = vertices[faces[through]]
    normals = double_area_vectors(corners)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    heights = np.einsum("ijk,ik->ij", vertices[edges] - corners[:, :1], normals)
    # What stands out by less is single precision, or two sides that touch.
    deep = np.abs(heights).min(axis=1) > ROUNDING * float(np.linalg.norm(np.ptp(vertices, axis=0)))
    if deep.any():
        raise NotClosedError(f"{int(deep.sum()):,} of its edges going through itself")


def nearest_places(samples: Samples, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Nearest places of the sampled surface, shape (n, 3), and how far they are; exact on the triangles looked at."""
    _, near = samples.tree.query(points, CANDIDATES)
    nearest, distance = np.empty_like(points), np.full(len(points), np.inf)
    for candidate in range(CANDIDATES):
        triangles = samples.vertices[samples.faces[samples.owners[near[:, candidate]]]]
        found = trimesh.triangles.closest_point(triangles, points)
        away = np.linalg.norm(found - points, axis=1)
        nearest = np.where((away < distance)[:, np.newaxis], found, nearest)
        distance = np.minimum(away, distance)
    return nearest, distance


def _ways(vertices: FloatArray, samples: Samples, cell: float) -> FloatArray:
    """From each corner of a wrap to where it is drawn: just off the nearest place, or nowhere."""
    nearest, distance = nearest_places(samples, vertices)
    near = (distance < REACH * OFFSET * cell) & (distance > GAP * cell)
    share = np.where(near, 1 - GAP * cell / np.maximum(distance, GAP * cell), 0.0)
    return np.asarray(share[:, np.newaxis] * (nearest - vertices))


def _simplified(vertices: FloatArray, faces: Faces, held: _Held, cell: float) -> tuple[FloatArray, Faces] | None:
    """Fewer triangles for a wrap that still holds its surface and stays out of itself; None where too many are left."""
    body = manifold(vertices, faces)
    assert body is not None
    found, tolerance = (vertices, faces), FIRST_TOLERANCE * cell
    while len(found[1]) > MOST_TRIANGLES and tolerance <= LARGEST_TOLERANCE * cell:
        body = body.simplify(tolerance)
        tolerance *= COARSER
        if body.num_tri() <= 2 * MOST_TRIANGLES:
            fewer = mesh_of(body)
            corners, triangles = np.array(fewer.vertices), np.array(fewer.faces, dtype=np.int64)
            if not _crossing(corners, triangles, edges_of(triangles), held).any():
                found = corners, triangles
    return found if len(found[1]) <= 2 * MOST_TRIANGLES else None


def _crossing(vertices: FloatArray, faces: Faces, edges: Faces, held: _Held) -> NDArray[np.bool_]:
    """Corners of a wrap whose edges or triangles cross what it holds, or the wrap itself; shape (n,)."""
    wrong = np.zeros(len(vertices), dtype=bool)
    wrong[edges[held.surface.first(vertices[edges[:, 0]], vertices[edges[:, 1]]) != MISSED]] = True
    own = CrossedSurface.of(vertices, faces)
    through = own.first(held.start, held.end)
    wrong[faces[through[through != MISSED]]] = True
    across, crossed = _through_itself(vertices, faces, edges, own)
    wrong[across] = True
    wrong[faces[crossed]] = True
    return wrong


def _through_itself(vertices: FloatArray, faces: Faces, edges: Faces, own: CrossedSurface) -> tuple[Faces, Faces]:
    """Edges that go through triangles of their own surface, and these; a triangle at one of its ends does not count."""
    start, end = vertices[edges[:, 0]], vertices[edges[:, 1]]
    inset = ENDS * (end - start)
    face = own.first(start + inset, end - inset)
    hit = np.flatnonzero(face != MISSED)
    at_an_end = (faces[face[hit]][:, :, np.newaxis] == edges[hit][:, np.newaxis, :]).any(axis=(1, 2))
    hit = hit[~at_an_end]
    return edges[hit], face[hit]
