"""What rays can hit: each group of parts, and the world, as a scene of its own in its own frame.

A part that moves is never moved: the ray is carried into its frame instead, so no acceleration structure is rebuilt.
What a face looks like stands in two tables that all groups share.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.kernels.backend import Array3f32, Float32, UInt32, dr
from optics.kernels.packing import opaque_numbers, rows_of
from optics.kernels.ray_scene import shared_scene
from optics.workers.threads import woken_threads
from scenes.kernels.grid import GridTable
from scenes.kernels.shadow_table import ShadowTable
from scenes.kernels.sun_map import SunMap, sun_map
from scenes.kernels.tracing import GroupScene
from scenes.stage.group_mesh import GroupMesh, face_normals, used_vertices, vertex_normals
from scenes.stage.records import WORLD

LARGEST_INDEX = 2**24
"""Numbers up to here are exact in single precision."""

ROW = 8
"""Numbers in a row of the tables of faces and vertices: half a cache line."""


class FaceColumn(IntEnum):
    """Columns of the table of faces; the normal and the corners' rows in the table of vertices take three each."""

    NORMAL = 0
    CODE = 3
    """Material, label and what the corners say, as one number; see `face_code`."""
    INSTANCE = 4
    CORNERS = 5


class VertexColumn(IntEnum):
    """Columns of the table of vertices: the normal on an octahedron's map, then three numbers each."""

    NORMAL = 0
    COLOUR = 2
    AMBIENT = 5
    """By channel: irradiance of all but the direct sun, or which share of the light around arrives."""


LABELS, MATERIALS = 16, 64
"""More than there are of each, for `face_code`."""


@dataclass(frozen=True, kw_only=True)
class Geometry:
    """Groups of triangles and the light around them, as the kernels take them.

    Attributes
    ----------
    groups : dict of GroupScene
    faces, vertices : Float32
        The two tables, flat.
    sun_map : SunMap, optional
        Where the world stands in its own light; without it shadows are traced.
    irradiance : GridTable, optional
        What the world changes of the light around what moves (`scenes.baking.source_volume`).
    source : GridTable, optional
        What the world changes of the light that water scatters (`scenes.baking.source_volume`).
    shadow_in_water : Float32, optional
        What of the light in the water the robot hides (`scenes.baking.robot_shadow_in_water`).
    shadow_on_world : ShadowTable, optional
        What the robot hides from the surfaces around it (`scenes.baking.robot_shadow_on_world`).
    eyes : Array3f32, optional
        Where lines of sight begin, body frame.
    """

    groups: dict[str, GroupScene]
    faces: Any
    vertices: Any
    sun_map: SunMap | None = None
    irradiance: GridTable | None = None
    source: GridTable | None = None
    shadow_in_water: Any = None
    shadow_on_world: ShadowTable | None = None
    eyes: Any = None


def geometry_of(meshes: dict[str, GroupMesh], towards_sun: NDArray[np.float64]) -> Geometry:
    """Scenes and tables of meshes by group, under a sun in a direction of the world frame."""
    groups, face_rows, vertex_rows = {}, [_no_rows(0)], [_plain_vertex()]
    for name, mesh in meshes.items():
        first_face, first_vertex = sum(map(len, face_rows)), sum(map(len, vertex_rows))
        textured = mesh.colour is not None
        face_rows.append(_face_rows(mesh, first_vertex if textured else None))
        if textured:
            vertex_rows.append(_vertex_rows(mesh))
        used = used_vertices(mesh)
        with woken_threads():
            scene = shared_scene(mesh.vertices_m, mesh.faces)
        groups[name] = GroupScene(
            scene=scene,
            box=(opaque_numbers(used.min(axis=0)), opaque_numbers(used.max(axis=0))),
            offset=dr.opaque(Float32, float(first_face)),
        )
    tables = [np.concatenate(rows) for rows in (face_rows, vertex_rows)]
    for table, what in zip(tables, ("faces", "vertices"), strict=True):
        if len(table) > LARGEST_INDEX:
            raise ValueError(f"expected at most {LARGEST_INDEX} {what} in a scene, got {len(table)}")
    if not len(tables[0]):
        tables[0] = _no_rows(1)  # open water: there is nothing to hit, but something to look up
    faces, vertices = (rows_of(table, ROW) for table in tables)
    shadows = None
    if WORLD in meshes:
        world = meshes[WORLD]
        shadows = sun_map(groups[WORLD].scene, world.vertices_m, world.faces, towards_sun)
    return Geometry(groups=groups, faces=faces, vertices=vertices, sun_map=shadows)


