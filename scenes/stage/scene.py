"""A scene: everything around the rig that an image needs - world, water and sun, where the robot is, a target."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import cast, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import RigidTransform

from optics.kernels.arrays import FloatArray, check_vector
from optics.layout import Layout, camera_pose
from optics.status import Status
from optics.train import OpticalTrain
from rigs import JerlovType, Rig, Water
from scenes.light.light import Light, underwater_light
from scenes.light.sea import Sea
from scenes.light.sky import Daylight
from scenes.light.spectrum import bands_of_camera
from scenes.light.sun import Sun
from scenes.light.waves import Wind
from scenes.stage.problems import Problems
from scenes.stage.targets import Ball, MeshShape, TargetShape, target_named
from scenes.worlds import World, world_named
from scenes.worlds.snow import MarineSnow


@dataclass(frozen=True, kw_only=True)
class Target:
    """What the robot is to look at: a shape, and its pose in the world."""

    shape: TargetShape
    world_from_target: RigidTransform


def ball(centre_m: ArrayLike, radius_m: float) -> Target:
    """A red ball with its centre at a place in the world."""
    pose = RigidTransform.from_translation(check_vector("centre_m", centre_m))
    return Target(shape=Ball(radius_m=radius_m), world_from_target=pose)


@dataclass(frozen=True, kw_only=True)
class Scene:
    """World, light, sea surface, the robot's pose, target, other things that move, and snow.

    The robot's depth is the camera exposure's too.
    """

    world: World
    light: Light
    world_from_body: RigidTransform
    sea: Sea
    target: Target | None = None
    decoys: tuple[Target, ...] = ()
    snow: MarineSnow | None = None

    @property
    def depth_m(self) -> float:
        """Depth of the body's origin below the surface."""
        return float(-self.world_from_body.translation[2])


TARGET_M = (1.85, 0.90, -0.73)
"""Where the target is, from the body: for aqua2 on the gaze axis of q1 = 30, q2 = -10 degrees, 2 m away."""

WIND_M_PER_S = 3.0
"""Gentle breeze: waves that show, and a sun that glitters."""

DEPTHS_M = (0.5, 100.0)


def on_gaze(rig: Rig, *, q1: float, q2: float, distance_m: float) -> FloatArray:
    """Point in the body frame on the axis of a pose, shape (3,): what hangs there is seen where the axis is.

    The axis is the ray of the principal point; the distance counts from where that ray leaves the gaze mirror, or the
    port of a rig without mirrors.

    Raises
    ------
    ValueError
        For joints (radians) outside their limits, a distance that is not positive, or an axis that misses a mirror.
    """
    if not (distance_m > 0 and np.isfinite(distance_m)):
        raise ValueError(f"expected a distance above 0 m, got {distance_m:g} m")
    if rig.gaze is not None:
        Layout.from_rig(rig).check_joints(q1, q2)
    train = OpticalTrain.from_rig(rig, q1=q1, q2=q2)
    ray = train.trace([[rig.camera.cx_px, rig.camera.cy_px]])
    if ray.status[0] != Status.OK:
        status = Status(ray.status[0]).name.lower().replace("_", " ")
        raise ValueError(f"expected an axis that leaves over all mirrors, to hang a target on it, got {status!r}")
    pose = camera_pose(rig.camera)
    return np.asarray(pose.apply(ray.origin_m[0]) + distance_m * pose.rotation.apply(ray.direction[0]))


def make_scene(
    rig: Rig,
    *,
    world: str | Path = "tank",
    depth_m: float = 5.0,
    jerlov_type: str | None = None,
    sun: Sun | None = None,
    cloud: float = 0.0,
    wind: Wind | None = None,
    target: str | Path | TargetShape = "ball",
    target_m: ArrayLike = TARGET_M,
    snow: bool = False,
    seed: int = 0,
) -> Scene:
    """Put a rig's robot level into a world at a depth, in its own water or in another Jerlov type.

    Parameters
    ----------
    rig : Rig
    world : str or Path
        tank, reef, blue, or a file (`scenes.worlds.world_named`).
    depth_m : float
        Of the robot.
    jerlov_type : str, optional
        Jerlov type instead of the rig's own water.
    sun : Sun, optional
        60 degrees high by default.
    cloud : float
        Covered share of the sky, 0 to 1.
    wind : Wind, optional
        Over the sea; 3 m/s by default. Without any the surface is flat and nothing flickers.
    target : str, Path or TargetShape
        ball, buoy, diver, fish, or a file (`scenes.stage.targets.target_named`); or a shape.
    target_m : array_like, shape (3,)
        Where it is, from the body (`on_gaze`).
    snow : bool
        Marine snow in the water.
    seed : int
        Of what is random in the world.

    Raises
    ------
    ValueError
        With everything that is wrong: an unknown world, target or water, a sky more than covered, a depth at which the
        robot would touch the surface, a target above it.
    """
    problems = Problems()
    depth_fits = DEPTHS_M[0] <= depth_m <= DEPTHS_M[1]
    with problems.collecting():
        if not depth_fits:
            raise ValueError(f"expected a depth from {DEPTHS_M[0]:g} to {DEPTHS_M[1]:g} m, got {depth_m:g} m")
        position = np.array([0.0, 0.0, -depth_m])
        place = position + check_vector("target_m", target_m)
        if not place[2] < 0:
            raise ValueError(f"expected a target below the surface, got one {place[2]:.2f} m above it")
    with problems.collecting():
        # At a depth that is no good, only to hear what else is wrong.
        around = world_named(world, depth_m if depth_fits else DEPTHS_M[1], seed)
    with problems.collecting():
        light = scene_light(rig, jerlov_type=jerlov_type, sun=sun, cloud=cloud)
    with problems.collecting():
        shape = target if isinstance(target, Ball | MeshShape) else target_named(target)
    problems.raise_any()
    return Scene(
        world=around,
        light=light,
        sea=Sea(light=light, wind=wind or Wind(speed_m_per_s=WIND_M_PER_S), seed=seed),
        world_from_body=RigidTransform.from_translation(position),
        target=Target(shape=shape, world_from_target=RigidTransform.from_translation(place)),
        snow=MarineSnow(seed=seed) if snow else None,
    )


def scene_light(rig: Rig, *, jerlov_type: str | None = None, sun: Sun | None = None, cloud: float = 0.0) -> Light:
    """Light under water as `make_scene` has it, without a world; `ValueError` with all that is wrong with it."""
    bands = bands_of_camera(rig.camera)
    problems = Problems()
    with problems.collecting():
        water = rig.water if jerlov_type is None else _water(rig, jerlov_type)
    with problems.collecting():
        daylight = Daylight(wavelength_nm=bands.wavelength_nm, sun=sun or Sun(), cloud=cloud)
    problems.raise_any()
    coating = rig.gaze.mount.mirror_coating if rig.gaze else "protected-aluminium"
    return underwater_light(water, daylight, bands, coating)


def _water(rig: Rig, jerlov_type: str) -> Water:
    if jerlov_type not in get_args(JerlovType):
        raise ValueError(f"expected a Jerlov type ({', '.join(get_args(JerlovType))}), got {jerlov_type!r}")
    return rig.water.of_type(cast(JerlovType, jerlov_type))
