"""The robot's shadow on the world, in the light that comes from everywhere but the sun."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import RigidTransform

from optics.kernels.arrays import FloatArray
from optics.kernels.backend import Float32, dr
from optics.kernels.packing import opaque_numbers, pairs_of
from scenes.baking.ambient import cached
from scenes.baking.light_quality import LightQuality
from scenes.baking.robot_light import RobotLight, extent_of
from scenes.kernels.direction_grid import node_directions
from scenes.kernels.shadow_table import AZIMUTHS, DISTANCES, ELEVATIONS, ROW, ShadowTable, distances_m
from scenes.light.light import Light
from scenes.stage.group_mesh import GroupMesh


def shadow_on_world(
    robot: GroupMesh, world_from_body: RigidTransform, light: Light, quality: LightQuality
) -> ShadowTable:
    """Table of what the robot hides from surfaces (`scenes.kernels.shadow_table`).

    Parameters
    ----------
    robot : GroupMesh
        All parts in the world frame, lit (`scenes.baking.ambient`).
    world_from_body : RigidTransform
        Its pose.
    light : Light
    quality : LightQuality
    """
    extent = extent_of(robot)

    def hidden() -> FloatArray:
        distance = distances_m(extent.radius)
        offset = node_directions(AZIMUTHS, ELEVATIONS)[:, np.newaxis] * distance[:, np.newaxis]
        points = extent.middle + offset.reshape(-1, 3)
        missing = RobotLight(robot, light, quality).missing_from_plane(points)
        share = missing / light.ambient_up(-points[:, 2])
        return share.reshape(-1, DISTANCES, 3) * distance[:, np.newaxis] ** 2

    middle = world_from_body.inv().apply(extent.middle)
    return ShadowTable(
        values=pairs_of(cached(robot, light, quality, "shadow of the robot on the world", hidden), ROW),
        middle=opaque_numbers(middle),
        radius=dr.opaque(Float32, extent.radius),
        shadow_radius=dr.opaque(Float32, extent.shadow_radius),
    )
