"""Gaze kinematics of one pose in plain numbers: as `optics.gaze.kinematics` of arrays, but a hundred times faster.

With pan P and tilt t in the gimbal's frame the normal of M2 is ``(cos E cos P, cos E sin P, sin E)`` with
E = 45 degrees + t, and the gaze ``(cos 2t cos P, cos 2t sin P, sin 2t)`` (eq. 5 of the paper).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from optics.kernels.arrays import FloatArray
from optics.layout import FACE_ELEVATION_AT_ZERO, Layout

TURN = 2 * math.pi


class Gimbal:
    """The two joints of a rig.

    Attributes
    ----------
    lowest, highest : array, shape (2,)
        Limits of pan and tilt as joint values, radians.
    """

    def __init__(self, layout: Layout):
        self._body_from_gimbal = layout.body_from_gimbal.rotation.as_matrix()
        self._joints = (layout.pan, layout.tilt)
        self._upright = float(layout.fold_direction[1])
        self.lowest: FloatArray = np.radians([joint.min_deg for joint in self._joints])
        self.highest: FloatArray = np.radians([joint.max_deg for joint in self._joints])
        self._elevations = tuple(2 * tilt for tilt in self.limits(1))

    @property
    def middle(self) -> FloatArray:
        """Joint values in the middle of both ranges, radians, shape (2,)."""
        return np.asarray((self.lowest + self.highest) / 2)

    @property
    def signs(self) -> FloatArray:
        """1 where a growing joint value turns a gaze ahead to the body's left (pan) or upwards (tilt), else -1."""
        # The gimbal of a fold up stands on its head.
        return np.array([self._upright * joint.sign for joint in self._joints])

    def angles(self, q: ArrayLike) -> tuple[float, float]:
        """Pan and tilt in the gimbal's frame, radians."""
        q1, q2 = np.asarray(q, dtype=np.float64).tolist()
        return self._joints[0].angle(q1), self._joints[1].angle(q2)

    def joint_values(self, pan: float, tilt: float) -> FloatArray:
        """Joint values of pan and tilt, shape (2,), radians; limits are not asked."""
        return np.array([joint.value(angle) for joint, angle in zip(self._joints, (pan, tilt), strict=True)])

    def limits(self, joint: int) -> tuple[float, float]:
        """Lowest and highest angle of pan (0) or tilt (1) in the gimbal's frame, radians."""
        first, last = sorted(self._joints[joint].angle(q) for q in self._joints[joint].limits)
        return first, last

    def normal(self, q: ArrayLike) -> FloatArray:
        """Normal of M2, body frame, shape (3,)."""
        pan, tilt = self.angles(q)
        return np.asarray(self._body_from_gimbal @ _spherical(pan, FACE_ELEVATION_AT_ZERO + tilt))

    def gaze(self, q: ArrayLike) -> FloatArray:
        """Direction of the optical axis, body frame, shape (3,)."""
        pan, tilt = self.angles(q)
        return np.asarray(self._body_from_gimbal @ _spherical(pan, 2 * tilt))

    def from_gaze(self, pan: float, tilt: float, right: float, down: float) -> FloatArray:
        """Unit vector, body frame, of a point of the gaze's tangent plane, so far to its right and down."""
        # The axes of right and down are derivatives of the gaze: by pan, of a level gaze to the left, and by tilt, up.
        left, up = _spherical(pan + math.pi / 2, 0.0), _spherical(pan, 2 * tilt + math.pi / 2)
        ray = self._body_from_gimbal @ (_spherical(pan, 2 * tilt) - right * left - down * up)
        return np.asarray(ray / math.sqrt(ray @ ray))

    def in_gimbal(self, direction: ArrayLike) -> FloatArray:
        """Components in the gimbal's frame of directions of the body frame, shape (3,) or (n, 3)."""
        return np.asarray(np.asarray(direction, dtype=np.float64) @ self._body_from_gimbal)

    def off_gaze(self, directions: FloatArray, pans: FloatArray) -> FloatArray:
        """Angle from directions to the nearest gaze that tilt reaches at pan angles, shape (n, m), radians.

        Parameters
        ----------
        directions : array, shape (n, 3)
            Unit vectors, gimbal's frame.
        pans : array, shape (m,)
            Radians.
        """
        cosines, sines = np.cos(pans), np.sin(pans)
        forward = directions[:, :2] @ [cosines, sines]
        aside = directions[:, 1:2] * cosines - directions[:, :1] * sines
        lowest, highest = self._elevations
        off_middle = np.arctan2(directions[:, 2:], forward) - (lowest + highest) / 2
        off_middle = np.abs(off_middle - TURN * np.round(off_middle / TURN))
        beyond = np.maximum(off_middle - (highest - lowest) / 2, 0)
        # Right spherical triangle: aside of the half circle, and beyond its end.
        return np.asarray(np.arccos(np.sqrt(np.maximum(1 - aside**2, 0)) * np.cos(beyond)))


def _spherical(azimuth: float, elevation: float) -> FloatArray:
    level = math.cos(elevation)
    return np.array([level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation)])
