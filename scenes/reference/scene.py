"""The description of a scene as Mitsuba scenes: one for every three wavelengths.

A Mitsuba scene's frame has the world's axes and its origin in the robot's body: Mitsuba starts a ray off a surface by a
distance that grows with the coordinates, and at 50 m below the world's origin that would be a window's thickness.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform

from optics.kernels.backend import mi
from optics.layout import Layout, camera_pose
from optics.mesh import Group, PartMesh, Role
from optics.ports.port import NoPort, port_from_spec
from rigs import Rig
from scenes.light.materials import albedo_table
from scenes.reference.bodies import diffuse, mirror_shape, part_shapes, surface_shapes, target_shapes
from scenes.reference.housing import BLACK, housing
from scenes.reference.medium import water_medium
from scenes.reference.opening import with_opening
from scenes.reference.sea import sea_of
from scenes.reference.surface import SeaSurface, lamps
from scenes.stage.scene import Scene

HALF_WIDTH_M, SEA_DEPTH_M = 250.0, 250.0
"""Of the basin with black walls and floor that holds the sea: in the clearest type, light that starts there has
passed more than ten attenuation lengths."""


@dataclass(frozen=True, kw_only=True)
class ReferenceScene:
    """Mitsuba scene, what its camera stands in (None: air), and the camera's pose in the scene's frame."""

    scene: Any
    start_medium: Any
    scene_from_camera: RigidTransform


def reference_scene(
    rig: Rig,
    parts: Sequence[PartMesh],
    described: Scene,
    *,
    q1: float,
    q2: float,
    columns: slice,
    world_from_body: RigidTransform,
    world_from_target: RigidTransform | None,
) -> ReferenceScene:
    """Mitsuba scene of a rig at three of the bands' wavelengths (`columns`); joint values in radians."""
    bands = described.light.bands
    wavelength, albedo = bands.wavelength_nm[columns], albedo_table(bands)[:, columns]
    sea = sea_of(described.light).at(columns)
    water = water_medium(sea)
    scene_from_world = RigidTransform.from_translation(-world_from_body.translation)
    body = RigidTransform.from_rotation(world_from_body.rotation)
    body_from_camera = camera_pose(rig.camera)
    scene_from_camera = body * body_from_camera
    port = port_from_spec(rig.port, rig.water)
    opened = [with_opening(part, port, body_from_camera) if part.role == Role.HULL else part for part in parts]
    n_water = float(np.mean(sea.n_water))
    scene_from = {Group.FIXED: body}
    mirrors: dict[str, Any] = {}
    if rig.gaze is not None:
        layout = Layout.from_rig(rig)
        layout.check_joints(q1, q2)
        scene_from |= {Group.PAN: body * layout.body_from_pan(q1), Group.TILT: body * layout.body_from_m2(q1, q2)}
        poses = {
            "m1": (body * layout.body_from_m1, rig.gaze.fold_mirror),
            "m2": (scene_from[Group.TILT], rig.gaze.gaze_mirror),
        }
        mirrors = {
            name: mirror_shape(pose, plate, n_water, albedo, wavelength, coating=rig.gaze.mount.mirror_coating)
            for name, (pose, plate) in poses.items()
        }
    description: dict[str, Any] = {
        "type": "scene",
        **lamps(sea),
        **basin(float(scene_from_world.translation[2]), SeaSurface(n_water), water),
        **housing(port, scene_from_camera.as_matrix(), water),
        **part_shapes(opened, scene_from, albedo),
        **surface_shapes("world", described.world, scene_from_world, albedo, wavelength),
        **mirrors,
    }
    if described.target is not None:
        placed = scene_from_world * (
            world_from_target if world_from_target is not None else described.target.world_from_target
        )
        description |= target_shapes(described.target.shape, placed, albedo, wavelength)
    return ReferenceScene(
        # Merged shapes would lose their materials.
        scene=mi.load_dict(description, optimize=False),
        start_medium=water if isinstance(port, NoPort) else None,
        scene_from_camera=scene_from_camera,
    )


def basin(surface_height_m: float, surface: Any, water: Any) -> dict[str, Any]:
    """Sea surface, and black walls and a black floor that bound the water far away."""
    floor = surface_height_m - SEA_DEPTH_M
    middle = surface_height_m - SEA_DEPTH_M / 2
    half_depth = SEA_DEPTH_M / 2
    turns = {
        "east": ([0, 1, 0], [half_depth, HALF_WIDTH_M, 1], [HALF_WIDTH_M, 0, middle]),
        "west": ([0, 1, 0], [half_depth, HALF_WIDTH_M, 1], [-HALF_WIDTH_M, 0, middle]),
        "north": ([1, 0, 0], [HALF_WIDTH_M, half_depth, 1], [0, HALF_WIDTH_M, middle]),
        "south": ([1, 0, 0], [HALF_WIDTH_M, half_depth, 1], [0, -HALF_WIDTH_M, middle]),
    }
    described = {
        name: mi.ScalarTransform4f().translate(place).rotate(axis, 90).scale(size)
        for name, (axis, size, place) in turns.items()
    }
    described["floor"] = mi.ScalarTransform4f().translate([0, 0, floor]).scale([HALF_WIDTH_M, HALF_WIDTH_M, 1])
    walls = {
        f"basin_{name}": {"type": "rectangle", "to_world": place, "bsdf": diffuse(BLACK)}
        for name, place in described.items()
    }
    height = mi.ScalarTransform4f().translate([0, 0, surface_height_m]).scale([HALF_WIDTH_M, HALF_WIDTH_M, 1])
    sheet = {"type": "rectangle", "to_world": height, "bsdf": surface, "interior": water}
    return {"sea_surface": sheet, **walls}
