"""Triangles made into closed surfaces with outward normals where little is missing, or a reason why not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import igl
import manifold3d
import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from optics.kernels.arrays import FloatArray
from rigs.mounting import KeptBodies

Faces = NDArray[np.int64]
GRID = 2**20
"""Steps along the longest side, 1.6 um of 1.6 m: corners that fall into the same step are one."""
CRACK = 1e-4
"""Open edges this near to each other, as a share of the mesh's diagonal, are a crack to be joined, not a hole."""
SMALL_HOLE = 0.1
"""Longest rim of a hole that is closed, as a share of the mesh's diagonal."""
CORNERS_OF_A_SHELL = 20
SMALL_BODY = 0.02
"""A body whose longest side is less than this share of the whole one's is left out."""

NAMED = 5
"""Parts that are left out, the largest, are named one by one; there may be thousands."""


class NotClosedError(ValueError):
    """Triangles that small repairs do not close; `what` says what they have that a closed surface has not."""

    def __init__(self, what: str) -> None:
        self.what = what
        super().__init__(f"expected a closed surface, got one with {what}")


@dataclass(frozen=True, kw_only=True)
class LeftOut:
    """A body that is not kept.

    Attributes
    ----------
    side : float
        Longest side of the box around it.
    middle : array, shape (3,)
        Of that box.
    """

    side: float
    middle: FloatArray


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


def repaired(vertices: FloatArray, faces: Faces, keep: KeptBodies = "all") -> Repaired:
    """Make closed surfaces of triangles that have been welded.

    Triangles given twice are dropped, cracks joined, small holes closed, triangles turned the same way, shells turned
    outwards and overlapping shells united.

    Parameters
    ----------
    vertices : array, shape (n, 3)
        Corners, millimetres.
    faces : array, shape (m, 3)
        Indices into them.
    keep : str
        Which bodies, where several do not touch.

    Raises
    ------
    NotClosedError
        When that does not make it closed, or bodies are to be joined.
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
        raise NotClosedError("edges of more than two triangles")
    return Repaired(surface=mesh_of(_chosen(_united(body, notes), keep, notes)), notes=tuple(notes))


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
        raise NotClosedError(f"{_count(int(crowded.sum()), 'edge')} of more than two triangles")
    first, second = order[:-1][same], order[1:][same]
    turned = (start[first] == start[second]).astype(np.int64)
    one, other, total = first // 3, second // 3, len(faces)
    rows = np.concatenate([one, one + total])
    columns = np.concatenate([other + turned * total, other + (1 - turned) * total])
    graph = coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(2 * total, 2 * total))
    _, state = connected_components(graph, directed=False)
    if (state[:total] == state[total:]).any():
        raise NotClosedError("a single side (a Möbius strip)")
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
        raise NotClosedError(f"{_count(len(large), 'hole')} with {sum(large):.0f} mm of open edge in all")
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
                raise NotClosedError("a hole whose rim ends: sheets meet along an edge")
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
    if len(solid.decompose()) < len(shells):
        notes.append(f"united {_count(len(shells), 'shell')}")
    return solid


def _chosen(solid: manifold3d.Manifold, keep: KeptBodies, notes: list[str]) -> manifold3d.Manifold:
    """Bodies to be kept of those that do not touch; the small ones are left out."""
    shells = solid.decompose()
    bodies = [shell for shell in shells if shell.volume() > 0]
    if len(bodies) == 1:
        return solid
    boxes = np.array([body.bounding_box() for body in bodies]).reshape(-1, 2, 3)
    sides = np.ptp(boxes, axis=1).max(axis=1)
    wanted = sides >= SMALL_BODY * sides.max()
    if keep == "largest":
        wanted = np.arange(len(bodies)) == int(np.argmax([body.volume() for body in bodies]))
    if keep == "joined" and wanted.sum() > 1:
        raise NotClosedError(f"{wanted.sum()} bodies that do not touch and are to be joined")
    notes += body_notes(int(wanted.sum()), largest_first(sides[~wanted], boxes.mean(axis=1)[~wanted]))
    outer = [body for body, kept in zip(bodies, wanted, strict=True) if kept]
    cavities = [shell for shell in shells if shell.volume() < 0]
    together = manifold3d.Manifold.batch_boolean(outer, manifold3d.OpType.Add)
    return manifold3d.Manifold.batch_boolean([together, *map(_turned, cavities)], manifold3d.OpType.Subtract)


def largest_first(sides: FloatArray, middles: FloatArray) -> tuple[LeftOut, ...]:
    """Bodies that are not kept, by the sides of their boxes, shape (n,), and the middles of those, shape (n, 3)."""
    return tuple(LeftOut(side=float(sides[body]), middle=middles[body]) for body in np.argsort(-sides, kind="stable"))


def body_notes(kept: int, left_out: Sequence[LeftOut]) -> list[str]:
    """What is said of bodies that do not touch: how many are kept, and which are left out, by size and place."""
    notes = []
    if kept > 1:
        others = 'hull.keep = "joined" joins them, "largest" leaves the others out'
        notes.append(f"{kept} bodies that do not touch; {others}")
    if left_out:
        named = [f"{part.side:.0f} mm at {_place_text(part.middle)}" for part in left_out[:NAMED]]
        more = [f"{len(left_out) - NAMED} smaller"] if len(left_out) > NAMED else []
        notes.append(f"left out {_count(len(left_out), 'part')}: {', '.join([*named, *more])}, in the file's axes")
    return notes


def _place_text(place_mm: FloatArray) -> str:
    return f"({', '.join(f'{along:.0f}' for along in np.round(place_mm) + 0.0)})"


def manifold(vertices: FloatArray, faces: Faces) -> manifold3d.Manifold | None:
    """Body of triangles; None when they do not close it, each edge between two that run along it both ways."""
    # Copies: manifold3d takes no arrays that are read-only, as those of a kept mesh are.
    mesh = manifold3d.Mesh64(np.array(vertices, dtype=np.float64, order="C"), np.array(faces, np.uint64, order="C"))
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
    surface = mesh_of(solid)
    turns = igl.winding_number(np.array(surface.vertices), np.array(surface.faces), np.ascontiguousarray(looked_at))
    return bool((turns > 0.5).all())


def _count(number: int, noun: str) -> str:
    return f"{number:,} {noun}{'' if number == 1 else 's'}"
