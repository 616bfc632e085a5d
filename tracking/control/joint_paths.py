"""Paths of the joints: the functional check and the scan of everything within reach."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from optics.gaze.motion import JointSpeeds, move_time
from optics.kernels.arrays import FloatArray
from tracking.estimation.gimbal import Gimbal


@dataclass(frozen=True, kw_only=True)
class JointPath:
    """Straight lines in joint space, each as fast as the slower joint allows.

    Attributes
    ----------
    q : array, shape (n, 2)
        Radians.
    time_s : array, shape (n,)
        From the beginning; each later than the one before.
    """

    q: FloatArray
    time_s: FloatArray

    @classmethod
    def through(cls, q: ArrayLike, speeds: JointSpeeds) -> JointPath:
        """Path through joint values, shape (n, 2), at given speeds; those that repeat are dropped."""
        points = np.asarray(q, dtype=np.float64)
        return cls.timed(points, np.concatenate([[0.0], move_time(speeds, points[:-1], points[1:])]))

    @classmethod
    def timed(cls, q: ArrayLike, taken_s: ArrayLike) -> JointPath:
        """Path through joint values, shape (n, 2), each so long after the one before; those that repeat are dropped."""
        points, times = np.asarray(q, dtype=np.float64), np.asarray(taken_s, dtype=np.float64)
        moved = times > 0
        moved[0] = True
        return cls(q=points[moved], time_s=np.cumsum(times[moved]))

    @property
    def duration_s(self) -> float:
        """From end to end."""
        return float(self.time_s[-1])

    def at(self, time_s: float) -> FloatArray:
        """Joint values at a time from the beginning, shape (2,); the ends before and after."""
        return np.array([np.interp(time_s, self.time_s, joint) for joint in self.q.T])


def check_path(gimbal: Gimbal, speeds: JointSpeeds, duration_s: float) -> JointPath:
    """Functional check: each joint from its middle to both sides and back, in a given time above 0.

    Over its whole range where the servos can do that in the time, else as far as they get at their speed.
    """
    steps = np.array([(0, 0), (-1, 0), (1, 0), (0, 0), (0, -1), (0, 1), (0, 0)])
    half = (gimbal.highest - gimbal.lowest) / 2
    whole = JointPath.through(gimbal.middle + steps * half, speeds)
    share = min(duration_s / whole.duration_s, 1.0)
    return JointPath(
        q=gimbal.middle + share * (whole.q - gimbal.middle), time_s=whole.time_s * duration_s / whole.duration_s
    )


def raster_path(gimbal: Gimbal, speeds: JointSpeeds, step: FloatArray) -> JointPath:
    """Scan of all that is within reach, in strips that are at most a step apart.

    Strips run along one joint from end to end and back on the next one; which joint, is whichever is sooner done. Where
    both servos are alike that is tilt, which turns the gaze twice as fast.

    Parameters
    ----------
    gimbal : Gimbal
    speeds : JointSpeeds
    step : array, shape (2,)
        Of the gaze across crop-right and crop-up, radians. A step of pan is largest at the horizon: it holds
        everywhere.
    """
    rasters = [_strips(gimbal, across, float(step[across]) / (1, 2)[across]) for across in (0, 1)]
    return min((JointPath.through(raster, speeds) for raster in rasters), key=lambda path: path.duration_s)


def _strips(gimbal: Gimbal, across: int, step: float) -> FloatArray:
    """Corners of strips that run along one joint and follow each other across the other, shape (n, 2)."""
    span = float(gimbal.highest[across] - gimbal.lowest[across])
    count = max(math.ceil(span / step), 1)
    middles = gimbal.lowest[across] + (np.arange(count) + 0.5) * span / count
    points = np.empty((count, 2, 2))
    points[..., across] = middles[:, np.newaxis]
    ends = np.array([gimbal.lowest[1 - across], gimbal.highest[1 - across]])
    points[..., 1 - across] = [ends if index % 2 == 0 else ends[::-1] for index in range(count)]
    return points.reshape(-1, 2)
