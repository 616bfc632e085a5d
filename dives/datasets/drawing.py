"""What a sample is, by its number: drawn with a generator that has the set's seed and the number, and nothing else.

A draw in which something would be inside hull, world or above the sea is drawn again by the same generator.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
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
    clip, frame : int
        Number of its clip, and its own in it.
    state : State
    next_state : State
        A frame later.
    """

    index: int
    split: str
    scene: int
    values: dict[str, float]
    present: tuple[bool, ...]
    clip: int
    frame: int
    state: State
    next_state: State


@dataclass(frozen=True, kw_only=True)
class Clip:
    """What is drawn once for frames that follow each other: values at the first one, and the clock there."""

    split: str
    values: dict[str, float]
    present: tuple[bool, ...]
    time_s: float


def sample_of(scene: DatasetScene, index: int) -> Sample:
    """Sample of a number, in its scene.

    Raises
    ------
    NoRoomError
        When none of many attempts has room for robot, target and decoys.
    """
    number, frame = divmod(index, scene.dataset.spec.clip.frames)
    clip = clip_of(scene, number)
    return Sample(
        index=index,
        split=clip.split,
        scene=scene.number,
        values=clip.values,
        present=clip.present,
        clip=number,
        frame=frame,
        state=_state(scene, clip, frame),
        next_state=_state(scene, clip, frame + 1),
    )


@lru_cache(maxsize=2)
def clip_of(scene: DatasetScene, number: int) -> Clip:
    """Clip of a number, in its scene: one with room in all frames; see `sample_of`."""
    spec = scene.dataset.spec
    rng = np.random.default_rng(np.random.SeedSequence([spec.seed, number]))
    split = _split(spec, rng)
    present = tuple(bool(rng.random() < thing.present) for _, thing in _things(spec))
    time_s = round(float(rng.uniform(0, LONGEST_TIME_S)), 3)
    listed, draws = scene.dataset.grid.listed(number), _draws(scene)
    # The flow of the last frame leads to one more.
    frames = range(spec.clip.frames + spec.clip.flow)
    for _ in range(MOST_ATTEMPTS):
        values = listed | {key: each.draw(rng) for key, each in draws.items() if not each.grid}
        clip = Clip(split=split, values=values, present=present, time_s=time_s)
        reason = next((why for frame in frames if (why := _no_room(scene, clip, frame)) is not None), None)
        if reason is None:
            return clip
    what = "sample" if spec.clip.frames == 1 else "clip"
    raise NoRoomError(f"{what} {number}: expected room within {MOST_ATTEMPTS} draws; in the last one {reason}")


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


def _state(scene: DatasetScene, clip: Clip, frame: int) -> State:
    """Where everything is in a frame of a clip."""
    after_s = frame / scene.dataset.spec.clip.frame_rate_hz
    first, now = clip.values, _moved(clip.values, after_s)
    poses = [
        _thing_pose(scene, first, thing, after_s) if there else _absent()
        for thing, there in zip(_things(scene.dataset.spec), clip.present, strict=True)
    ]
    diameter_m = first.get("target.diameter_m")
    q1, q2 = _joints(now)
    return State(
        q1=q1,
        q2=q2,
        world_from_body=_body_pose(scene, now),
        world_from_target=poses[0],
        target_radius_m=None if diameter_m is None else diameter_m / 2,
        world_from_decoys=tuple(poses[1:]),
        time_s=clip.time_s + after_s,
    )


def _moved(values: dict[str, float], after_s: float) -> dict[str, float]:
    """Values of joints and robot after a time."""
    moving = [key for key in values if key.startswith(("joints.", "robot.")) and f"{key}_per_s" in values]
    return values | {key: values[key] + after_s * values[f"{key}_per_s"] for key in moving}


def _joints(values: dict[str, float]) -> tuple[float, float]:
    """Joint values, radians; zero without mirrors."""
    q1, q2 = np.radians([values.get("joints.q1_deg", 0.0), values.get("joints.q2_deg", 0.0)]).tolist()
    return q1, q2


def _body_pose(scene: DatasetScene, values: dict[str, float]) -> RigidTransform:
    turn = Rotation.from_euler("ZYX", [values[f"robot.{key}_deg"] for key in ("yaw", "pitch", "roll")], degrees=True)
    place = np.array([values[f"robot.{axis}_m"] for axis in "xyz"]) - [0.0, 0.0, scene.stage.depth_m]
    return RigidTransform.from_components(place, turn)


def _things(spec: DatasetSpecification) -> list[Thing]:
    return [("target", spec.target), *((f"decoys[{number}]", each) for number, each in enumerate(spec.decoys))]


def _absent() -> RigidTransform:
    return RigidTransform.from_translation([0.0, 0.0, -ABSENT_M])


def _thing_pose(scene: DatasetScene, values: dict[str, float], thing: Thing, after_s: float) -> RigidTransform:
    """Pose in the world of a thing that is first seen from the gaze mirror, or from the bow."""
    key, draws = thing
    origin, axes = (np.zeros(3), np.eye(3)) if draws.seen_from == "bow" else _gaze_axes(scene, _joints(values))
    azimuth, elevation = np.radians([values[f"{key}.azimuth_deg"], values[f"{key}.elevation_deg"]])
    direction = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    first = _body_pose(scene, values).apply(origin + values[f"{key}.distance_m"] * (axes @ direction))
    velocity = np.array([values[f"{key}.{axis}_m_per_s"] for axis in "xyz"])
    return RigidTransform.from_components(
        first + after_s * velocity, Rotation.from_euler("z", values[f"{key}.yaw_deg"], degrees=True)
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


def _no_room(scene: DatasetScene, clip: Clip, frame: int) -> str | None:
    """What a frame of a clip has no room for, or None."""
    state = _state(scene, clip, frame)
    if scene.layout is not None:
        try:
            scene.layout.check_joints(state.q1, state.q2)
        except ValueError:
            return "the joints go beyond their limits"
    body, target = state.world_from_body, state.world_from_target
    assert body is not None and target is not None and state.world_from_decoys is not None
    # A world leaves room about its own axis.
    away = np.add(body.translation, [0.0, 0.0, scene.stage.depth_m]).any()
    if away and not _is_free(scene, body.translation, scene.hull_radius_m):
        return "the robot touches world or surface"
    radii = radii_m(scene)
    if state.target_radius_m is not None:
        radii[0] = state.target_radius_m
    for name, pose, radius, there in zip(
        ("target", *(f"decoy {number}" for number in range(len(radii) - 1))),
        (target, *state.world_from_decoys),
        radii,
        clip.present,
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
