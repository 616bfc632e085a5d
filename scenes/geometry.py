"""What rays can hit: each group of parts, and the world, as a scene of its own in its own frame.

A part that moves is never moved: the ray is carried into its frame instead, so no acceleration structure is rebuilt.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.backend import Float32, UInt32
from optics.mesh import Group, PartMesh, Role, merge
from optics.ray_scene import mesh_scene
from scenes.frame import Label
from scenes.materials import MATERIAL_OF_ROLE
from scenes.worlds import World

Geometry = dict[str, dict[str, Any]]

WORLD = "world"

LABEL_OF_ROLE = {
    Role.HULL: Label.HULL,
    Role.MOUNT: Label.MOUNT,
    Role.HARDWARE: Label.MOUNT,
    Role.SERVO: Label.SERVO,
}


def rig_and_world(parts: Sequence[PartMesh], world: World) -> Geometry:
    """Scene, face normals and face materials of every group that has faces, and of the world.

    The mirrors' plates are left out: their faces are analytic planes in the renderer.
    """
    labels = np.full(len(world.faces), Label.WORLD)
    geometry: Geometry = {WORLD: _hittable(world.vertices_m, world.faces, world.material, labels)}
    for group in Group:
        members = [part for part in parts if part.group == group and part.role != Role.MIRROR]
        if members:
            vertices, faces, owner = merge(members)
            material = np.array([MATERIAL_OF_ROLE[part.role] for part in members], dtype=np.int32)[owner]
            labels = np.array([LABEL_OF_ROLE[part.role] for part in members])[owner]
            geometry[str(group)] = _hittable(vertices, faces, material, labels)
    return geometry


def _hittable(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    material: NDArray[np.int32],
    label: NDArray[np.int64],
) -> dict[str, Any]:
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.where(length > 0, length, 1)
    return {
        "scene": mesh_scene(vertices, faces),
        "normals": [Float32(np.ascontiguousarray(column, dtype=np.float32)) for column in normals.T],
        "material": UInt32(material.astype(np.uint32)),
        "label": UInt32(label.astype(np.uint32)),
    }
