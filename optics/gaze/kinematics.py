"""Gaze kinematics: where the virtual camera looks for joint values, and which joint values look there.

Eqs. 1-5 of Cortes-Perez & Torres-Mendez 2021. The virtual camera is the real one reflected over M1 and then over M2
(figure 4). With P the pan angle, t the tilt angle and the folded axis along the pan axis, its optical axis in the
gimbal frame is exactly ``(cos 2t cos P, cos 2t sin P, sin 2t)``: azimuth = P, elevation = 2 t.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import RigidTransform

from optics.kernels.arrays import FloatArray
from optics.layout import FACE_ELEVATION_AT_ZERO, ROUNDING_DEG, Layout
from optics.mirror import PlaneMirror
from rigs import Joint


@dataclass(frozen=True, kw_only=True)
class Gaze:
    """Where the virtual camera looks; radians, arrays of the shape of the joint values.

    Attributes
    ----------
    azimuth : array
        From the body's x to the left, in [-pi, pi].
    elevation : array
        Above the horizontal, in [-pi/2, pi/2].
    roll : array
        Of the image about the gaze, clockwise as seen from behind the camera: zero where image-right is horizontal.
        It has no meaning at the zenith and the nadir.
    direction : array, shape (..., 3)
        Unit vector of the optical axis in the body frame.
    """

    azimuth: FloatArray
    elevation: FloatArray
    roll: FloatArray
    direction: FloatArray


def gaze_mirror_normal(layout: Layout, q1: ArrayLike, q2: ArrayLike) -> FloatArray:
    """Normal of M2 in the body frame for joint values of any shape, radians; shape (..., 3)."""
    q1, q2 = np.broadcast_arrays(np.asarray(q1, dtype=np.float64), np.asarray(q2, dtype=np.float64))
    pan, elevation = layout.pan.angle(q1), FACE_ELEVATION_AT_ZERO + layout.tilt.angle(q2)
    normal = np.stack([np.cos(elevation) * np.cos(pan), np.cos(elevation) * np.sin(pan), np.sin(elevation)], axis=-1)
    return np.asarray(normal @ layout.body_from_gimbal.rotation.as_matrix().T)


def forward_gaze(layout: Layout, q1: ArrayLike, q2: ArrayLike) -> Gaze:
    """Gaze for joint values of any shape, radians: the camera's axes after both reflections."""
    normals = (layout.body_from_m1.rotation.as_matrix()[:, 2], gaze_mirror_normal(layout, q1, q2))
    right, _, forward = layout.body_from_camera.rotation.as_matrix().T
    for normal in normals:
        right, forward = (_mirrored(vector, normal) for vector in (right, forward))
    level_right = np.cross(forward, [0.0, 0.0, 1.0])
    down = np.cross(forward, level_right)
    return Gaze(
        azimuth=np.arctan2(forward[..., 1], forward[..., 0]),
        elevation=np.arctan2(forward[..., 2], np.hypot(forward[..., 0], forward[..., 1])),
        roll=np.arctan2((right * down).sum(axis=-1), (right * level_right).sum(axis=-1)),
        direction=forward,
    )


def inverse_gaze(layout: Layout, azimuth: float, elevation: float) -> FloatArray:
    """All joint values within the limits that look along a direction of the body frame.

    Parameters
    ----------
    azimuth, elevation : float
        Radians.

    Returns
    -------
    q : array, shape (k, 2)
        (q1, q2), radians, sorted; empty where the joints do not reach. There are two ways to look anywhere, over the
        front and over the zenith, each up to whole turns; half a turn of tilt more would show the mirror's back. At the
        zenith and the nadir of the gimbal every pan angle would do; those along azimuth zero and pi are returned.
    """
    if not (np.isfinite(azimuth) and np.isfinite(elevation)):
        raise ValueError(f"expected finite azimuth and elevation, got {azimuth} and {elevation}")
    direction = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    x, y, z = layout.body_from_gimbal.rotation.inv().apply(direction)
    return _joint_values(layout, pan=np.arctan2(y, x), tilt=np.arctan2(z, np.hypot(x, y)) / 2)


