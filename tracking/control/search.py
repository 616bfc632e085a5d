"""Where to look while there is no target: where one that was lost can have gone, then everywhere.

What shows past the mirrors in the meantime is looked at first.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.gaze.motion import JointSpeeds, move_time
from optics.kernels.arrays import FloatArray
from tracking.control.direct_look import DirectLook
from tracking.control.gaze_view import GazeView
from tracking.control.joint_paths import JointPath, raster_path
from tracking.control.lost_target import LostTarget
from tracking.control.search_plan import likely_paths, slowed
from tracking.estimation.direction_filter import Bearing
from tracking.estimation.gimbal import Gimbal

OVERLAP = 0.2
"""Share of the crop's field of view that two strips have in common, so that a target is whole in one of them: 4.5
degrees of the aqua2's 22, a ball of 0.2 m at 2.5 m."""


class Search:
    """Everything within reach again and again, and before it where a target that was lost can have gone.

    Parameters
    ----------
    gimbal : Gimbal
    speeds : JointSpeeds
        The servos'.
    view : array, shape (2,)
        Field of view of the crop across and upwards, radians.
    likely : GazeView, optional
        What each pose shows: likely places come first (`likely_paths`). Without it a raster is run to and fro.
    direct : DirectLook, optional
        Looks past the mirrors.
    interval_s : float
        From image to image.
    """

    def __init__(
        self,
        gimbal: Gimbal,
        speeds: JointSpeeds,
        view: FloatArray,
        *,
        likely: GazeView | None = None,
        direct: DirectLook | None = None,
        interval_s: float = 1 / 30,
    ):
        self._gimbal, self._speeds, self._step = gimbal, speeds, (1 - OVERLAP) * view
        # Lost images leave no gap: from one to the next a sweep goes on by no more than a step.
        sweeping = speeds if likely is None else slowed(speeds, self._step, interval_s)
        self._longest_s = min(float(self._step[0]) / sweeping.pan, float(self._step[1]) / (2 * sweeping.tilt))
        self._shown = likely
        self._paths = (
            (raster_path(gimbal, speeds, self._step),)
            if likely is None
            else likely_paths(gimbal, likely, self._step, speeds, interval_s)
        )
        self._begun = 0
        self._lost: LostTarget | None = None
        self._direct = direct
        self._time_s = 0.0
        self._approach_s = 0.0

    @property
    def _path(self) -> JointPath:
        """The first search's, or the one of every other."""
        return self._paths[0 if self._begun <= 1 else -1]

    def begin(self, q: FloatArray) -> None:
        """Search everything from joint values `q` on.

        A raster begins at its nearer end: from an end, everything has been looked at soonest. The path waits at its
        beginning until the mirror has come, which would cut the first strip short otherwise.
        """
        self._lost = None
        self._begun += 1
        approaches_s = move_time(self._speeds, q, self._path.q[[0, -1] if self._shown is None else [0]])
        nearer = int(np.argmin(approaches_s))
        self._time_s = nearer * self._path.duration_s
        self._approach_s = float(approaches_s[nearer])

    def begin_lost(self, bearing: Bearing, age_s: float) -> None:
        """Search where a target can have gone that was last seen at a bearing, so long ago."""
        self._lost = LostTarget(self._gimbal, self._speeds, self._step, bearing, age_s, shown=self._shown)

    def note_unseen(self, seconds: float, q: FloatArray) -> None:
        """Take in an image taken at `q` without a lost target that is still waited for where it is predicted."""
        if self._lost is not None:
            self._lost.note_unseen(q, seconds)

    def resume(self, q: FloatArray) -> None:
        """Go on from joint values `q` where the search was broken off."""
        self._approach_s = float(move_time(self._speeds, q, self._place()[np.newaxis])[0])

    def resume_everything(self, q: FloatArray) -> None:
        """Go on with the search of everything: what was lost was not the target."""
        self._lost = None
        self.resume(q)

    def looks_past_mirrors(self, time_s: float) -> bool:
        """Whether the direct view is to be looked at in an image taken at a time, seconds."""
        return self._direct is not None and self._direct.is_due(time_s)

    def look_past_mirrors(self, image: NDArray[np.uint8], time_s: float, q: FloatArray) -> None:
        """Look at the direct view in an image, taken at `q`; after `looks_past_mirrors`."""
        assert self._direct is not None  # it looks there
        self._direct.take(image, time_s, q)

    def pause(self) -> None:
        """Something is followed."""
        if self._direct is not None:
            self._direct.end()

    def advance(self, seconds: float, q: FloatArray) -> FloatArray:
        """Joint values to ask for, shape (2,), so much later, after an image taken at `q` without the target."""
        if self._direct is not None and self._direct.turned:
            pose = self._direct.pose(seconds, q)
            if pose is not None:
                return pose
            self.resume(q)
        if self._lost is not None:
            pose = self._lost.next_pose(q, seconds)
            if not self._lost.given_up:
                return pose
            self.begin(q)
        passed_s = min(seconds, self._longest_s)
        self._time_s += max(passed_s - self._approach_s, 0.0)
        self._approach_s = max(self._approach_s - passed_s, 0.0)
        if self._shown is not None and self._time_s > self._path.duration_s:
            self.begin(self._path.q[-1])
        return self._place()

    def _place(self) -> FloatArray:
        """Joint values that the search of everything has come to."""
        there_and_back = 2 * self._path.duration_s
        time_s = self._time_s % there_and_back
        return self._path.at(min(time_s, there_and_back - time_s))

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""
        return {
            "begun": self._begun,
            "time_s": self._time_s,
            "approach_s": self._approach_s,
            "lost": None if self._lost is None else self._lost.snapshot(),
            "direct": None if self._direct is None else self._direct.snapshot(),
        }

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot."""
        self._begun, self._time_s, self._approach_s = (snapshot[name] for name in ("begun", "time_s", "approach_s"))
        lost, self._lost = snapshot["lost"], None
        if lost is not None:
            self._lost = LostTarget.restored(lost, self._gimbal, self._speeds, self._step, shown=self._shown)
        if self._direct is not None:
            self._direct.restore(snapshot["direct"])
