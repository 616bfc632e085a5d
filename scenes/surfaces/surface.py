"""Triangles with a material for each and a colour for each corner: what worlds and targets are made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optics.kernels.arrays import FloatArray
from optics.mesh import double_area_vectors, joined_triangles
from scenes.light.materials import Material


@dataclass(frozen=True, kw_only=True)
class Surface:
    """Triangles of one thing.

    Attributes
    ----------
    vertices_m : array, shape (n, 3)
    faces : array, shape (m, 3)
        Counter-clockwise seen from the water.
    material : array, shape (m,)
        `Material` of each face.
    colour : array, shape (n, 3), float32
        Factors on the material's reflectance in the red, green and blue part of the spectrum
        (`scenes.light.materials.colour_basis`); ones: the material as it was measured.
    """

    vertices_m: FloatArray
    faces: NDArray[np.int32]
    material: NDArray[np.int32]
    colour: NDArray[np.float32]


def surface(
    vertices_m: ArrayLike, faces: ArrayLike, material: ArrayLike | Material, colour: ArrayLike = (1.0, 1.0, 1.0)
) -> Surface:
    """Surface of one material or one for each face, and of one colour or one for each vertex."""
    vertices = np.asarray(vertices_m, dtype=np.float64).reshape(-1, 3)
    triangles = np.asarray(faces, dtype=np.int32).reshape(-1, 3)
    return Surface(
        vertices_m=vertices,
        faces=triangles,
        material=np.broadcast_to(np.asarray(material, dtype=np.int32), len(triangles)).copy(),
        colour=np.broadcast_to(np.asarray(colour, dtype=np.float32), vertices.shape).copy(),
    )


def joined(surfaces: Sequence[Surface]) -> Surface:
    """Several surfaces as one, in the given order; none make one without faces."""
    if not surfaces:
        return surface(np.empty((0, 3)), np.empty((0, 3)), np.empty(0))
    vertices, faces = joined_triangles((each.vertices_m, each.faces) for each in surfaces)
    return Surface(
        vertices_m=vertices,
        faces=faces,
        material=np.concatenate([each.material for each in surfaces]),
        colour=np.concatenate([each.colour for each in surfaces]),
    )


def enclosed_volume_m3(vertices_m: FloatArray, faces: NDArray[np.int32]) -> float:
    """Volume within a closed surface, by the divergence theorem; negative when its faces look inwards."""
    first = vertices_m[faces[:, 0]] - vertices_m.mean(axis=0)
    return float(np.sum(first * double_area_vectors(vertices_m[faces])) / 6)
