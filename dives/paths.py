"""Where robot, target and decoys are at a time of a dive, in closed form: the truth that no sea trial knows.

Paths are counted from the robot's start: where its body's origin is at rest, at the dive's depth, x ahead, y to the
left, z up. The start lies on the world's z axis, its bow along the world's x. Only a path from a file may be given in
another frame, its map's: that of the robot's own file, whose first pose is the start.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import RigidTransform, Rotation

from dives.specification import Decoy, DiveSpecification
from dives.trajectories.attitude_sensor import SimulatedAttitude
from dives.trajectories.motions import (
    Circle,
    FromFile,
    Legs,
    PathStart,
    Spiral,
    Straight,
    Sway,
    TargetPath,
    Travel,
    TravelFromFile,
)
from dives.trajectories.timed_paths import timed_path
from optics.kernels.arrays import FloatArray
from tracking.protocols import AttitudeSensor

SWAY_STREAM = 1
"""Second number of the seed of the sway's phases; frames' noise has the first one and the frame's number."""


def target_pose(dive: DiveSpecification, time_s: ArrayLike) -> RigidTransform:
    """Pose of the target in the world: one, or for times of shape (n,) as many.

    Its attitude is its file's if there is one; else x is along its path (level), z up. What stays where it is has the
    start's axes.
    """
    return _path_pose(dive, dive.target.course, dive.target.start, time_s)


def decoy_pose(dive: DiveSpecification, decoy: Decoy, time_s: ArrayLike) -> RigidTransform:
    """Pose of a decoy in the world, as the target's."""
    return _path_pose(dive, decoy.course, PathStart(), time_s)


def _path_pose(dive: DiveSpecification, path: TargetPath, start: PathStart, time_s: ArrayLike) -> RigidTransform:
    times = np.asarray(time_s, dtype=np.float64)
    turn, shift = _moved_to_start(dive, path, start)
    points, heading = path_places(dive, path, np.atleast_1d(times))
    yaw = np.arctan2(heading[..., 1], heading[..., 0])
    attitude = _file_attitude(dive, path, np.atleast_1d(times)) or _turned(yaw)
    poses = RigidTransform.from_components(turn.apply(points) + shift - [0.0, 0.0, dive.depth_m], turn * attitude)
    return poses if times.ndim else poses[0]


def body_pose(dive: DiveSpecification, time_s: ArrayLike) -> RigidTransform:
    """Pose of the robot's body in the world: one, or for times of shape (n,) as many."""
    times = np.asarray(time_s, dtype=np.float64)
    place, yaw = np.zeros((*times.shape, 3)), np.zeros(times.shape)
    motion = dive.robot
    if isinstance(motion, Travel):
        place = along_legs(motion, np.atleast_1d(times))[0].reshape(place.shape)
        yaw = np.interp(times, *_turns(motion))
    heading = _turned(yaw)
    if isinstance(motion, TravelFromFile):
        path, turn_back, first_m = timed_path(motion.file), *_start_of(motion)
        at = np.atleast_1d(times) + begins_s(motion)
        place = turn_back.apply(path.places(at)[0] - first_m).reshape(place.shape)
        attitude = path.attitudes(at)
        if attitude is not None:
            turned = turn_back * attitude
            heading = turned if times.ndim else turned[0]
    sway_m, turn = swayed(motion.sway, dive.seed, times)
    # Body x ahead, y left, z up: positive pitch of the sway's sine is bow up, a negative turn about y. The sign of a
    # sine with any phase does not matter.
    pose = heading * Rotation.from_euler("ZYX", turn[..., ::-1])
    return RigidTransform.from_components(place + heading.apply(sway_m) - [0.0, 0.0, dive.depth_m], pose)


def attitude_sensor(dive: DiveSpecification) -> AttitudeSensor | None:
    """The robot's attitude sensor; None when the dive has none."""
    if dive.attitude is None:
        return None
    return SimulatedAttitude(dive.attitude, dive.seed, lambda time_s: body_pose(dive, time_s).rotation)


