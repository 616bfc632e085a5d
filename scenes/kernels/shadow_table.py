"""Kernel: the robot's shadow on a surface near it, between the nodes of a table.

The table holds the irradiance that a plane facing the robot's middle would miss, over open water's on a plane that
faces up at the same depth, times the square of its distance in metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.kernels.backend import Float32, UInt32, dr
from optics.kernels.packing import between
from optics.kernels.powers import decay
from scenes.kernels.direction_grid import nodes_around
from scenes.light.uniforms import LightUniforms

AZIMUTHS, ELEVATIONS = 48, 25
"""Nodes by direction from the robot, world frame."""

DISTANCES = 8
DISTANCE_SCALE_M = 1.5
"""Nodes are even in ``d / (d + DISTANCE_SCALE_M)``, from the nearest to `FARTHEST_M`."""

FARTHEST_M = 12.0
ROW = 8
"""Three channels at a node, and at the next distance."""


def distances_m(nearest_m: float) -> FloatArray:
    """Distances of the nodes from the robot's middle."""
    first, last = (d / (d + DISTANCE_SCALE_M) for d in (nearest_m, FARTHEST_M))
    share = np.linspace(first, last, DISTANCES)
    return np.asarray(DISTANCE_SCALE_M * share / (1 - share))


@dataclass(frozen=True, kw_only=True)
class ShadowTable:
    """What the robot hides of the light around it from surfaces: Dr.Jit's numbers.

    Attributes
    ----------
    values : Float32
        Rows of the table, flat.
    middle : list of Float32
        Of the robot, body frame.
    radius : Float32
        Of a ball about the middle that holds the robot: the distance of the nearest nodes.
    shadow_radius : Float32
        Of a disc as wide as the robot's shadow.
    """

    values: Any
    middle: list[Any]
    radius: Any
    shadow_radius: Any


def hidden_from_surface(
    shadow: ShadowTable, light: LightUniforms, from_robot: Any, normal: Any, depth: Any
) -> list[Any]:
    """Kernel: irradiance by channel that is missing at a place, seen from the robot's middle, with a normal."""
    distance = dr.norm(from_robot)
    direction = from_robot / distance
    nearest, farthest = (d / (d + DISTANCE_SCALE_M) for d in (shadow.radius, FARTHEST_M))
    reach = (distance / (distance + DISTANCE_SCALE_M) - nearest) / (farthest - nearest) * (DISTANCES - 1)
    reach = dr.clip(reach, 0, DISTANCES - 1)
    node = dr.minimum(UInt32(reach), DISTANCES - 2)
    along = reach - Float32(node)
    facing = dr.maximum(-dr.dot(direction, normal), 0) / dr.square(dr.maximum(distance, shadow.radius))
    total = [Float32(0)] * 3
    for row, weight in nodes_around(direction, UInt32(0), AZIMUTHS, ELEVATIONS):
        values = between(shadow.values, row * DISTANCES + node, along, ROW)[:3]
        total = [dr.fma(v, facing * weight, t) for v, t in zip(values, total, strict=True)]
    fall = depth - light.reference_depth_m
    open_water = zip(total, light.ambient_up, light.ambient_fall, strict=True)
    return [share * facing_up * decay(k * fall) for share, facing_up, k in open_water]
