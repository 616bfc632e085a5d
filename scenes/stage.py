"""A stage: everything around the rig that a picture needs - world, water and sun, where the robot is, a target."""

from __future__ import annotations

from dataclasses import dataclass
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import RigidTransform

from optics.arrays import check_vector
from rigs import JerlovType, Rig
from scenes.light import Light, Sun, underwater_light
from scenes.worlds import WORLDS, World


@dataclass(frozen=True, kw_only=True)
class Target:
    """A ball in the world frame, metres."""

    centre_m: ArrayLike
    radius_m: float

    def __post_init__(self) -> None:
        check_vector("centre_m", self.centre_m)
        if not self.radius_m > 0:
            raise ValueError(f"expected radius_m > 0, got {self.radius_m}")


@dataclass(frozen=True, kw_only=True)
class Stage:
    """World, light, the robot's pose and the target; the robot's depth is the camera exposure's too."""

    world: World
    light: Light
    world_from_body: RigidTransform
    target: Target | None = None

    @property
    def depth_m(self) -> float:
        """Depth of the body's origin below the surface."""
        return float(-self.world_from_body.translation[2])


TANK_BALL_M = (1.85, 0.90, -0.73)
"""Where the tank's ball hangs, from the body: for aqua2 on the gaze axis of q1 = 30, q2 = -10 degrees, 2 m away."""

TANK_BALL_RADIUS_M = 0.1


def stage(
    rig: Rig,
    *,
    world: str = "tank",
    depth_m: float = 5.0,
    jerlov_type: str | None = None,
    sun: Sun | None = None,
) -> Stage:
    """Put a rig's robot level into a world at a depth, in its own water or in another Jerlov type.

    Raises
    ------
    ValueError
        For an unknown world, or a depth at which the robot would touch the surface.
    """
    if world not in WORLDS:
        raise ValueError(f"expected a world ({', '.join(sorted(WORLDS))}), got {world!r}")
    if not 0.5 <= depth_m <= 100:
        raise ValueError(f"expected a depth from 0.5 to 100 m, got {depth_m:g} m")
    if jerlov_type is not None and jerlov_type not in get_args(JerlovType):
        raise ValueError(f"expected a Jerlov type ({', '.join(get_args(JerlovType))}), got {jerlov_type!r}")
    water = rig.water if jerlov_type is None else rig.water.model_copy(update={"jerlov_type": jerlov_type})
    position = np.array([0.0, 0.0, -depth_m])
    return Stage(
        world=WORLDS[world](depth_m),
        light=underwater_light(water, sun or Sun()),
        world_from_body=RigidTransform.from_translation(position),
        target=Target(centre_m=position + TANK_BALL_M, radius_m=TANK_BALL_RADIUS_M),
    )
