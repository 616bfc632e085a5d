"""Closed shapes that growths, rocks, targets and snow are made of: spheres, and tubes along paths."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from optics.kernels.arrays import FloatArray
from optics.mesh import Triangles


@cache
def unit_sphere(subdivisions: int) -> Triangles:
    """Icosahedron subdivided onto the unit sphere, 20 * 4^subdivisions faces; not to be changed in place."""
    import trimesh  # noqa: PLC0415  (takes longer to import than a frame to render)

    sphere = trimesh.creation.icosphere(subdivisions=subdivisions)
    return np.asarray(sphere.vertices, dtype=np.float64), np.asarray(sphere.faces, dtype=np.int32)


def lofted(rings: FloatArray) -> Triangles:
    """Closed surfaces through rings of points, with a fan over the first and the last ring.

    Parameters
    ----------
    rings : array, shape (b, k, s, 3) or (k, s, 3)
        `b` surfaces of `k` rings of `s` points each; a ring runs counter-clockwise about the direction in which the
        rings follow each other.
    """
    rings = rings.reshape(-1, *rings.shape[-3:])
    count, length, sides = rings.shape[:3]
    ends = rings[:, [0, -1]].mean(axis=2)
    vertices = np.concatenate([rings.reshape(count, -1, 3), ends], axis=1)
    index = np.arange(length * sides).reshape(length, sides)
    following = np.roll(index, -1, axis=1)
    a, b, c, d = index[:-1], following[:-1], following[1:], index[1:]
    first, last = np.full(sides, length * sides), np.full(sides, length * sides + 1)
    faces = np.concatenate(
        [
            np.stack([a, b, c], axis=-1).reshape(-1, 3),
            np.stack([a, c, d], axis=-1).reshape(-1, 3),
            np.stack([first, following[0], index[0]], axis=-1),
            np.stack([last, index[-1], following[-1]], axis=-1),
        ]
    )
    starts = np.arange(count)[:, np.newaxis, np.newaxis] * vertices.shape[1]
    return vertices.reshape(-1, 3), (faces + starts).reshape(-1, 3).astype(np.int32)


def tubes(paths: FloatArray, radii: FloatArray, sides: int) -> Triangles:
    """Closed round tubes, shape (b, k, 3) paths and (b, k) radii; rings stand square to each path as a whole."""
    along = paths[:, -1] - paths[:, 0]
    along = along / np.linalg.norm(along, axis=-1, keepdims=True)
    first, second = perpendicular_axes(along)
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    circle = np.cos(angle)[:, np.newaxis] * first[:, np.newaxis] + np.sin(angle)[:, np.newaxis] * second[:, np.newaxis]
    rings = paths[:, :, np.newaxis] + radii[:, :, np.newaxis, np.newaxis] * circle[:, np.newaxis]
    return lofted(rings)


def turned(profile: ArrayLike, sides: int) -> FloatArray:
    """Rings of a solid of revolution about z from a profile of (radius, height), shape (k, 2) to (k, s, 3)."""
    radius, height = np.asarray(profile, dtype=np.float64).T[..., np.newaxis]
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    return np.stack(
        [radius * np.cos(angle), radius * np.sin(angle), np.broadcast_to(height, (len(radius), sides))], axis=-1
    )


def perpendicular_axes(along: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors square to unit vectors (..., 3), so that first x second = along."""
    helper = np.where(np.abs(along[..., 2:]) < 0.9, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])
    first = np.cross(helper, along)
    first = first / np.linalg.norm(first, axis=-1, keepdims=True)
    return first, np.cross(along, first)
