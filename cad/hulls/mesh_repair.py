"""Triangles from anywhere made into one closed surface with outward normals, or a reason why not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import manifold3d
import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from optics.kernels.arrays import FloatArray

Faces = NDArray[np.int64]
GRID = 2**20
"""Corners that fall into one of so many steps along the longest side are one: 1.6 um of 1.6 m."""
CRACK = 1e-4
"""Open edges this near to each other, as a share of the mesh's diagonal, are a crack to be joined, not a hole."""
SMALL_HOLE = 0.1
"""Longest rim of a hole that is closed, as a share of the mesh's diagonal."""
SURFACE_SAMPLES = 200
"""Places at which a surface is asked whether it runs through itself."""
CORNERS_OF_A_SHELL = 20
WINDING_BATCH = 50_000


@dataclass(frozen=True, kw_only=True)
class Repaired:
    """A closed surface, and what was done to make it one.

    Attributes
    ----------
    surface : Trimesh
        The surface, in the unit of the corners it was made from.
    notes : tuple of str
        Sentences; empty when there was nothing to do.
    """

    surface: trimesh.Trimesh
    notes: tuple[str, ...]


def welded(
    vertices: NDArray[np.floating[Any]], faces: Faces, *, scale: float = 1.0, grid: int = GRID
) -> tuple[FloatArray, Faces]:
    """Join corners in one place; drop the triangles that then have fewer than three, and corners nobody uses.

    Parameters
    ----------
    vertices : array, shape (n, 3)
        Corners, in single or double precision.
    faces : array, shape (m, 3)
        Indices into them.
    scale : float
        What a length is multiplied with.
    grid : int
        How many steps the longest side has; corners in one of them are one.

    Raises
    ------
    ValueError
        When a corner is no place or no triangle is left; the message says "expected ..., got ...".
    """
    low, high = vertices.min(axis=0).astype(np.float64), vertices.max(axis=0).astype(np.float64)
    if not (np.isfinite(low).all() and np.isfinite(high).all()):
        wrong = int((~np.isfinite(vertices)).any(axis=1).sum())
        raise ValueError(f"expected finite corners, got {wrong} of {len(vertices)} that are not a number or infinite")
    step = max(float((high - low).max()), np.finfo(np.float64).tiny) / grid
    cells = np.zeros(len(vertices), dtype=np.int64)
    for axis in range(3):
        cells = cells * (2 * GRID) + np.round((vertices[:, axis] - low[axis]) / step).astype(np.int64)
    _, first, owner = np.unique(cells, return_index=True, return_inverse=True)
    faces = owner[faces]
    faces = faces[_distinct(faces)]
    if not len(faces):
        raise ValueError("expected triangles, got none that has an area")
    return scale * vertices[first].astype(np.float64), faces


def repaired(vertices: FloatArray, faces: Faces) -> Repaired:
    """Make one closed surface of triangles that have been welded.

    Triangles given twice are dropped, cracks joined, small holes closed, triangles turned the same way, shells turned
    outwards and overlapping shells united.

    Parameters
    ----------
    vertices : array, shape (n, 3)
        Corners, millimetres.
    faces : array, shape (m, 3)
        Indices into them.

    Raises
    ------
    ValueError
        When that does not make it closed; the message says "expected ..., got ...".
    """
    notes: list[str] = []
    body = manifold(vertices, faces)
    if body is None:
        faces = _without_copies(faces, notes)
        diagonal = float(np.linalg.norm(np.ptp(vertices, axis=0)))
        rims = _rims(faces, len(vertices))
        if len(rims):
            faces = _without_cracks(vertices, faces, rims, CRACK * diagonal, notes)
        faces = _turned_alike(faces, len(vertices), notes)
        vertices, faces = _without_small_holes(vertices, faces, SMALL_HOLE * diagonal, notes)
        body = manifold(vertices, faces)
    if body is None:
        raise ValueError(
            "expected edges with two triangles each, got some with more: inner walls, or sheets that touch"
        )
    return Repaired(surface=mesh_of(_united(body, notes)), notes=tuple(notes))


def mesh_of(body: manifold3d.Manifold) -> trimesh.Trimesh:
    """Triangles of a closed surface."""
    mesh = body.to_mesh64()
    return trimesh.Trimesh(
        np.array(mesh.vert_properties[:, :3]), np.asarray(mesh.tri_verts, dtype=np.int64), process=False
    )


def _distinct(faces: Faces) -> NDArray[np.bool_]:
    return np.asarray((faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0]))


def _without_copies(faces: Faces, notes: list[str]) -> Faces:
    """Drop triangles that are there twice, whichever way round."""
    _, first = np.unique(_row_keys(np.sort(faces, axis=1)), return_index=True)
    if len(first) == len(faces):
        return faces
    notes.append(f"dropped {_count(len(faces) - len(first), 'triangle')} given twice")
    return faces[np.sort(first)]


def _row_keys(rows: Faces) -> NDArray[np.uint64]:
    """One number for each row of three; distinct but for a chance of one in 2^64 or so per pair."""
    keys = np.zeros(len(rows), dtype=np.uint64)
    for column in range(3):
        keys = (keys ^ rows[:, column].astype(np.uint64)) * np.uint64(0x9E3779B97F4A7C15)
        keys = keys ^ (keys >> np.uint64(29))
    return keys


