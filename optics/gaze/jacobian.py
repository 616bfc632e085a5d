"""How fast the gaze turns with the joints, and where it does not.

In the gimbal frame, with pan P and tilt t, the gaze is ``(cos 2t cos P, cos 2t sin P, sin 2t)``. Its derivatives are
``cos 2t`` times the horizontal unit vector across it, and twice the unit vector upwards: the singular values of the
direction's Jacobian are |cos 2t| and 2, at right angles. Tilt always turns the gaze by twice its own turn. Pan turns it
ever less towards the gimbal's zenith and nadir, and there not at all.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from optics.gaze.kinematics import forward_gaze
from optics.kernels.arrays import FloatArray
from optics.layout import Layout

NO_AZIMUTH = 1e-9
"""Cosine of an elevation below which the zenith is taken as reached: rounding of 1e-16 in the direction would turn the
azimuth by more than 1e-7 rad there."""


def direction_jacobian(layout: Layout, q1: ArrayLike, q2: ArrayLike) -> FloatArray:
    """Derivative of the gaze's direction (body frame) with respect to (q1, q2), shape (..., 3, 2), 1/rad.

    It is finite everywhere; at the gimbal's zenith and nadir its rank is one.
    """
    pan, twice_tilt = _optical_angles(layout, q1, q2)
    across = np.stack([-np.sin(pan), np.cos(pan), np.zeros_like(pan)], axis=-1) * np.cos(twice_tilt)[..., np.newaxis]
    upwards = np.stack(
        [-np.sin(twice_tilt) * np.cos(pan), -np.sin(twice_tilt) * np.sin(pan), np.cos(twice_tilt)], axis=-1
    )
    columns = np.stack([layout.pan.sign * across, 2 * layout.tilt.sign * upwards], axis=-1)
    return np.asarray(layout.body_from_gimbal.rotation.as_matrix() @ columns)


def angle_jacobian(layout: Layout, q1: ArrayLike, q2: ArrayLike) -> FloatArray:
    """Derivative of (azimuth, elevation) in the body frame with respect to (q1, q2), shape (..., 2, 2).

    For a camera that looks straight ahead it is ``diag(sign1, 2 sign2)`` up to the zenith, and beyond it, where the
    gaze comes down on the other side, ``diag(sign1, -2 sign2)``. It is NaN at the body's zenith and nadir, which have
    no azimuth.
    """
    direction = forward_gaze(layout, q1, q2).direction
    derivative = direction_jacobian(layout, q1, q2)
    x, y = direction[..., 0, np.newaxis], direction[..., 1, np.newaxis]
    level = np.hypot(x, y)
    with np.errstate(divide="ignore", invalid="ignore"):
        azimuth = (x * derivative[..., 1, :] - y * derivative[..., 0, :]) / level**2
        elevation = derivative[..., 2, :] / level
    jacobian = np.stack([azimuth, elevation], axis=-2)
    return np.asarray(np.where(level[..., np.newaxis] > NO_AZIMUTH, jacobian, np.nan))


def manipulability(layout: Layout, q2: ArrayLike) -> FloatArray:
    """|cos 2t|: how far the gaze turns for a turn of pan, 0 at the gimbal's zenith and nadir; the shape of `q2`.

    The condition number of `direction_jacobian` is 2 over it: so much more pan than tilt a turn across the gaze takes.
    """
    _, twice_tilt = _optical_angles(layout, 0.0, q2)
    return np.asarray(np.abs(np.cos(twice_tilt)))


def joint_rates(layout: Layout, q1: ArrayLike, q2: ArrayLike, gaze_rate: ArrayLike) -> FloatArray:
    """Joint rates (q1', q2') that turn the gaze at a wanted rate, shape (..., 2), rad/s.

    Parameters
    ----------
    q1, q2 : arrays of one shape
        Joint values, radians.
    gaze_rate : array, shape (..., 3)
        Rate of the gaze's direction, body frame, 1/s; its part along the gaze is dropped.

    Notes
    -----
    The columns of the Jacobian are orthogonal: each rate is a projection. Pan must be 1 / |cos 2t| times as fast as
    the gaze turns across; infinite or NaN where pan does not turn it.
    """
    derivative = direction_jacobian(layout, q1, q2)
    with np.errstate(divide="ignore", invalid="ignore"):
        wanted = (derivative * np.asarray(gaze_rate, dtype=np.float64)[..., np.newaxis]).sum(axis=-2)
        return np.asarray(wanted / (derivative**2).sum(axis=-2))


def _optical_angles(layout: Layout, q1: ArrayLike, q2: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Pan and twice the tilt, radians, of one shape."""
    q1, q2 = np.broadcast_arrays(np.asarray(q1, dtype=np.float64), np.asarray(q2, dtype=np.float64))
    return layout.pan.angle(q1), 2 * layout.tilt.angle(q2)
