"""Vertices of a mesh as light reaches them: where they look out from, how they face, what open water sends them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from optics.kernels.arrays import FloatArray
from scenes.baking.gather_places import double_areas_around
from scenes.light.light import Light
from scenes.stage.group_mesh import GroupMesh, vertex_normals

INSET = 0.05
"""How far towards the middles of its faces a vertex looks out from: at an edge it lies in the next face's plane."""

OFFSET_M = 1e-3
"""How far off the surface."""


@dataclass(frozen=True, kw_only=True)
class LitVertices:
    """Vertices of a mesh as light reaches them.

    Attributes
    ----------
    vertices_m, normals : arrays, shape (n, 3)
    origins_m : array, shape (n, 3)
        From where they look out, a little off the surface.
    double_areas_m2 : array, shape (n,)
        Twice the area of the faces around each.
    open_water : array, shape (n, 3)
        Irradiance by all but the direct sun if the mesh hid nothing and sent nothing.
    """

    vertices_m: FloatArray
    normals: FloatArray
    origins_m: FloatArray
    double_areas_m2: FloatArray
    open_water: FloatArray

    @classmethod
    def of(cls, mesh: GroupMesh, light: Light) -> LitVertices:
        """Those of a mesh under a light."""
        normals, areas = vertex_normals(mesh.vertices_m, mesh.faces), double_areas_around(mesh)
        origins = _inset(mesh) + normals * OFFSET_M
        return cls(
            vertices_m=mesh.vertices_m,
            normals=normals,
            origins_m=origins,
            double_areas_m2=areas,
            open_water=light.open_water_irradiance(-origins[:, 2], normals),
        )


def _inset(mesh: GroupMesh) -> FloatArray:
    """Vertices, moved a little towards the middles of the faces around them."""
    middles = np.take(mesh.vertices_m, mesh.faces, axis=0).mean(axis=1)
    corners = mesh.faces.ravel()
    count = np.bincount(corners, minlength=len(mesh.vertices_m))
    around = np.stack(
        [
            np.bincount(corners, np.repeat(column, 3), minlength=len(mesh.vertices_m)) / np.maximum(count, 1)
            for column in middles.T
        ],
        axis=1,
    )
    return np.where(count[:, np.newaxis] > 0, mesh.vertices_m + INSET * (around - mesh.vertices_m), mesh.vertices_m)
