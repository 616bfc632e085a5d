"""Where to look while there is no target: around where one was lost, then everywhere."""

from __future__ import annotations

from typing import Any

import numpy as np

from optics.gaze.motion import JointSpeeds, move_time
from optics.kernels.arrays import FloatArray
from tracking.control.joint_paths import JointPath, outward_path, raster_path
from tracking.control.search_plan import likely_path
from tracking.estimation.gimbal import Gimbal

RINGS = 2
"""Of a search around a place: what moves at 20 degrees/s leaves them in the time that they take."""
PASSES = 3
"""Over them, outwards and inwards in turn: what glare or an obstacle hid comes out near where it was lost, but later.
An odd number, so that the raster begins at their rim."""

OVERLAP = 0.2
"""Share of the crop's field of view that two strips have in common, so that a target is whole in one of them: 4.5
degrees of the aqua2's 22, a ball of 0.2 m at 2.5 m."""


class Search:
    """Everything within reach again and again, and before it a search around a place if there is one.

    Parameters
    ----------
    gimbal : Gimbal
    speeds : JointSpeeds
        The servos'.
    view : array, shape (2,)
        Field of view of the crop across and upwards, radians.
    likely_first : bool
        Whether likely places come first (`likely_path`); else a raster is run to and fro.
    """

    def __init__(self, gimbal: Gimbal, speeds: JointSpeeds, view: FloatArray, *, likely_first: bool = False):
        self._gimbal, self._speeds, self._step = gimbal, speeds, (1 - OVERLAP) * view
        # Lost images leave no gap: from one to the next the gaze goes on by no more than a step.
        self._longest_s = min(float(self._step[0]) / speeds.pan, float(self._step[1]) / (2 * speeds.tilt))
        self._likely_first = likely_first
        self._path = (likely_path if likely_first else raster_path)(gimbal, speeds, self._step)
        self._around: JointPath | None = None
        self._centre: FloatArray | None = None
        self._time_s = 0.0
        self._approach_s = 0.0

    def begin(self, q: FloatArray, centre: FloatArray | None = None) -> None:
        """Search from joint values `q` on: outwards from `centre`, or everything.

        A raster begins at its nearer end: from an end, everything has been looked at soonest. The path waits at its
        beginning until the mirror has come, which would cut the first strip short otherwise.
        """
        self._centre = centre
        self._around = None if centre is None else self._around_path(centre)
        ends = self._path.q[[0] if self._likely_first else [0, -1]]
        starts = ends if centre is None else centre[np.newaxis]
        approaches_s = move_time(self._speeds, q, starts)
        nearer = int(np.argmin(approaches_s))
        self._time_s = nearer * self._path.duration_s
        self._approach_s = float(approaches_s[nearer])

    def resume(self, q: FloatArray) -> None:
        """Go on from joint values `q` where the search was broken off."""
        self._approach_s = float(move_time(self._speeds, q, self._place()[np.newaxis])[0])

    def advance(self, seconds: float) -> FloatArray:
        """Joint values to ask for, shape (2,), so much later."""
        passed_s = min(seconds, self._longest_s)
        self._time_s += max(passed_s - self._approach_s, 0.0)
        self._approach_s = max(self._approach_s - passed_s, 0.0)
        if self._around is not None and self._time_s > PASSES * self._around.duration_s:
            self.begin(self._around.q[-1])
        elif self._around is None and self._likely_first and self._time_s > self._path.duration_s:
            self.begin(self._path.q[-1])
        return self._place()

    def _place(self) -> FloatArray:
        """Joint values that the search has come to."""
        return _to_and_fro(self._path if self._around is None else self._around, self._time_s)

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""
        return {
            "time_s": self._time_s,
            "approach_s": self._approach_s,
            "centre": None if self._centre is None else self._centre.tolist(),
        }

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot."""
        self._time_s, self._approach_s = snapshot["time_s"], snapshot["approach_s"]
        self._centre = None if snapshot["centre"] is None else np.array(snapshot["centre"])
        self._around = None if self._centre is None else self._around_path(self._centre)

    def _around_path(self, centre: FloatArray) -> JointPath:
        return outward_path(self._gimbal, self._speeds, self._step, centre, RINGS)


def _to_and_fro(path: JointPath, time_s: float) -> FloatArray:
    """Joint values on a path that is run from end to end and back again."""
    there_and_back = 2 * path.duration_s
    time_s %= there_and_back
    return path.at(min(time_s, there_and_back - time_s))
