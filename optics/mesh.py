"""Parts as triangles: what is rendered and what blocks rays, without any knowledge of how it was made."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray


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
    """Bought small parts: screws, inserts, washers, bushes."""


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
    vertices = [np.empty((0, 3))]
    faces = [np.empty((0, 3), dtype=np.int32)]
    owners = [np.empty(0, dtype=np.int32)]
    count = 0
    for position, part in enumerate(parts):
        vertices.append(part.vertices_m)
        faces.append((part.faces + count).astype(np.int32))
        owners.append(np.full(len(part.faces), position, dtype=np.int32))
        count += len(part.vertices_m)
    return np.concatenate(vertices), np.concatenate(faces), np.concatenate(owners)
