"""The range over which a gaze is wanted: of directions (azimuth, elevation) or of joint values (q1, q2)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optics.gaze.kinematics import gaze_nearest_to_rest
from optics.kernels.arrays import FloatArray
from optics.layout import ROUNDING_DEG, Layout
from rigs import Camera

Interval = tuple[float, float]

AZIMUTH_DEG, ELEVATION_DEG = 60.0, 30.0
"""How far to both sides of the camera's view a gaze is wanted when nobody says."""


@dataclass(frozen=True, kw_only=True)
class GazeRange:
    """Two intervals, radians.

    Parameters
    ----------
    first : (float, float)
        Azimuth, or q1 when `in_joints`.
    second : (float, float)
        Elevation, or q2 when `in_joints`.
    in_joints : bool
        Whether these are joint values; else they are directions in the body frame, each looked at with the joint
        values nearest to rest, of the two ways there are.
    """

    first: Interval
    second: Interval
    in_joints: bool

    def __post_init__(self) -> None:
        for name, (low, high) in zip(self.names, (self.first, self.second), strict=True):
            if not (np.isfinite([low, high]).all() and low <= high):
                raise ValueError(
                    f"expected a range of {name} from a lower to a higher angle, "
                    f"got {np.degrees(low):g} to {np.degrees(high):g} deg"
                )
        if not self.in_joints and (self.second[0] < -np.pi / 2 or self.second[1] > np.pi / 2):
            low, high = np.degrees(self.second)
            raise ValueError(f"expected elevations between -90 and 90 deg, got {low:g} to {high:g}")

    @classmethod
    def of_joints(cls, layout: Layout) -> GazeRange:
        """The whole range of a rig's joints."""
        first, second = (joint.limits for joint in (layout.pan, layout.tilt))
        return cls(first=first, second=second, in_joints=True)

    @classmethod
    def about_view(
        cls, camera: Camera, azimuth_deg: Interval | None = None, elevation_deg: Interval | None = None
    ) -> GazeRange:
        """Directions, from and to in degrees; where nobody says, about those of the camera's view."""
        low, high = np.clip([camera.pitch_deg - ELEVATION_DEG, camera.pitch_deg + ELEVATION_DEG], -90, 90).tolist()
        azimuth_deg = azimuth_deg or (camera.yaw_deg - AZIMUTH_DEG, camera.yaw_deg + AZIMUTH_DEG)
        elevation_deg = elevation_deg or (low, high)
        first, second = ((math.radians(low), math.radians(high)) for low, high in (azimuth_deg, elevation_deg))
        return cls(first=first, second=second, in_joints=False)

    @property
    def names(self) -> tuple[str, str]:
        """What the two intervals are of."""
        return ("q1", "q2") if self.in_joints else ("azimuth", "elevation")

    def values(self, steps: int) -> tuple[FloatArray, FloatArray]:
        """Evenly spaced values of both, ends included; one where an interval is a point."""
        first, second = (np.linspace(*limits, steps if limits[0] < limits[1] else 1) for limits in self._both)
        return first, second

    def around(self, first: float, second: float, steps: int, finer_steps: int) -> tuple[FloatArray, FloatArray]:
        """Finer values around one grid point of `values(steps)`, up to its neighbours, within the range."""
        found = []
        for value, (low, high) in zip((first, second), self._both, strict=True):
            spacing = (high - low) / max(steps - 1, 1)
            found.append(np.clip(np.linspace(value - spacing, value + spacing, finer_steps), low, high))
        return found[0], found[1]

    @property
    def _both(self) -> tuple[Interval, Interval]:
        return self.first, self.second

    def poses(self, layout: Layout, first: FloatArray, second: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Joint values (q1, q2) of pairs of values, radians, shape (n,); NaN where the joints do not reach."""
        if self.in_joints:
            within = [
                (np.degrees(values) >= joint.min_deg - ROUNDING_DEG)
                & (np.degrees(values) <= joint.max_deg + ROUNDING_DEG)
                for joint, values in ((layout.pan, first), (layout.tilt, second))
            ]
            reached = within[0] & within[1]
            return np.where(reached, first, np.nan), np.where(reached, second, np.nan)
        return gaze_nearest_to_rest(layout, first, second)


def pairs(first: FloatArray, second: FloatArray) -> tuple[FloatArray, FloatArray]:
    """All pairs of two lists of values, those of one second value together; shape (n2 * n1,) each."""
    grid1, grid2 = np.meshgrid(first, second)
    return grid1.ravel(), grid2.ravel()


@dataclass(frozen=True)
class Grid:
    """Poses of a range: values of both intervals, and joint values of all pairs (NaN where they do not reach)."""

    first: FloatArray
    second: FloatArray
    q1: FloatArray
    q2: FloatArray

    @property
    def reached(self) -> NDArray[np.bool_]:
        """Which pairs the joints reach, shape (n2 * n1,)."""
        return np.isfinite(self.q1)


def pose_grid(layout: Layout, gaze: GazeRange, steps: int) -> Grid:
    """Evenly spaced poses of a range."""
    first, second = gaze.values(steps)
    return Grid(first, second, *gaze.poses(layout, *pairs(first, second)))