def _half_edges(faces: Faces) -> tuple[Faces, Faces]:
    """Start and end of each triangle's three sides, one after the other; shape (3 m,)."""
    return faces.reshape(-1), faces[:, [1, 2, 0]].reshape(-1)


def _rims(faces: Faces, count: int) -> Faces:
    """Sides that have no partner, whichever way round: positions among the half edges."""
    start, end = _half_edges(faces)
    keys = np.minimum(start, end) * count + np.maximum(start, end)
    _, first, uses = np.unique(keys, return_index=True, return_counts=True)
    return np.asarray(first[uses == 1])


def _without_cracks(vertices: FloatArray, faces: Faces, rims: Faces, width: float, notes: list[str]) -> Faces:
    """Join corners of open edges that are nearer to each other than a crack is wide."""
    start, end = _half_edges(faces)
    corners = np.unique(np.concatenate([start[rims], end[rims]]))
    pairs = KDTree(vertices[corners]).query_pairs(width, output_type="ndarray")
    if not len(pairs):
        return faces
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(corners), len(corners)))
    groups, group = connected_components(links, directed=False)
    representative = np.zeros(groups, dtype=np.int64)
    representative[group] = corners
    owner = np.arange(len(vertices))
    owner[corners] = representative[group]
    joined = owner[faces]
    joined = joined[_distinct(joined)]
    closed = len(rims) - len(_rims(joined, len(vertices)))
    if closed > 0:
        notes.append(f"joined cracks along {_count(closed, 'edge')}")
    return joined


def _turned_alike(faces: Faces, count: int, notes: list[str]) -> Faces:
    """Turn triangles so that neighbours run along their common edge in opposite directions.

    Each triangle stands twice in a graph, as it is and turned; an edge links the states of its two triangles that fit.
    A surface with two sides falls into two halves, and either is a consistent choice.
    """
    start, end = _half_edges(faces)
    directed = start * count + end
    if len(np.unique(directed)) == len(directed):
        return faces
    order = np.argsort(np.minimum(start, end) * count + np.maximum(start, end), kind="stable")
    low, high = np.minimum(start, end)[order], np.maximum(start, end)[order]
    same = (low[1:] == low[:-1]) & (high[1:] == high[:-1])
    crowded = same[1:] & same[:-1]
    if crowded.any():
        raise ValueError(
            f"expected edges with two triangles each, got {int(crowded.sum())} with more: inner walls, or sheets that "
            "touch along an edge"
        )
    first, second = order[:-1][same], order[1:][same]
    turned = (start[first] == start[second]).astype(np.int64)
    one, other, total = first // 3, second // 3, len(faces)
    rows = np.concatenate([one, one + total])
    columns = np.concatenate([other + turned * total, other + (1 - turned) * total])
    graph = coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(2 * total, 2 * total))
    _, state = connected_components(graph, directed=False)
    if (state[:total] == state[total:]).any():
        raise ValueError(
            "expected a surface with an inside and an outside, got one with a single side (a Möbius strip)"
        )
    as_it_is = state[:total] < state[total:]
    if np.count_nonzero(as_it_is) * 2 < total:
        as_it_is = ~as_it_is
    notes.append(f"turned {_count(int(np.count_nonzero(~as_it_is)), 'triangle')} that faced the other way")
    return np.where(as_it_is[:, np.newaxis], faces, faces[:, ::-1])


def _without_small_holes(
    vertices: FloatArray, faces: Faces, longest: float, notes: list[str]
) -> tuple[FloatArray, Faces]:
    """Close each small hole with a fan of triangles around the middle of its rim."""
    start, end = _half_edges(faces)
    rims = _rims(faces, len(vertices))
    loops = _loops(start[rims], end[rims])
    lengths = [float(np.linalg.norm(vertices[loop] - vertices[np.roll(loop, -1)], axis=1).sum()) for loop in loops]
    large = [length for length in lengths if length > longest]
    if large:
        raise ValueError(
            f"expected a closed surface, got {_count(len(large), 'hole')} with {sum(large):.0f} mm of open edge "
            f"in all; up to {longest:.0f} mm each would be closed"
        )
    if not loops:
        return vertices, faces
    middles = np.array([vertices[loop].mean(axis=0) for loop in loops])
    fans = []
    for position, loop in enumerate(loops):
        if len(loop) == 3:
            fans.append(loop[::-1].reshape(1, 3))
            continue
        middle = np.full(len(loop), len(vertices) + position)
        fans.append(np.column_stack([np.roll(loop, -1), loop, middle]))
    notes.append(f"closed {_count(len(loops), 'hole')}, the longest rim {max(lengths):.1f} mm")
    return np.concatenate([vertices, middles]), np.concatenate([faces, *fans])


