"""How hull and mount occlude light from each other: which share of the light around reaches each place of the robot.

The shares are found once, for the robot in open water in a scene's attitude, its joints at zero, by the gathering of
`scenes.baking.ambient`. They hold for the light from above that a hull occludes for what is below it; that they turn
with the robot, and move with the joints, is an approximation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from optics.kernels.cache import Arrays, load_or_make, result_key
from scenes.baking.ambient import PlaceSizes, Surroundings, with_ambient
from scenes.baking.light_quality import LightQuality
from scenes.light.light import Light
from scenes.stage.group_mesh import GroupMesh, face_normals, joined_meshes, moved_mesh

LONGEST_EDGE_M = 0.05
"""Faces are divided until the light can vary over them so finely."""

DIVISION_VERSION = 1
"""Raised when the same mesh is divided otherwise."""

PLACES_M = PlaceSizes(iterated=0.01, kept=0.001)
"""Vertices nearer to each other share the light that they receive."""

DEPTH_M = 5.0
"""Where the robot is taken to be; the shares hardly depend on it."""

NORMAL_STEPS = 8
"""Corners whose faces' normals agree to one part in this number share their light."""

LARGEST_SHARE = 2.0
"""White parts throw light up, where open water sends less; and a share of very little may be anything."""


def with_occlusion(
    meshes: Mapping[str, GroupMesh],
    body_from: Mapping[str, RigidTransform],
    mirrors: GroupMesh | None,
    light: Light,
    quality: LightQuality,
    *,
    world_from_body: RigidTransform,
) -> tuple[dict[str, GroupMesh], GroupMesh, Callable[[], Surroundings]]:
    """Meshes of the rig's groups, each in its own frame, with the share of light that reaches each vertex.

    With them come all of them together as one lit mesh of the world frame, and what makes the surroundings that it is
    without its light, once: where all is in the cache nobody needs them.

    Parameters
    ----------
    body_from : mapping of RigidTransform
        Pose of each group in the body frame.
    mirrors : GroupMesh, optional
        In the light's way, and throwing some back, body frame (`scenes.kernels.geometry.mirror_plates`).
    world_from_body : RigidTransform
        Pose of the body in the world (`at_rest`).
    """
    fine = {name: _divided(mesh) for name, mesh in meshes.items()}
    placed = [moved_mesh(mesh, world_from_body * body_from[name]) for name, mesh in fine.items()]
    whole = joined_meshes([*placed, *([] if mirrors is None else [moved_mesh(mirrors, world_from_body)])])
    around = cache(lambda: Surroundings.of(whole, light))
    lit = with_ambient(whole, light, quality, PLACES_M, around)
    assert lit.ambient is not None
    result, start = {}, 0
    for (name, mesh), world in zip(fine.items(), placed, strict=True):
        count = len(mesh.vertices_m)
        normals = np.zeros((count, 3))
        normals[world.faces] = face_normals(world.vertices_m, world.faces)[:, np.newaxis]
        open_water = light.open_water_irradiance(-world.vertices_m[:, 2], normals)
        share = lit.ambient[start : start + count] / np.maximum(open_water, 1e-30)
        result[name] = replace(mesh, unoccluded=np.clip(share, 0, LARGEST_SHARE))
        start += count
    return result, lit, around


def at_rest(world_from_body: RigidTransform) -> RigidTransform:
    """Pose with the same attitude at the depth for which the shares are found."""
    return RigidTransform.from_components([0.0, 0.0, -DEPTH_M], world_from_body.rotation)


def _divided(mesh: GroupMesh) -> GroupMesh:
    """Mesh with short edges, whose vertices belong to faces of about one normal."""
    key = result_key("divided part", DIVISION_VERSION, mesh.vertices_m, mesh.faces, LONGEST_EDGE_M, NORMAL_STEPS)

    def unchanged(arrays: Arrays) -> Arrays:
        return arrays

    def made() -> Arrays:
        return divided_faces(mesh.vertices_m, mesh.faces)

    found = load_or_make("divided part", key, made, pack=unchanged, unpack=unchanged)
    origin = found["origin"]
    return GroupMesh(
        vertices_m=found["vertices_m"],
        faces=found["faces"],
        material=mesh.material[origin],
        label=mesh.label[origin],
        instance=mesh.instance[origin],
        colour=np.ones((len(found["vertices_m"]), 3), dtype=np.float32),
    )


def divided_faces(vertices_m: NDArray[np.float64], faces: NDArray[np.int32]) -> Arrays:
    """Vertices and faces with short edges, each vertex of faces of about one normal, and the face that each was in."""
    import trimesh  # noqa: PLC0415  (takes longer to import than a frame to render)

    vertices, fine, origin = trimesh.remesh.subdivide_to_size(
        vertices_m, faces, LONGEST_EDGE_M, max_iter=20, return_index=True
    )
    normals = np.round(face_normals(vertices, fine) * NORMAL_STEPS).astype(np.int64)
    # Vertex and normal as one number: many times as fast to tell apart as rows.
    number = fine.ravel()
    for step in np.repeat(normals + NORMAL_STEPS, 3, axis=0).T:
        number = number * (2 * NORMAL_STEPS + 1) + step
    corners, corner_of = np.unique(number, return_inverse=True)
    return {
        "vertices_m": vertices[corners // (2 * NORMAL_STEPS + 1) ** 3],
        "faces": corner_of.reshape(-1, 3).astype(np.int32),
        "origin": origin,
    }
