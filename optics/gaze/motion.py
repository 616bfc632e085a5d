"""Moving the gaze: which joint values to go to, how long it takes, how fast the servos can turn it.

Both joints start together and each runs at its servo's speed; acceleration is left out, as the paper does. A move
therefore takes the longer of the two joints' times, the max norm of the joint difference in units of time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from optics.gaze.jacobian import NO_AZIMUTH, manipulability
from optics.gaze.kinematics import inverse_gaze
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from rigs import Rig


@dataclass(frozen=True, kw_only=True)
class JointSpeeds:
    """Fastest turn of each joint, rad/s."""

    pan: float
    tilt: float

    @classmethod
    def from_rig(cls, rig: Rig) -> JointSpeeds:
        """Speeds of a rig's servos; `ValueError` for a rig without mirrors."""
        servos = rig.require_gaze().servos
        return cls(
            pan=float(np.radians(servos.pan.speed_deg_per_s)),
            tilt=float(np.radians(servos.tilt.speed_deg_per_s)),
        )

    def slowed(self, share: float) -> JointSpeeds:
        """A share of both."""
        return JointSpeeds(pan=share * self.pan, tilt=share * self.tilt)


def move_time(speeds: JointSpeeds, start: ArrayLike, goal: ArrayLike) -> FloatArray:
    """Seconds from joint values to others, shape (..., 2) each: the longer of the two joints' times."""
    difference = np.abs(np.asarray(goal, dtype=np.float64) - np.asarray(start, dtype=np.float64))
    return np.asarray(np.maximum(difference[..., 0] / speeds.pan, difference[..., 1] / speeds.tilt))


def gaze_speed(layout: Layout, speeds: JointSpeeds, q2: ArrayLike) -> FloatArray:
    """Fastest turn of the gaze across (by pan) and upwards (by tilt), rad/s, shape (..., 2).

    Tilt gives twice its servo's speed everywhere; pan gives its servo's speed times |cos 2t|.
    """
    across = manipulability(layout, q2) * speeds.pan
    return np.stack([across, np.full_like(across, 2 * speeds.tilt)], axis=-1)


def joint_solutions(layout: Layout, azimuth: float, elevation: float, q: ArrayLike) -> FloatArray:
    """All joint values that look along a direction (body frame, radians), shape (k, 2), sorted.

    As `inverse_gaze`, but where any pan would do, at the gimbal's zenith and nadir, the pan of `q` (or the limit next
    to it) is the one.
    """
    found = inverse_gaze(layout, azimuth, elevation)
    singular = manipulability(layout, found[:, 1]) < NO_AZIMUTH
    pan = np.clip(np.asarray(q, dtype=np.float64)[0], *layout.pan.limits)
    return np.unique(np.column_stack([np.where(singular, pan, found[:, 0]), found[:, 1]]), axis=0)


def nearest_solution(layout: Layout, speeds: JointSpeeds, azimuth: float, elevation: float, q: ArrayLike) -> FloatArray:
    """The joint values that look along a direction and are reached first from `q`; shape (2,).

    Of those reached at the same time the one that moves less in all is taken, then the first.

    Raises
    ------
    ValueError
        When the joints do not reach that direction.
    """
    found = joint_solutions(layout, azimuth, elevation, q)
    if not len(found):
        raise ValueError(
            f"expected a gaze within the joints' reach, got azimuth {np.degrees(azimuth):g} deg, "
            f"elevation {np.degrees(elevation):g} deg"
        )
    moves = np.abs(found - np.asarray(q, dtype=np.float64)) / [speeds.pan, speeds.tilt]
    order = np.lexsort((moves.sum(axis=1).round(12), moves.max(axis=1).round(12)))
    return np.asarray(found[order[0]])


def shortest_change(
    layout: Layout, speeds: JointSpeeds, start: tuple[float, float], goal: tuple[float, float]
) -> float:
    """Shortest time from one gaze to another over all branches of both, seconds.

    `start` and `goal` are (azimuth, elevation) in the body frame, radians; infinite when one is out of reach.
    """
    # At the zenith every pan is a solution: the pan of the other end is the nearest.
    ends = [inverse_gaze(layout, *gaze) for gaze in (start, goal)]
    times = [
        float(move_time(speeds, q_start, q_goal))
        for q in [*ends[0], *ends[1]]
        for q_start in joint_solutions(layout, *start, q)
        for q_goal in joint_solutions(layout, *goal, q)
    ]
    return min(times, default=np.inf)
