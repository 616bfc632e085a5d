"""The robot's shadow on the world, in the light that comes from everywhere but the sun."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import RigidTransform

from optics.kernels.arrays import FloatArray
from optics.kernels.backend import Float32, dr
from optics.kernels.packing import opaque_numbers, pairs_of
from scenes.baking.ambient import cached
from scenes.baking.robot_light import RobotLight
from scenes.kernels.direction_grid import node_directions
from scenes.kernels.shadow_table import AZIMUTHS, DISTANCES, ELEVATIONS, ROW, ShadowTable, distances_m


def shadow_on_world(around: RobotLight, world_from_body: RigidTransform) -> ShadowTable:
    """Table of what the robot hides from surfaces (`scenes.kernels.shadow_table`).

    Parameters
    ----------
    around : RobotLight
        What the robot changes of the light.
    world_from_body : RigidTransform
        Its pose.
    """
    extent = around.extent

    def hidden() -> FloatArray:
        distance = distances_m(extent.radius)
        offset = node_directions(AZIMUTHS, ELEVATIONS)[:, np.newaxis] * distance[:, np.newaxis]
        points = extent.middle + offset.reshape(-1, 3)
        missing = around.missing_from_plane(points)
        share = missing / around.light.ambient_up(-points[:, 2])
        return share.reshape(-1, DISTANCES, 3) * distance[:, np.newaxis] ** 2

    middle = world_from_body.inv().apply(extent.middle)
    values = cached(around.robot, around.light, around.quality, "shadow of the robot on the world", hidden)
    return ShadowTable(
        values=pairs_of(values, ROW),
        middle=opaque_numbers(middle),
        radius=dr.opaque(Float32, extent.radius),
        shadow_radius=dr.opaque(Float32, extent.shadow_radius),
    )