def relit(geometry: Geometry, ambient: NDArray[np.float64]) -> Geometry:
    """Geometry of a single mesh whose vertices are lit by this ambient light, shape (n, 3), instead."""
    rows = np.array(geometry.vertices).reshape(-1, ROW)
    rows[1:, VertexColumn.AMBIENT :] = ambient
    return replace(geometry, vertices=rows_of(rows, ROW))


def _no_rows(count: int) -> NDArray[np.float32]:
    return np.zeros((count, ROW), dtype=np.float32)


def _face_rows(mesh: GroupMesh, first_vertex: int | None) -> NDArray[np.float32]:
    rows = _no_rows(len(mesh.faces))
    textured = first_vertex is not None
    rows[:, FaceColumn.NORMAL : FaceColumn.NORMAL + 3] = face_normals(mesh.vertices_m, mesh.faces)
    baked = mesh.ambient is not None
    rows[:, FaceColumn.CODE] = mesh.material + MATERIALS * (mesh.label + LABELS * (textured + 2 * baked))
    rows[:, FaceColumn.INSTANCE] = mesh.instance
    if first_vertex is not None:
        rows[:, FaceColumn.CORNERS : FaceColumn.CORNERS + 3] = mesh.faces + first_vertex
    return rows


def face_code(code: Any) -> tuple[Any, Any, Any, Any]:
    """Kernel: material, label, whether the corners carry anything, and whether that is light and not a share of it."""
    number = UInt32(code)
    corners = number // (MATERIALS * LABELS)
    return number % MATERIALS, (number // MATERIALS) % LABELS, corners >= 1, corners >= 2


def _vertex_rows(mesh: GroupMesh) -> NDArray[np.float32]:
    rows = _no_rows(len(mesh.vertices_m))
    rows[:, VertexColumn.NORMAL : VertexColumn.NORMAL + 2] = to_octahedron(vertex_normals(mesh.vertices_m, mesh.faces))
    rows[:, VertexColumn.COLOUR : VertexColumn.COLOUR + 3] = mesh.colour
    light = mesh.unoccluded if mesh.ambient is None else mesh.ambient
    rows[:, VertexColumn.AMBIENT : VertexColumn.AMBIENT + 3] = 1 if light is None else light
    return rows


def _plain_vertex() -> NDArray[np.float32]:
    """Row 0, where the corners of faces without texture point: colour one, and all the light around."""
    row = _no_rows(1)
    row[0, VertexColumn.COLOUR :] = 1
    return row


def to_octahedron(directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Directions, shape (n, 3), on the unfolded octahedron, shape (n, 2) (Meyer et al. 2010, CGF 29, 1405)."""
    length = np.abs(directions).sum(axis=1, keepdims=True)
    flat = directions / np.where(length > 0, length, 1)
    folded = (1 - np.abs(flat[:, 1::-1])) * np.where(flat[:, :2] >= 0, 1.0, -1.0)
    return np.where(flat[:, 2:] >= 0, flat[:, :2], folded)


def from_octahedron(u: Any, v: Any) -> Any:
    """Kernel: unit direction of a point of the unfolded octahedron."""
    z = 1 - dr.abs(u) - dr.abs(v)
    below = dr.maximum(-z, 0)
    return dr.normalize(Array3f32(u - dr.select(u >= 0, below, -below), v - dr.select(v >= 0, below, -below), z))
