"""The one place outside `scenes` that speaks Mitsuba: vertices and faces become something rays can hit."""

from __future__ import annotations

import weakref
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.kernels.backend import mi

_SHARED: dict[tuple[int, int], Any] = {}


def mesh_scene(vertices_m: NDArray[np.float64], faces: NDArray[np.int32]) -> Any:
    """Mitsuba scene of one triangle mesh, so that a hit's `prim_index` is the position in `faces`.

    One mesh, not one per part: `mi.load_dict` would merge several and lose which is which. One kernel may trace any
    number of such scenes.

    Parameters
    ----------
    vertices_m : array, shape (n, 3)
        Stored in single precision: good to about 1e-7 of the distance from the origin.
    faces : array, shape (m, 3)
    """
    return mi.load_dict({"type": "scene", "beside": _first_scene(), "mesh": _mesh(vertices_m, faces)}, optimize=False)


def shared_scene(vertices_m: NDArray[np.float64], faces: NDArray[np.int32]) -> Any:
    """As `mesh_scene`, of arrays whose values nobody changes: one scene for all who ask, while both arrays live.

    The search tree of a reef takes half a second: light is found with the one that images are rendered with.
    """
    key = id(vertices_m), id(faces)
    if key not in _SHARED:
        _SHARED[key] = mesh_scene(vertices_m, faces)
        for array in (vertices_m, faces):
            # Before its number can be that of another array.
            weakref.finalize(array, _SHARED.pop, key, None).atexit = False
    return _SHARED[key]


def first_faces(
    scene: Any, origins_m: NDArray[np.floating], directions: NDArray[np.floating]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Where rays first hit a scene's mesh, from either side.

    Parameters
    ----------
    scene
        As `mesh_scene` gives it.
    origins_m, directions : arrays, shape (n, 3)
        Unit vectors.

    Returns
    -------
    distance_m : array, shape (n,)
        Infinite where nothing is hit.
    face : array, shape (n,)
        Position in the mesh's faces, -1 where nothing is hit.
    """
    start, along = (np.ascontiguousarray(vectors.T, dtype=np.float32) for vectors in (origins_m, directions))
    hit = scene.ray_intersect_preliminary(mi.Ray3f(mi.Point3f(start), mi.Vector3f(along)), coherent=True)
    found, face = np.array(hit.is_valid()), np.array(hit.prim_index, dtype=np.int64)
    return np.where(found, np.array(hit.t, dtype=np.float64), np.inf), np.where(found, face, -1)


@cache
def _first_scene() -> Any:
    """Scene that all others are made beside, so that they share its shader binding table.

    On a graphics card a kernel can trace only scenes of one such table; rays of any other would miss everything, with
    no more than a warning.
    """
    return mi.load_dict({"type": "scene", "mesh": _mesh(np.eye(3), np.array([[0, 1, 2]]))}, optimize=False)


def _mesh(vertices_m: NDArray[np.float64], faces: NDArray[np.int32]) -> Any:
    mesh = mi.Mesh("mesh", len(vertices_m), len(faces))
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = np.ascontiguousarray(vertices_m, dtype=np.float32).ravel()
    parameters["faces"] = np.ascontiguousarray(faces, dtype=np.uint32).ravel()
    parameters.update()
    return mesh
