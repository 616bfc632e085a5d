"""Parts as triangles: what is rendered and what blocks rays, without any knowledge of how it was made."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

Triangles = tuple[NDArray[np.float64], NDArray[np.int32]]
"""Vertices (n, 3) and faces (m, 3), counter-clockwise seen from outside."""


class Group(StrEnum):
    """What a part moves with, and so the frame its vertices are given in: body, pan or m2."""

    FIXED = "fixed"
    PAN = "pan"
    TILT = "tilt"


class Role(StrEnum):
    """What a part is."""

    HULL = "hull"
    MOUNT = "mount"
    SERVO = "servo"
    MIRROR = "mirror"
    HARDWARE = "hardware"
    """Bought small parts: screws, inserts, washers, bushings."""


def double_area_vectors(corners: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
    """Normals as long as twice the areas of triangles whose corners have shape (m, 3, 3); shape (m, 3)."""
    # As np.cross has it, to the bit, in a fifth of its time.
    (a, b, c), (d, e, f) = ((corners[:, k] - corners[:, 0]).T for k in (1, 2))
    return np.stack([b * f - c * e, c * d - a * f, a * e - b * d], axis=-1)


@dataclass(frozen=True, kw_only=True)
class PartMesh:
    """One named part as triangles.

    Attributes
    ----------
    name : str
        Name of the part, unique in a rig.
    group : Group
        What it moves with. Vertices are in the body frame (fixed), the pan frame (pan) or the m2 frame (tilt).
    role : Role
        What it is.
    vertices_m : array, shape (n, 3), float64
        Vertices, metres.
    faces : array, shape (m, 3), int32
        Indices into the vertices, counter-clockwise seen from outside.
    colour : str, optional
        Of what is printed, as `rigs.Mount` has it; other parts have that of their material.
    """

    name: str
    group: Group
    role: Role
    vertices_m: NDArray[np.float64]
    faces: NDArray[np.int32]
    colour: str | None = None


def merge(parts: Iterable[PartMesh]) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.int32]]:
    """Join parts into one soup.

    Returns
    -------
    vertices_m : array, shape (n, 3)
    faces : array, shape (m, 3)
    part_of_face : array, shape (m,)
        Position of each face's part in the given order.
    """
    parts = list(parts)
    counts = np.array([len(part.faces) for part in parts], dtype=np.intp)
    owners = np.repeat(np.arange(len(parts), dtype=np.int32), counts)
    return (*joined_triangles((part.vertices_m, part.faces) for part in parts), owners)


def joined_triangles(pieces: Iterable[Triangles]) -> Triangles:
    """Vertices of all pieces, in the given order, and faces that index them; no pieces make empty arrays."""
    vertices, faces = [np.empty((0, 3))], [np.empty((0, 3), dtype=np.int32)]
    count = 0
    for corners, triangles in pieces:
        vertices.append(corners)
        faces.append((triangles + count).astype(np.int32))
        count += len(corners)
    return np.concatenate(vertices), np.concatenate(faces)
