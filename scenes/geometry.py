"""What rays can hit: each group of parts, and the world, as a scene of its own in its own frame.

A part that moves is never moved: the ray is carried into its frame instead, so no acceleration structure is rebuilt.
What a face looks like stands in two tables that all groups share.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from optics.backend import Array3f32, Float32, UInt32, dr
from optics.mesh import Group, PartMesh, Role, merge
from optics.ray_scene import mesh_scene
from scenes.frame import Label
from scenes.materials import Material, material_of
from scenes.packing import rows_of
from scenes.sun_map import sun_map
from scenes.targets import MeshShape
from scenes.worlds import World
from scenes.worlds.snow import MarineSnow, snow_surface

WORLD, TARGET, SNOW = "world", "target", "snow"
"""Groups beside those of the rig (`optics.mesh.Group`)."""

LABEL_OF_ROLE = {
    Role.HULL: Label.HULL,
    Role.MOUNT: Label.MOUNT,
    Role.HARDWARE: Label.MOUNT,
    Role.SERVO: Label.SERVO,
}

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


BEFORE_PLATE_M = 2e-4
LABELS, MATERIALS = 16, 64
"""More than there are of each, for `face_code`."""


@dataclass(frozen=True, kw_only=True)
class GroupMesh:
    """Triangles of one group, and what they look like.

    Attributes
    ----------
    vertices_m : array, shape (n, 3)
    faces : array, shape (m, 3)
    material, label, instance : arrays, shape (m,)
    colour : array, shape (n, 3), optional
        Factors on the materials' reflectance; a group with colours has smooth normals as well.
    ambient : array, shape (n, 3), optional
        Irradiance at the vertices by all but the direct sun, by channel, W / (m^2 nm).
    shade : array, shape (n, 3), optional
        Instead, for what moves: how much of the light around reaches the vertices past the rest of it, by channel.
    mirrors : dict of arrays, shape (11,), optional
        Mirrors among the triangles, packed by name as the kernels take them: they throw light on what is around them.
    """

    vertices_m: NDArray[np.float64]
    faces: NDArray[np.int32]
    material: NDArray[np.int32]
    label: NDArray[np.int32]
    instance: NDArray[np.int32]
    colour: NDArray[np.float32] | None = None
    ambient: NDArray[np.float64] | None = None
    shade: NDArray[np.float64] | None = None
    mirrors: dict[str, NDArray[np.float64]] | None = None


@dataclass(frozen=True, kw_only=True)
class Geometry:
    """Groups of triangles as the kernels take them.

    Attributes
    ----------
    groups : dict of dict
        By name: Mitsuba `scene`, bounding `box` (lower and upper corner) and `offset` of its rows in `faces`.
    faces, vertices : Float32
        The two tables, flat.
    sun_map : dict, optional
        Where the world stands in its own light (`scenes.sun_map`); without it shadows are traced.
    volume : dict, optional
        What the world changes of the light around what moves (`scenes.ambient_volume`).
    source : dict, optional
        What the world changes of the light that water scatters (`scenes.source_volume`).
    water : Float32, optional
        What the robot keeps from the water around it (`scenes.water_shade`).
    shade : dict, optional
        What the robot keeps from the surfaces around it (`scenes.world_shade`).
    eyes : Array3f32, optional
        Where lines of sight begin, body frame.
    """

    groups: dict[str, dict[str, Any]]
    faces: Any
    vertices: Any
    sun_map: dict[str, Any] | None
    volume: dict[str, Any] | None = None
    source: dict[str, Any] | None = None
    water: Any = None
    shade: dict[str, Any] | None = None
    eyes: Any = None

    @property
    def arrays(self) -> dict[str, Any]:
        """What the kernels take."""
        arrays = {"groups": self.groups, "faces": self.faces, "vertices": self.vertices}
        names = ("sun_map", "volume", "source", "water", "shade", "eyes")
        some = {name: getattr(self, name) for name in names}
        return arrays | {name: value for name, value in some.items() if value is not None}


def rig_meshes_by_group(parts: Sequence[PartMesh]) -> tuple[dict[str, GroupMesh], tuple[str, ...]]:
    """Mesh of every group of parts that has faces, and the parts' names by instance.

    The mirrors' plates are left out: their faces are analytic planes in the renderer.
    """
    names = tuple(part.name for part in parts)
    meshes = {}
    for group in Group:
        members = [part for part in parts if part.group == group and part.role != Role.MIRROR]
        if members:
            vertices, faces, owner = merge(members)
            meshes[str(group)] = GroupMesh(
                vertices_m=vertices,
                faces=faces,
                material=np.array([material_of(part) for part in members], dtype=np.int32)[owner],
                label=np.array([LABEL_OF_ROLE[part.role] for part in members], dtype=np.int32)[owner],
                instance=np.array([names.index(part.name) for part in members], dtype=np.int32)[owner],
            )
    return meshes, names


def mirror_plates(
    parts: Sequence[PartMesh],
    body_from: Mapping[str, RigidTransform],
    mirrors: Mapping[str, NDArray[np.float64]],
) -> GroupMesh | None:
    """The mirrors' plates in the body frame, in the light's way like any other part, with the mirrors before them."""
    plates = [
        replace(part, vertices_m=body_from[str(part.group)].apply(part.vertices_m))
        for part in parts
        if part.role == Role.MIRROR
    ]
    if not plates:
        return None
    vertices, faces, _ = merge(plates)
    return GroupMesh(
        vertices_m=vertices,
        faces=faces,
        material=np.full(len(faces), Material.MIRROR_BACK, dtype=np.int32),
        label=np.full(len(faces), Label.MIRROR_BACK, dtype=np.int32),
        instance=np.full(len(faces), -1, dtype=np.int32),
        colour=np.ones((len(vertices), 3), dtype=np.float32),
        mirrors={name: _before_its_plate(mirror) for name, mirror in mirrors.items()},
    )


def _before_its_plate(mirror: NDArray[np.float64]) -> NDArray[np.float64]:
    """Packed mirror, brought forward a little: the plate has a face in its plane."""
    normal = np.cross(mirror[3:6], mirror[6:9])
    return np.concatenate([mirror[:3] + BEFORE_PLATE_M * normal, mirror[3:]])


def moved_mesh(mesh: GroupMesh, pose: RigidTransform) -> GroupMesh:
    """Mesh carried into another frame."""
    mirrors = mesh.mirrors and {
        name: np.concatenate([pose.apply(m[:3]), pose.rotation.apply(m[3:9].reshape(2, 3)).ravel(), m[9:]])
        for name, m in mesh.mirrors.items()
    }
    return replace(mesh, vertices_m=pose.apply(mesh.vertices_m), mirrors=mirrors)


def joined_meshes(meshes: Sequence[GroupMesh]) -> GroupMesh:
    """Several coloured meshes of one frame as one, in the given order, with all their mirrors."""
    starts = np.cumsum([0] + [len(mesh.vertices_m) for mesh in meshes[:-1]])
    return GroupMesh(
        vertices_m=np.concatenate([mesh.vertices_m for mesh in meshes]),
        faces=np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]).astype(np.int32),
        material=np.concatenate([mesh.material for mesh in meshes]),
        label=np.concatenate([mesh.label for mesh in meshes]),
        instance=np.concatenate([mesh.instance for mesh in meshes]),
        colour=np.concatenate([mesh.colour for mesh in meshes if mesh.colour is not None]),
        mirrors={name: mirror for mesh in meshes for name, mirror in (mesh.mirrors or {}).items()} or None,
    )


def world_mesh(world: World, first_instance: int) -> GroupMesh:
    """Mesh of a world whose instances are counted from `first_instance`."""
    return GroupMesh(
        vertices_m=world.vertices_m,
        faces=world.faces,
        material=world.material,
        label=np.full(len(world.faces), Label.WORLD, dtype=np.int32),
        instance=np.where(world.instance < 0, -1, world.instance + first_instance).astype(np.int32),
        colour=world.colour,
    )


def target_mesh(shape: MeshShape, instance: int) -> GroupMesh:
    """Mesh of a target, one instance."""
    surface = shape.surface
    return GroupMesh(
        vertices_m=surface.vertices_m,
        faces=surface.faces,
        material=surface.material,
        label=np.full(len(surface.faces), Label.TARGET, dtype=np.int32),
        instance=np.full(len(surface.faces), instance, dtype=np.int32),
        colour=surface.colour,
    )


def snow_mesh(snow: MarineSnow) -> GroupMesh:
    """Mesh of marine snow, no instance."""
    surface = snow_surface(snow)
    return GroupMesh(
        vertices_m=surface.vertices_m,
        faces=surface.faces,
        material=surface.material,
        label=np.full(len(surface.faces), Label.SNOW, dtype=np.int32),
        instance=np.full(len(surface.faces), -1, dtype=np.int32),
        colour=surface.colour,
    )


def geometry_of(meshes: dict[str, GroupMesh], towards_sun: NDArray[np.float64]) -> Geometry:
    """Scenes and tables of meshes by group, under a sun in a direction of the world frame."""
    groups, face_rows, vertex_rows = {}, [np.zeros((0, ROW))], [_plain_vertex()]
    for name, mesh in meshes.items():
        first_face, first_vertex = sum(map(len, face_rows)), sum(map(len, vertex_rows))
        textured = mesh.colour is not None
        face_rows.append(_face_rows(mesh, first_vertex if textured else None))
        if textured:
            vertex_rows.append(_vertex_rows(mesh))
        used = mesh.vertices_m[np.unique(mesh.faces)]
        groups[name] = {
            "scene": mesh_scene(mesh.vertices_m, mesh.faces),
            "box": [[dr.opaque(Float32, float(x)) for x in corner] for corner in (used.min(axis=0), used.max(axis=0))],
            "offset": dr.opaque(Float32, float(first_face)),
        }
    tables = [np.concatenate(rows) for rows in (face_rows, vertex_rows)]
    for table, what in zip(tables, ("faces", "vertices"), strict=True):
        if len(table) > LARGEST_INDEX:
            raise ValueError(f"expected at most {LARGEST_INDEX} {what} in a scene, got {len(table)}")
    if not len(tables[0]):
        tables[0] = np.zeros((1, ROW))  # open water: there is nothing to hit, but something to look up
    faces, vertices = (rows_of(table, ROW) for table in tables)
    shadows = sun_map(groups[WORLD]["scene"], meshes[WORLD].vertices_m, towards_sun) if WORLD in meshes else None
    return Geometry(groups=groups, faces=faces, vertices=vertices, sun_map=shadows)


def face_normals(vertices_m: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """Unit normals, counter-clockwise; zero for a face without area."""
    normals = _area_vectors(vertices_m, faces)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray(normals / np.where(length > 0, length, 1))


def vertex_normals(vertices_m: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """Normals at vertices, faces weighted by their area; zero for a vertex without faces."""
    area = _area_vectors(vertices_m, faces)
    total = np.stack(
        [np.bincount(faces.ravel(), np.repeat(column, 3), minlength=len(vertices_m)) for column in area.T], axis=1
    )
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.asarray(total / np.where(length > 0, length, 1))


def _area_vectors(vertices_m: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    corners = vertices_m[faces]
    return np.asarray(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))


def _face_rows(mesh: GroupMesh, first_vertex: int | None) -> NDArray[np.float64]:
    rows = np.zeros((len(mesh.faces), ROW))
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


def _vertex_rows(mesh: GroupMesh) -> NDArray[np.float64]:
    rows = np.zeros((len(mesh.vertices_m), ROW))
    rows[:, VertexColumn.NORMAL : VertexColumn.NORMAL + 2] = to_octahedron(vertex_normals(mesh.vertices_m, mesh.faces))
    rows[:, VertexColumn.COLOUR : VertexColumn.COLOUR + 3] = mesh.colour
    light = mesh.shade if mesh.ambient is None else mesh.ambient
    rows[:, VertexColumn.AMBIENT : VertexColumn.AMBIENT + 3] = 1 if light is None else light
    return rows


def _plain_vertex() -> NDArray[np.float64]:
    """Row 0, where the corners of faces without texture point: colour one, and all the light around."""
    row = np.zeros((1, ROW))
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
