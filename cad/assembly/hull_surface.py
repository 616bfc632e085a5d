"""The hull of a rig as a closed surface, whether or not a mount can be made for it."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import version
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from cad.assembly.part_meshes import MESH_VERSION
from cad.hulls.distance import nearest_points
from cad.hulls.window import with_window
from optics.feasibility.envelope import HullDistance
from optics.kernels.arrays import FloatArray
from optics.kernels.cache import load_or_make, result_key
from optics.layout import Layout
from optics.mesh import Group, PartMesh, Role
from rigs import FileHull, Rig


def hull_surface(rig: Rig) -> trimesh.Trimesh:
    """Closed surface of a rig's hull in the body frame, millimetres; from the cache when it can be.

    It is the hull that the mount is made for. Nothing else of the rig need be in order.

    Raises
    ------
    ValueError
        For a rig without mirrors, whose file says nothing of a hull, or one whose hull cannot be made.
    """
    gaze = rig.require_gaze()
    if isinstance(gaze.hull, FileHull):
        from cad.hulls.hull import closed_surface, file_hull_solid  # noqa: PLC0415  (takes seconds to import)

        return with_window(closed_surface(file_hull_solid(gaze.hull)), rig)
    sections = (gaze.hull, gaze.mount, gaze.fold_mirror, gaze.gaze_mirror, rig.port, rig.camera)
    numbers = [section.model_dump(mode="json") for section in sections]
    key = result_key("hull surface", MESH_VERSION, numbers, version("build123d"))
    return load_or_make("hull surface", key, lambda: _made(rig), pack=_packed, unpack=_unpacked)


def seen_file_hull(rig: Rig, hull: FileHull) -> PartMesh:
    """What rays hit of a hull from a file, its window cut out: its own triangles, open or closed; body frame, metres.

    Raises
    ------
    ValueError
        When the file cannot be used.
    """
    from cad.hulls.hull import file_hull_surface  # noqa: PLC0415  (takes seconds to import)

    surface = with_window(file_hull_surface(hull), rig)
    vertices = np.asarray(surface.vertices, dtype=np.float64) / 1000
    faces = np.asarray(surface.faces, dtype=np.int32)
    return PartMesh(name="hull", group=Group.FIXED, role=Role.HULL, vertices_m=vertices, faces=faces)


def file_hull_distance(rig: Rig) -> HullDistance | None:
    """Distance of points from a rig's hull where that comes from a file, its window cut out; None for our own shapes.

    The numbers of our own shapes say how far points are from them (`optics.feasibility.envelope.own_hull_distance`).

    Raises
    ------
    ValueError
        As `hull_surface`.
    """
    if rig.file_hull is None:
        return None
    surface = hull_surface(rig)

    def distance(points_m: FloatArray) -> FloatArray:
        points = np.asarray(points_m, dtype=np.float64)
        return nearest_points(surface, 1000 * points.reshape(-1, 3)).distance_mm.reshape(points.shape[:-1]) / 1000

    return distance


def _made(rig: Rig) -> trimesh.Trimesh:
    from cad.assembly.tessellation import HULL_LINEAR_TOLERANCE_MM, tessellated  # noqa: PLC0415  (takes seconds)
    from cad.hulls.hull import hull_shape  # noqa: PLC0415

    gaze = rig.require_gaze()
    shape = hull_shape(gaze.hull, gaze.mount, rig.port, Layout.from_rig(rig))
    return shape if isinstance(shape, trimesh.Trimesh) else tessellated(shape, HULL_LINEAR_TOLERANCE_MM)


def _packed(surface: trimesh.Trimesh) -> dict[str, NDArray[Any]]:
    return {"vertices": np.asarray(surface.vertices), "faces": np.asarray(surface.faces, dtype=np.int32)}


def _unpacked(stored: Mapping[str, NDArray[Any]]) -> trimesh.Trimesh:
    return trimesh.Trimesh(stored["vertices"], stored["faces"], process=False)
