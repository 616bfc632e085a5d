"""Boxes as parts, and as slabs: the second way to say what a box blocks, in NumPy and float64."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optics.mesh import Group, PartMesh, Role

Array = NDArray[np.float64]

CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def box_part(low: ArrayLike, high: ArrayLike, *, group: Group, role: Role, name: str = "box") -> PartMesh:
    vertices = np.where(CORNERS == 1, high, low).astype(np.float64)
    faces = [face for a, b, c, d in QUADS for face in ((a, b, c), (a, c, d))]
    return PartMesh(name=name, group=group, role=role, vertices_m=vertices, faces=np.array(faces, dtype=np.int32))


def bowl_part(half_size: float, brim: float, *, axis: int, group: Group, role: Role) -> PartMesh:
    """Half of a big empty box: what lies beyond it is the half-space below `brim` along an axis."""
    low, high = np.full(3, -half_size), np.full(3, half_size)
    high[axis] = brim
    box = box_part(low, high, group=group, role=role)
    on_brim = (box.vertices_m[box.faces][:, :, axis] == brim).all(axis=1)
    return PartMesh(name="bowl", group=group, role=role, vertices_m=box.vertices_m, faces=box.faces[~on_brim])


def slab_distance(box: PartMesh, origin: Array, direction: Array) -> Array:
    """Distance along rays, shape (n, 3), to a box along the axes; infinite where it is not hit."""
    low, high = box.vertices_m.min(axis=0), box.vertices_m.max(axis=0)
    with np.errstate(divide="ignore"):
        crossings = np.stack([(low - origin) / direction, (high - origin) / direction])
    enter, leave = crossings.min(axis=0).max(axis=1), crossings.max(axis=0).min(axis=1)
    return np.where((enter <= leave) & (leave > 0), np.maximum(enter, 0), np.inf)