def _loops(start: Faces, end: Faces) -> list[Faces]:
    """Closed walks along open edges."""
    onward: dict[int, list[int]] = {}
    for here, there in zip(start.tolist(), end.tolist(), strict=True):
        onward.setdefault(here, []).append(there)
    loops = []
    while onward:
        begin, here = next(iter(onward)), None
        loop = []
        while here != begin:
            here = begin if here is None else here
            loop.append(here)
            if here not in onward:
                raise ValueError("expected holes with closed rims, got one that ends: sheets meet along an edge")
            following = onward[here].pop()
            if not onward[here]:
                del onward[here]
            here = following
        loops.append(np.array(loop, dtype=np.int64))
    return loops


def _united(body: manifold3d.Manifold, notes: list[str]) -> manifold3d.Manifold:
    """One body of the closed shells: those with an inside united, the cavities taken out of them."""
    if body.volume() < 0:
        notes.append("turned the surface inside out: its normals pointed inwards")
        body = _turned(body)
    shells = body.decompose()
    if len(shells) == 1:
        return body
    solid = manifold3d.Manifold.batch_boolean([s for s in shells if s.volume() > 0], manifold3d.OpType.Add)
    outside = [s for s in shells if s.volume() < 0 and not _inside(s, solid)]
    if outside:
        notes.append(f"turned {_count(len(outside), 'shell')} with normals that pointed inwards")
    outward = [_turned(shell) for shell in outside]
    for shell in shells:
        if shell.volume() < 0 and shell not in outside:
            solid = solid - _turned(shell)
    solid = manifold3d.Manifold.batch_boolean([solid, *outward], manifold3d.OpType.Add)
    pieces = sum(piece.volume() > 0 for piece in solid.decompose())
    if pieces != 1:
        raise ValueError(f"expected one body, got {pieces} that do not touch")
    notes.append(f"united {_count(len(shells), 'shell')}")
    return solid


def manifold(vertices: FloatArray, faces: Faces) -> manifold3d.Manifold | None:
    """Body of triangles; None when they do not close it, each edge between two that run along it both ways."""
    mesh = manifold3d.Mesh64(np.ascontiguousarray(vertices), np.ascontiguousarray(faces).view(np.uint64))
    body = manifold3d.Manifold(mesh)
    return body if body.status() == manifold3d.Error.NoError else None


def _turned(body: manifold3d.Manifold) -> manifold3d.Manifold:
    """The same surface with its normals the other way."""
    mesh = mesh_of(body)
    turned = manifold(np.asarray(mesh.vertices), np.asarray(mesh.faces)[:, ::-1])
    assert turned is not None
    return turned


def _inside(shell: manifold3d.Manifold, solid: manifold3d.Manifold) -> bool:
    """Whether a shell lies inside a body as a whole: one that only reaches into it is no cavity."""
    corners = np.asarray(mesh_of(shell).vertices)
    looked_at = corners[:: max(1, len(corners) // CORNERS_OF_A_SHELL)]
    return bool((winding_numbers(mesh_of(solid), looked_at) > 0.5).all())


def check_that_it_stays_out_of_itself(mesh: trimesh.Trimesh) -> None:
    """Refuse a surface that runs through itself: beside a good one the winding number is 0 on the outside.

    It is looked at in 200 places, so what is less than a hundredth of the surface is likely to be missed.

    Raises
    ------
    ValueError
        With the share of the surface that lies inside the rest of it.
    """
    rng = np.random.default_rng(0)
    weights = np.asarray(mesh.area_faces) / mesh.area
    chosen = rng.choice(len(mesh.faces), SURFACE_SAMPLES, p=weights)
    step = 1e-6 * float(np.linalg.norm(mesh.extents))
    places = np.asarray(mesh.triangles_center)[chosen] + step * np.asarray(mesh.face_normals)[chosen]
    crossed = int((np.abs(winding_numbers(mesh, places)) > 0.25).sum())
    if crossed:
        share = 100 * crossed / SURFACE_SAMPLES
        raise ValueError(f"expected a surface that stays out of itself, got {share:g} % of it inside the rest of it")


def winding_numbers(mesh: trimesh.Trimesh, points: FloatArray) -> FloatArray:
    """How often a closed surface goes around points: 0 outside, 1 inside; shape (n,).

    A. Van Oosterom and J. Strackee, "The solid angle of a plane triangle", IEEE Trans. Biomed. Eng. 30(2), 1983.
    """
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    turns = np.zeros(len(points))
    for start in range(0, len(faces), WINDING_BATCH):
        corners = vertices[faces[start : start + WINDING_BATCH]]
        for position, point in enumerate(points):
            a, b, c = (corners[:, corner] - point for corner in range(3))
            la, lb, lc = (np.sqrt(np.einsum("ij,ij->i", side, side)) for side in (a, b, c))
            triple = np.einsum("ij,ij->i", a, np.cross(b, c))
            below = la * lb * lc + np.einsum("ij,ij->i", a, b) * lc
            below = below + np.einsum("ij,ij->i", b, c) * la + np.einsum("ij,ij->i", c, a) * lb
            turns[position] = turns[position] + 2 * np.arctan2(triple, below).sum()
    return turns / (4 * np.pi)


def _count(number: int, noun: str) -> str:
    return f"{number:,} {noun}{'' if number == 1 else 's'}"
