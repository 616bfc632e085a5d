"""A state: where joints, robot and target are at one instant."""

from __future__ import annotations

from dataclasses import dataclass

from scipy.spatial.transform import RigidTransform


@dataclass(frozen=True, kw_only=True)
class State:
    """One instant of a dive, as the renderer needs it.

    Attributes
    ----------
    q1, q2 : float
        Pan and tilt, radians.
    world_from_body : RigidTransform, optional
        The robot's pose; the scene's when None.
    world_from_target : RigidTransform, optional
        The target's pose; the scene's when None.
    target_radius_m : float, optional
        Of a target that is a ball; the scene's when None.
    world_from_decoys : tuple of RigidTransform, optional
        Poses of the scene's decoys, in their order; the scene's when None.
    time_s : float
        Clock of everything that moves by itself: waves, flicker, snow.
    """

    q1: float = 0.0
    q2: float = 0.0
    world_from_body: RigidTransform | None = None
    world_from_target: RigidTransform | None = None
    target_radius_m: float | None = None
    world_from_decoys: tuple[RigidTransform, ...] | None = None
    time_s: float = 0.0