def gaze_nearest_to_rest(layout: Layout, azimuth: FloatArray, elevation: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Of the joint values of `inverse_gaze` those nearest to rest, for directions of shape (n,).

    Returns
    -------
    q1, q2 : array, shape (n,)
        Radians; NaN where the joints do not reach.
    """
    level = np.cos(elevation)
    direction = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)], axis=-1)
    x, y, z = layout.body_from_gimbal.rotation.inv().apply(direction).T
    ways = [
        np.stack([_nearest_within(layout.pan, theta), _nearest_within(layout.tilt, t)])
        for theta, t in _ways(np.arctan2(y, x), np.arctan2(z, np.hypot(x, y)) / 2)
    ]
    over_front, over_zenith = (np.where(np.isnan(way).any(axis=0), np.inf, np.abs(way).max(axis=0)) for way in ways)
    q1, q2 = np.where(over_front <= over_zenith, *ways)
    reached = np.isfinite(np.minimum(over_front, over_zenith))
    return np.where(reached, q1, np.nan), np.where(reached, q2, np.nan)


def inverse_reflection(layout: Layout, incoming: ArrayLike, outgoing: ArrayLike) -> FloatArray:
    """All joint values within the limits with which M2 sends a ray another way.

    Parameters
    ----------
    incoming, outgoing : array, shape (3,)
        Unit vectors of the body frame, along the ray as it is followed out of the camera: before M2 (`fold_reflection`)
        and behind it.

    Returns
    -------
    q : array, shape (k, 2)
        (q1, q2), radians, sorted; empty where the joints do not reach. For the optical axis they are those of
        `inverse_gaze`, except at the zenith and the nadir of the gimbal.
    """
    # M2's normal halves the angle between where the ray goes and where it comes from.
    normal = np.asarray(outgoing, dtype=np.float64) - np.asarray(incoming, dtype=np.float64)
    x, y, z = layout.body_from_gimbal.rotation.inv().apply(normal)
    elevation = np.arctan2(z, np.hypot(x, y))
    return _joint_values(layout, pan=np.arctan2(y, x), tilt=elevation - FACE_ELEVATION_AT_ZERO)


def fold_reflection(layout: Layout, direction: ArrayLike) -> FloatArray:
    """Directions of the body frame, shape (..., 3), after M1."""
    return _mirrored(np.asarray(direction, dtype=np.float64), layout.body_from_m1.rotation.as_matrix()[:, 2])


def gaze_reflection(layout: Layout, direction: ArrayLike, q1: ArrayLike, q2: ArrayLike) -> FloatArray:
    """Directions of the body frame, shape (..., 3), after M2 at joint values in radians."""
    return _mirrored(np.asarray(direction, dtype=np.float64), gaze_mirror_normal(layout, q1, q2))


def faces_light(layout: Layout, q2: ArrayLike) -> NDArray[np.bool_]:
    """Whether M2 turns its face, not its back or its edge, to the folded axis at tilt joint values `q2`, radians."""
    return np.asarray(np.sin(FACE_ELEVATION_AT_ZERO + layout.tilt.angle(np.asarray(q2, dtype=np.float64))) > 0)


def virtual_camera(layout: Layout, q1: float, q2: float) -> RigidTransform:
    """Pose of the virtual camera in the body frame: the real one reflected over M1, then over M2.

    Two reflections are a proper rigid motion, so the virtual camera's image is not mirrored.
    """
    m1 = PlaneMirror.from_pose(layout.body_from_m1).reflection
    m2 = PlaneMirror.from_pose(layout.body_from_m2(q1, q2)).reflection
    return m2.after(m1) * layout.body_from_camera


def virtual_centre(layout: Layout, q1: ArrayLike, q2: ArrayLike) -> FloatArray:
    """Centre of the virtual camera in the body frame, metres, for joint values of any shape; shape (..., 3).

    M1 puts the camera's image d1 + d2 above the centre of M2, on the pan axis. M2 turns about that centre, so the
    second image keeps its distance: it moves on a sphere of radius d1 + d2, opposite to the gaze. With pan alone its
    path is a circle about the pan axis, with tilt alone a great circle.
    """
    centre = layout.body_from_gimbal.translation
    image = PlaneMirror.from_pose(layout.body_from_m1).reflection.apply(layout.body_from_camera.translation)
    radius = np.linalg.norm(image - centre)
    return np.asarray(centre - radius * forward_gaze(layout, q1, q2).direction)


def _mirrored(vector: FloatArray, normal: FloatArray) -> FloatArray:
    return np.asarray(vector - 2 * (vector * normal).sum(axis=-1, keepdims=True) * normal)


def _joint_values(layout: Layout, *, pan: float, tilt: float) -> FloatArray:
    """All joint values within the limits that turn M2's normal to where the angles `pan` and `tilt` turn it."""
    found = [
        (q1, q2)
        for theta, t in _ways(pan, tilt)
        for q1 in _within_limits(layout.pan, theta, period=2 * np.pi)
        for q2 in _within_limits(layout.tilt, t, period=2 * np.pi)
    ]
    return np.array(sorted(found), dtype=np.float64).reshape(-1, 2)


def _ways(pan: Any, tilt: Any) -> tuple[tuple[Any, Any], tuple[Any, Any]]:
    """Angles that turn M2's normal the same way: over the front, and over the zenith with pan turned by half a turn."""
    return (pan, tilt), (pan + np.pi, np.pi - 2 * FACE_ELEVATION_AT_ZERO - tilt)


def _nearest_within(joint: Joint, angle: FloatArray) -> FloatArray:
    """Of the joint values of `_within_limits` those nearest to zero, one for each angle; NaN where there is none."""
    q = joint.value(angle)
    lowest, highest = np.radians([joint.min_deg - ROUNDING_DEG, joint.max_deg + ROUNDING_DEG])
    turn = 2 * np.pi
    first, last = np.ceil((lowest - q) / turn), np.floor((highest - q) / turn)
    # Of two that are as near, the lower.
    nearest = q + turn * np.clip(np.ceil(-q / turn - 0.5), first, last)
    return np.asarray(np.where(first <= last, nearest, np.nan))


def _within_limits(joint: Joint, angle: float, *, period: float) -> list[float]:
    """Joint values within the limits whose optical angle equals `angle` up to whole periods."""
    q = joint.value(angle)
    lowest, highest = np.radians([joint.min_deg - ROUNDING_DEG, joint.max_deg + ROUNDING_DEG])
    first = int(np.ceil((lowest - q) / period))
    last = int(np.floor((highest - q) / period))
    return [float(q + k * period) for k in range(first, last + 1)]
