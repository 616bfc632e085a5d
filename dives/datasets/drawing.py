"""What a sample is, by its number: drawn with a generator that has the set's seed and the number, and nothing else.

A draw in which something would be inside hull, world or above the sea is drawn again by the same generator.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from dives.checks import touches_hull
from dives.datasets.distributions import Distribution, Uniform
from dives.datasets.grid import distributions
from dives.datasets.scenes import DatasetScene, radii_m
from dives.datasets.specification import DatasetSpecification, ThingDraws
from optics.gaze.kinematics import forward_gaze
from optics.kernels.arrays import FloatArray
from optics.layout import camera_pose
from scenes.stage.state import State
from scenes.stage.targets import Ball

MOST_ATTEMPTS = 200
"""At a sample with room for all that is in it."""

OFF_M = 0.02
"""Between what is in the water and hull, world and surface, at least."""

ABSENT_M = 2e4
"""How far below everything is what a sample does not have: no ray of a camera goes so far."""

LONGEST_TIME_S = 600.0
"""Waves, flicker and flakes are at a time drawn up to it."""


Thing = tuple[str, ThingDraws]
"""Target or decoy: its place in the file, and what is said there."""


class NoRoomError(ValueError):
    """A sample whose things found no room."""


@dataclass(frozen=True, kw_only=True)
class Sample:
    """A sample before it is rendered.

    Attributes
    ----------
    index : int
    split : str
    scene : int
        Number of its scene.
    values : dict of str to float
        All that was drawn or listed for it, by dotted key.
    present : tuple of bool
        Whether the target and each decoy is there.
    state : State
    """

    index: int
    split: str
    scene: int
    values: dict[str, float]
    present: tuple[bool, ...]
    state: State


def sample_of(scene: DatasetScene, index: int) -> Sample:
    """Sample of a number, in its scene.

    Raises
    ------
    NoRoomError
        When none of many attempts has room for robot, target and decoys.
    """
    spec = scene.dataset.spec
    rng = np.random.default_rng(np.random.SeedSequence([spec.seed, index]))
    split = _split(spec, rng)
    present = tuple(bool(rng.random() < thing.present) for _, thing in _things(spec))
    time_s = round(float(rng.uniform(0, LONGEST_TIME_S)), 3)
    listed, draws = scene.dataset.grid.listed(index), _draws(scene)
    for _ in range(MOST_ATTEMPTS):
        values = listed | {key: each.draw(rng) for key, each in draws.items() if not each.grid}
        state = _state(scene, values, present, time_s)
        reason = _no_room(scene, values, present, state)
        if reason is None:
            return Sample(index=index, split=split, scene=scene.number, values=values, present=present, state=state)
    raise NoRoomError(f"sample {index}: expected room within {MOST_ATTEMPTS} draws; in the last one {reason}")


def _split(spec: DatasetSpecification, rng: np.random.Generator) -> str:
    shares = np.array(list(spec.splits.values()))
    return list(spec.splits)[int(rng.choice(len(shares), p=shares / shares.sum()))]


def _draws(scene: DatasetScene) -> dict[str, Distribution]:
    """What is drawn for each sample, joints over all that they reach where the file says nothing of them."""
    draws = distributions(scene.dataset.spec)
    if scene.rig.gaze is None:
        return {key: each for key, each in draws.items() if not key.startswith("joints.")}
    joints = scene.rig.gaze.joints
    reach = {
        f"joints.{key}": Uniform(low=joint.min_deg, high=joint.max_deg)
        for key, joint in (("q1_deg", joints.pan), ("q2_deg", joints.tilt))
    }
    return reach | draws


def _state(scene: DatasetScene, values: dict[str, float], present: tuple[bool, ...], time_s: float) -> State:
    q1, q2 = np.radians([values.get("joints.q1_deg", 0.0), values.get("joints.q2_deg", 0.0)]).tolist()
    turn = Rotation.from_euler("ZYX", [values[f"robot.{key}_deg"] for key in ("yaw", "pitch", "roll")], degrees=True)
    place = np.array([values[f"robot.{axis}_m"] for axis in "xyz"]) - [0.0, 0.0, scene.stage.depth_m]
    body = RigidTransform.from_components(place, turn)
    poses = [
        _thing_pose(scene, body, (q1, q2), values, thing) if there else _absent()
        for thing, there in zip(_things(scene.dataset.spec), present, strict=True)
    ]
    diameter_m = values.get("target.diameter_m")
    return State(
        q1=q1,
        q2=q2,
        world_from_body=body,
        world_from_target=poses[0],
        target_radius_m=None if diameter_m is None else diameter_m / 2,
        world_from_decoys=tuple(poses[1:]),
        time_s=time_s,
    )


def _things(spec: DatasetSpecification) -> list[Thing]:
    return [("target", spec.target), *((f"decoys[{number}]", each) for number, each in enumerate(spec.decoys))]


def _absent() -> RigidTransform:
    return RigidTransform.from_translation([0.0, 0.0, -ABSENT_M])


def _thing_pose(
    scene: DatasetScene, body: RigidTransform, joints: tuple[float, float], values: dict[str, float], thing: Thing
) -> RigidTransform:
    """Pose in the world of a thing that is seen from the gaze mirror, or from the bow."""
    key, draws = thing
    origin, axes = (np.zeros(3), np.eye(3)) if draws.seen_from == "bow" else _gaze_axes(scene, joints)
    azimuth, elevation = np.radians([values[f"{key}.azimuth_deg"], values[f"{key}.elevation_deg"]])
    direction = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    place = origin + values[f"{key}.distance_m"] * (axes @ direction)
    return RigidTransform.from_components(
        body.apply(place), Rotation.from_euler("z", values[f"{key}.yaw_deg"], degrees=True)
    )


def _gaze_axes(scene: DatasetScene, joints: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """Where the gaze begins, body frame, and its axes as columns: forward, left (level), up."""
    if scene.layout is None:
        pose = camera_pose(scene.rig.camera)
        origin, forward = pose.translation, pose.rotation.as_matrix()[:, 2]
    else:
        origin = scene.layout.body_from_gimbal.translation
        forward = forward_gaze(scene.layout, *joints).direction
    left = np.cross([0.0, 0.0, 1.0], forward)
    # Straight up or down no direction is level: the robot's own left is.
    left = left / np.linalg.norm(left) if np.linalg.norm(left) > 1e-6 else np.array([0.0, 1.0, 0.0])
    return np.asarray(origin), np.stack([forward, left, np.cross(forward, left)], axis=1)


def _no_room(scene: DatasetScene, values: dict[str, float], present: tuple[bool, ...], state: State) -> str | None:
    """What a draw has no room for, or None."""
    body, target = state.world_from_body, state.world_from_target
    assert body is not None and target is not None and state.world_from_decoys is not None
    moved = any(values[f"robot.{axis}_m"] for axis in "xyz")
    # A world leaves room about its own axis.
    if moved and not _is_free(scene, body.translation, scene.hull_radius_m):
        return "the robot touches world or surface"
    radii = radii_m(scene)
    if state.target_radius_m is not None:
        radii[0] = state.target_radius_m
    for name, pose, radius, there in zip(
        ("target", *(f"decoy {number}" for number in range(len(radii) - 1))),
        (target, *state.world_from_decoys),
        radii,
        present,
        strict=True,
    ):
        if there and not _is_free(scene, pose.translation, radius):
            return f"the {name} touches world or surface"
        if there and _touches_robot(scene, body, pose.translation, radius):
            return f"the {name} touches the robot"
    return None


def _is_free(scene: DatasetScene, place_m: FloatArray, radius_m: float) -> bool:
    below = place_m[2] + radius_m + OFF_M < 0
    return bool(below and scene.clearance.metres(place_m[np.newaxis])[0] > radius_m + OFF_M)


def _touches_robot(scene: DatasetScene, body: RigidTransform, place_m: FloatArray, radius_m: float) -> bool:
    if scene.layout is None or scene.rig.gaze is None:
        return False
    mirror = scene.rig.gaze.gaze_mirror
    reach_m = np.hypot(mirror.width_mm, mirror.height_mm) / 2000
    apart_m = np.linalg.norm(body.inv().apply(place_m) - scene.layout.body_from_gimbal.translation)
    if apart_m < radius_m + reach_m + OFF_M:
        return True
    poses = RigidTransform.from_matrix(body.as_matrix()[np.newaxis])
    return bool(touches_hull(scene.rig, poses, place_m[np.newaxis], radius_m + OFF_M)[0])


def target_radius_m(scene: DatasetScene, state: State) -> float | None:
    """Radius of a target that is a ball."""
    shape: Any = None if scene.stage.target is None else scene.stage.target.shape
    if not isinstance(shape, Ball):
        return None
    return shape.radius_m if state.target_radius_m is None else state.target_radius_m
