"""Triangles of a scene, group by group, and what they look like: hull and mount, the world, a target, marine snow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from optics.mesh import Group, PartMesh, Role, double_area_vectors, joined_triangles, merge
from scenes.light.materials import Material, material_of
from scenes.stage.frame import Label
from scenes.stage.records import MirrorPlate
from scenes.stage.targets import MeshShape
from scenes.worlds import World
from scenes.worlds.snow import MarineSnow, snow_surface

LABEL_OF_ROLE = {
    Role.HULL: Label.HULL,
    Role.MOUNT: Label.MOUNT,
    Role.HARDWARE: Label.MOUNT,
    Role.SERVO: Label.SERVO,
    Role.MIRROR: Label.MIRROR_BACK,
}

BEFORE_PLATE_M = 2e-4
"""How far the mirrors lie before their plates, which have a face in the same plane."""


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
    unoccluded : array, shape (n, 3), optional
        Instead, for what moves: how much of the light around reaches the vertices past the rest of it, by channel.
    mirrors : dict of MirrorPlate, optional
        Mirrors among the triangles, by name: they throw light on what is around them.
    """

    vertices_m: NDArray[np.float64]
    faces: NDArray[np.int32]
    material: NDArray[np.int32]
    label: NDArray[np.int32]
    instance: NDArray[np.int32]
    colour: NDArray[np.float32] | None = None
    ambient: NDArray[np.float64] | None = None
    unoccluded: NDArray[np.float64] | None = None
    mirrors: dict[str, MirrorPlate] | None = None


def rig_meshes_by_group(parts: Sequence[PartMesh]) -> tuple[dict[str, GroupMesh], tuple[str, ...]]:
    """Mesh of every group of parts that has faces, and the parts' names by instance.

    Of the mirrors' plates there are only the edges: their faces are analytic planes in the renderer.
    """
    names = tuple(part.name for part in parts)
    meshes = {}
    for group in Group:
        members = [plate_edge(part) if part.role == Role.MIRROR else part for part in parts if part.group == group]
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


def plate_edge(plate: PartMesh) -> PartMesh:
    """The edge of a mirror's plate, without the reflecting face and the back."""
    return replace(plate, faces=plate.faces[_on_edge(plate)])


def _on_edge(plate: PartMesh) -> NDArray[np.bool_]:
    """Which faces of a plate are its edge's: those across its normal, the direction that most of its area faces."""
    areas = double_area_vectors(plate.vertices_m[plate.faces])
    across = np.linalg.eigh(areas.T @ areas).eigenvectors[:, -1]
    return np.asarray(np.abs(areas @ across) < np.linalg.norm(areas, axis=1) / 2)


def mirror_plates(
    parts: Sequence[PartMesh],
    body_from: Mapping[str, RigidTransform],
    mirrors: Mapping[str, MirrorPlate],
) -> GroupMesh | None:
    """The mirrors' plates without their edges in the body frame, in the light's way, with the mirrors before them."""
    plates = [
        replace(part, vertices_m=body_from[str(part.group)].apply(part.vertices_m), faces=part.faces[~_on_edge(part)])
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


def _before_its_plate(mirror: MirrorPlate) -> MirrorPlate:
    """Mirror, brought forward a little: the plate has a face in its plane."""
    return replace(mirror, centre=mirror.centre + BEFORE_PLATE_M * np.cross(mirror.x, mirror.y))


def moved_mesh(mesh: GroupMesh, pose: RigidTransform) -> GroupMesh:
    """Mesh carried into another frame."""
    mirrors = mesh.mirrors and {name: _moved_plate(mirror, pose) for name, mirror in mesh.mirrors.items()}
    return replace(mesh, vertices_m=pose.apply(mesh.vertices_m), mirrors=mirrors)


def _moved_plate(mirror: MirrorPlate, pose: RigidTransform) -> MirrorPlate:
    x, y = pose.rotation.apply(np.array([mirror.x, mirror.y]))
    return replace(mirror, centre=pose.apply(mirror.centre), x=x, y=y)


def joined_meshes(meshes: Sequence[GroupMesh]) -> GroupMesh:
    """Several coloured meshes of one frame as one, in the given order, with all their mirrors."""
    vertices, faces = joined_triangles((mesh.vertices_m, mesh.faces) for mesh in meshes)
    return GroupMesh(
        vertices_m=vertices,
        faces=faces,
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


def target_mesh(shape: MeshShape, instance: int, label: Label = Label.TARGET) -> GroupMesh:
    """Mesh of a target, one instance; or of a decoy."""
    surface = shape.surface
    return GroupMesh(
        vertices_m=surface.vertices_m,
        faces=surface.faces,
        material=surface.material,
        label=np.full(len(surface.faces), label, dtype=np.int32),
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


def used_vertices(mesh: GroupMesh) -> NDArray[np.float64]:
    """Vertices that are the corner of any face, shape (k, 3)."""
    used = np.zeros(len(mesh.vertices_m), dtype=bool)
    used[mesh.faces] = True
    return mesh.vertices_m[used]


def face_normals(vertices_m: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """Unit normals, counter-clockwise; zero for a face without area."""
    normals = double_area_vectors(np.take(vertices_m, faces, axis=0))
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray(normals / np.where(length > 0, length, 1))


def vertex_normals(vertices_m: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """Normals at vertices, faces weighted by their area; zero for a vertex without faces."""
    area = double_area_vectors(np.take(vertices_m, faces, axis=0))
    total = np.stack(
        [np.bincount(faces.ravel(), np.repeat(column, 3), minlength=len(vertices_m)) for column in area.T], axis=1
    )
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.asarray(total / np.where(length > 0, length, 1))
