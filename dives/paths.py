"""Where target and robot are at a time of a dive, in closed form: the truth that no sea trial knows.

Paths are told from the robot's start: where its body's origin is at rest, at the dive's depth, x ahead, y to the left,
z up. The start lies on the world's z axis, its bow along the world's x.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import RigidTransform, Rotation

from dives.motions import Circle, Legs, Spiral, Straight, Sway, TargetPath, Travel
from dives.specification import DiveSpecification
from optics.kernels.arrays import FloatArray

SWAY_STREAM = 1
"""Second number of the seed of the sway's phases; frames' noise has the first one and the frame's number."""


def target_pose(dive: DiveSpecification, time_s: ArrayLike) -> RigidTransform:
    """Pose of the target in the world, x along its path (level), z up: one, or for times of shape (n,) as many."""
    times = np.asarray(time_s, dtype=np.float64)
    points, heading = (each.reshape(*times.shape, 3) for each in target_places(dive, np.atleast_1d(times)))
    yaw = np.arctan2(heading[..., 1], heading[..., 0])
    return RigidTransform.from_components(points - [0.0, 0.0, dive.depth_m], _turned(yaw))


def body_pose(dive: DiveSpecification, time_s: ArrayLike) -> RigidTransform:
    """Pose of the robot's body in the world: one, or for times of shape (n,) as many."""
    times = np.asarray(time_s, dtype=np.float64)
    place, yaw = np.zeros((*times.shape, 3)), np.zeros(times.shape)
    motion = dive.robot
    if isinstance(motion, Travel):
        place = along_legs(motion, np.atleast_1d(times))[0].reshape(place.shape)
        yaw = np.interp(times, *_turns(motion))
    sway_m, turn = swayed(motion.sway, dive.seed, times)
    heading = _turned(yaw)
    # Body x ahead, y left, z up: positive pitch of the sway's sine is bow up, a negative turn about y. The sign of a
    # sine with any phase does not matter.
    pose = heading * Rotation.from_euler("ZYX", turn[..., ::-1])
    return RigidTransform.from_components(place + heading.apply(sway_m) - [0.0, 0.0, dive.depth_m], pose)


def target_places(dive: DiveSpecification, times_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Target's centre from the robot's start, metres, and the direction it moves in, both of shape (n, 3)."""
    path: TargetPath = dive.target.path
    elapsed = np.maximum(times_s - path.wait_s, 0.0)
    if isinstance(path, Spiral):
        return _spiral(path, elapsed)
    if isinstance(path, Straight):
        velocity = np.asarray(path.velocity_m_per_s)
        return path.start_m + np.outer(elapsed, velocity), np.broadcast_to(velocity, (len(elapsed), 3))
    if isinstance(path, Circle):
        return _circle(path, elapsed)
    return along_legs(path, times_s)


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