def path_places(dive: DiveSpecification, path: TargetPath, times_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Places on a path from the robot's start, metres, and the direction of motion, both of shape (n, 3).

    As the path is given, wherever it is to begin (`PathStart`).
    """
    if isinstance(path, FromFile):
        places, velocity = timed_path(path.file).places(times_s + begins_s(path))
        turn, first_m = _map(dive, path)
        return turn.apply(places - first_m), turn.apply(velocity)
    elapsed = np.maximum(times_s - path.wait_s, 0.0)
    if isinstance(path, Spiral):
        return _spiral(path, elapsed)
    if isinstance(path, Straight):
        velocity = np.asarray(path.velocity_m_per_s)
        return path.start_m + np.outer(elapsed, velocity), np.broadcast_to(velocity, (len(elapsed), 3))
    if isinstance(path, Circle):
        return _circle(path, elapsed)
    return along_legs(path, times_s)


def begins_s(motion: FromFile | TravelFromFile) -> float:
    """Time of a file at which the dive begins."""
    return float(timed_path(motion.file).times_s[0]) if motion.start_s is None else motion.start_s


def _start_of(motion: TravelFromFile) -> tuple[Rotation, FloatArray]:
    """Turn from the frame of the robot's file to the start's, and the start's place in it, metres."""
    path, at = timed_path(motion.file), np.array([begins_s(motion)])
    attitude = path.attitudes(at)
    yaw = 0.0 if attitude is None else float(np.arctan2(*attitude.apply([1.0, 0.0, 0.0])[0, 1::-1]))
    return _turned(np.array(-yaw)), path.places(at)[0][0]


def _map(dive: DiveSpecification, path: FromFile) -> tuple[Rotation, FloatArray]:
    """Turn from a file's frame to the start's, and the start's place in it, metres."""
    if path.frame == "map" and isinstance(dive.robot, TravelFromFile):
        return _start_of(dive.robot)
    return Rotation.identity(), np.zeros(3)


def _file_attitude(dive: DiveSpecification, path: TargetPath, times_s: FloatArray) -> Rotation | None:
    if not isinstance(path, FromFile):
        return None
    attitude = timed_path(path.file).attitudes(times_s + begins_s(path))
    return None if attitude is None else _map(dive, path)[0] * attitude


def _moved_to_start(dive: DiveSpecification, path: TargetPath, start: PathStart) -> tuple[Rotation, FloatArray]:
    """Turn about the vertical through the start, and shift thereafter, metres, that let a path begin there."""
    if start == PathStart():
        return Rotation.identity(), np.zeros(3)
    first = path_places(dive, path, np.zeros(1))[0][0]
    level = float(np.hypot(first[0], first[1]))
    azimuth = float(np.arctan2(first[1], first[0]))
    wanted = azimuth if start.azimuth_deg is None else np.radians(start.azimuth_deg)
    up = float(np.arctan2(first[2], level)) if start.elevation_deg is None else np.radians(start.elevation_deg)
    distance = float(np.linalg.norm(first)) if start.distance_m is None else start.distance_m
    turn = _turned(np.array(wanted - azimuth))
    begins = distance * np.array([np.cos(up) * np.cos(wanted), np.cos(up) * np.sin(wanted), np.sin(up)])
    return turn, begins - turn.apply(first)


def along_legs(path: Legs, times_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Place on a path from point to point, and the leg's direction, both of shape (n, 3)."""
    points = np.asarray(path.points_m)
    legs = np.diff(points, axis=0)
    lengths = np.linalg.norm(legs, axis=1)
    ends = np.concatenate([[0.0], np.cumsum(lengths)])
    gone = np.clip((times_s - path.wait_s) * path.speed_m_per_s, 0.0, ends[-1])
    leg = np.clip(np.searchsorted(ends, gone, side="right") - 1, 0, len(legs) - 1)
    direction = legs[leg] / lengths[leg, np.newaxis]
    return points[leg] + (gone - ends[leg])[:, np.newaxis] * direction, direction


def swayed(sway: Sway, seed: int, times_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Shift (surge, sway, heave), metres, and turn (roll, pitch, yaw), radians, at times: of their shape and (3,)."""
    phase = _phases(seed)
    turns = 2 * np.pi * times_s[..., np.newaxis]
    shift = np.asarray(sway.amplitude_m) * np.sin(turns / np.asarray(sway.period_s) + phase[:3])
    turn = np.asarray(sway.turn_deg) * np.sin(turns / np.asarray(sway.turn_period_s) + phase[3:])
    return shift, np.radians(turn)


@lru_cache(maxsize=16)
def _phases(seed: int) -> FloatArray:
    rng = np.random.default_rng(np.random.SeedSequence((seed, SWAY_STREAM)))
    return rng.uniform(0, 2 * np.pi, 6)


def _turned(yaw: FloatArray) -> Rotation:
    """Turn to the left, radians."""
    return Rotation.from_rotvec(yaw[..., np.newaxis] * [0.0, 0.0, 1.0])


def _spiral(path: Spiral, elapsed_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    turning = np.radians(path.turning_deg_per_s)
    bearing = np.radians(path.start_bearing_deg) + turning * elapsed_s
    radius = path.start_radius_m + path.receding_m_per_s * elapsed_s
    height = path.start_height_m + path.rising_m_per_s * elapsed_s
    outward = np.stack([np.cos(bearing), np.sin(bearing), np.zeros_like(bearing)], axis=-1)
    ahead = np.stack([-np.sin(bearing), np.cos(bearing), np.zeros_like(bearing)], axis=-1)
    rising = path.rising_m_per_s * np.array([0.0, 0.0, 1.0])
    velocity = path.receding_m_per_s * outward + (radius * turning)[:, np.newaxis] * ahead + rising
    return radius[:, np.newaxis] * outward + height[:, np.newaxis] * [0.0, 0.0, 1.0], velocity


def _circle(path: Circle, elapsed_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    turning = np.radians(path.turning_deg_per_s)
    bearing = np.radians(path.start_bearing_deg) + turning * elapsed_s
    outward = np.stack([np.cos(bearing), np.sin(bearing), np.zeros_like(bearing)], axis=-1)
    ahead = np.stack([-np.sin(bearing), np.cos(bearing), np.zeros_like(bearing)], axis=-1)
    return path.centre_m + path.radius_m * outward, path.radius_m * turning * ahead


@lru_cache(maxsize=16)
def _turns(motion: Travel) -> tuple[FloatArray, FloatArray]:
    """Times and yaw angles (radians, continuous) between which the bow turns evenly towards each leg."""
    points = np.asarray(motion.points_m)
    legs = np.diff(points, axis=0)
    starts = motion.wait_s + np.concatenate([[0.0], np.cumsum(np.linalg.norm(legs, axis=1))]) / motion.speed_m_per_s
    rate = np.radians(motion.turn_rate_deg_per_s)
    times, yaws = [0.0], [0.0]
    for leg, start, end in zip(legs, starts, [*starts[1:-1], np.inf], strict=False):
        if start > times[-1]:
            times.append(float(start))
            yaws.append(yaws[-1])
        if np.hypot(leg[0], leg[1]) == 0:
            continue  # straight up or down: the bow stays where it is
        wanted = np.arctan2(leg[1], leg[0])
        turn = (wanted - yaws[-1] + np.pi) % (2 * np.pi) - np.pi
        duration = min(abs(turn) / rate, end - times[-1])
        times.append(times[-1] + duration)
        yaws.append(float(yaws[-1] + np.sign(turn) * rate * duration))
    return np.array(times), np.array(yaws)
