"""A chain of turns and shifts in many poses at once, and how its end moves with each of them.

Along the chain, a turn by an angle about the k-th axis of the frame reached so far moves the end with the angular
velocity w = that axis, and the end's origin with w x (end - where the turn was made); a shift moves the origin along
the axis. That is the geometric Jacobian of a robot arm (Siciliano et al., Robotics, 2009, section 3.1), exact at any
angle.
"""

from __future__ import annotations

from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import RigidTransform, Rotation

from optics.kernels.arrays import FloatArray


class Chain:
    """Frames in n poses, moved step by step from a common start; each named step is remembered.

    Parameters
    ----------
    start : RigidTransform
        Frame at the chain's foot, in the frame in which all vectors are given.
    count : int
        Number of poses, n.
    """

    def __init__(self, start: RigidTransform, count: int):
        self._axes = np.broadcast_to(start.rotation.as_matrix(), (count, 3, 3))
        self._origin = np.broadcast_to(start.translation, (count, 3))
        self._turns: dict[str, tuple[FloatArray, FloatArray]] = {}
        self._shifts: dict[str, FloatArray] = {}

    def turn(self, name: str, axis: int, angle: ArrayLike, sense: float = 1.0) -> Self:
        """Turn about the frame's own axis by `sense` times an angle, one for all poses or one for each, radians."""
        about = np.zeros((len(self._axes), 3))
        about[:, axis] = sense * np.asarray(angle)
        self._turns[name] = (sense * self._axes[:, :, axis], self._origin)
        self._axes = self._axes @ Rotation.from_rotvec(about).as_matrix()
        return self

    def shift(self, name: str, axis: int, distance_m: float) -> Self:
        """Shift along the frame's own axis."""
        self._shifts[name] = self._axes[:, :, axis]
        self._origin = self._origin + distance_m * self._axes[:, :, axis]
        return self

    def fixed(self, step: RigidTransform) -> Self:
        """Go on by a step that nothing moves."""
        self._origin = self._origin + self._axes @ step.translation
        self._axes = self._axes @ step.rotation.as_matrix()
        return self

    @property
    def origin_m(self) -> FloatArray:
        """Origins of the frames at the chain's end, shape (n, 3)."""
        return np.asarray(self._origin)

    @property
    def axes(self) -> FloatArray:
        """Axes of the frames at the chain's end as columns, shape (n, 3, 3)."""
        return np.asarray(self._axes)

    def rates(self, names: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
        """How the end moves with each named step.

        Returns
        -------
        of_origin, turning : arrays, shape (n, 3, len(names))
            Velocity of the origin and angular velocity; zero for names that are no step of this chain.
        """
        of_origin, turning = np.zeros((2, len(self._axes), 3, len(names)))
        for column, name in enumerate(names):
            if name in self._turns:
                velocity, pivot = self._turns[name]
                turning[:, :, column] = velocity
                of_origin[:, :, column] = np.cross(velocity, self._origin - pivot)
            elif name in self._shifts:
                of_origin[:, :, column] = self._shifts[name]
        return of_origin, turning
