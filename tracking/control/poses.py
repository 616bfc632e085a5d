"""Poses of the gaze, and which directions lie in the view there."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray
from tracking.estimation.gimbal import Gimbal


def pose_grid(gimbal: Gimbal, pan_step: float, tilt_step: float) -> tuple[FloatArray, FloatArray]:
    """Pan and tilt in the gimbal's frame over their ranges, at most a step apart."""
    return tuple(
        np.linspace(low, high, math.ceil((high - low) / step) + 1)
        for (low, high), step in ((gimbal.limits(0), pan_step), (gimbal.limits(1), tilt_step))
    )  # type: ignore[return-value]


def in_view(gimbal: Gimbal, q: FloatArray, direction: FloatArray, view: FloatArray) -> NDArray[np.bool_]:
    """Which unit vectors, gimbal's frame, shape (n, 3), lie in the view at joint values, shape (n,)."""
    pan, tilt = gimbal.angles(q)
    return np.asarray(seen_from(direction, np.array([pan]), np.array([tilt]), view)[0, 0])


def seen_from(direction: FloatArray, pan: FloatArray, tilt: FloatArray, view: FloatArray) -> NDArray[np.bool_]:
    """Which directions lie in the view, across and upwards, shape (pans, tilts, n)."""
    cosine, sine = np.cos(pan)[:, np.newaxis], np.sin(pan)[:, np.newaxis]
    x, y, z = direction.T
    forward, aside = cosine * x + sine * y, cosine * y - sine * x
    cosine, sine = np.cos(2 * tilt)[:, np.newaxis], np.sin(2 * tilt)[:, np.newaxis]
    ahead = cosine * forward[:, np.newaxis] + sine * z
    up = cosine * z - sine * forward[:, np.newaxis]
    across, upwards = np.tan(view / 2)
    return np.asarray((np.abs(aside)[:, np.newaxis] <= across * ahead) & (np.abs(up) <= upwards * ahead))
