"""Where to look while there is no target: where one that was lost can have gone, then everywhere.

What shows past the mirrors in the meantime is looked at first.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.gaze.motion import JointSpeeds
from optics.kernels.arrays import FloatArray
from tracking.control.direct_look import DirectLook
from tracking.control.everywhere import Everywhere, LikelyFirst, Raster
from tracking.control.follower import Dropped
from tracking.control.gaze_view import GazeView
from tracking.control.lost_target import LostTarget
from tracking.estimation.bearing import Sight
from tracking.estimation.clutter import ClutterPlace
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
        What each pose shows: likely places come first (`LikelyFirst`). Without it a raster is run to and fro.
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
        self._shown = likely
        self._everywhere: Everywhere = (
            Raster(gimbal, speeds, self._step)
            if likely is None
            else LikelyFirst(gimbal, speeds, self._step, likely, interval_s)
        )
        self._lost: LostTarget | None = None
        self._direct = direct

    def begin(self, q: FloatArray) -> None:
        """Search everything from joint values `q` on."""
        self._lost = None
        self._everywhere.begin(q)

    def begin_lost(self, sight: Sight, time_s: float) -> None:
        """Search, from a time on, where a target can have gone that was last seen so."""
        age_s = time_s - sight.time_s
        self._lost = LostTarget(
            self._gimbal,
            self._speeds,
            self._step,
            sight.bearing,
            age_s,
            hidden=sight.hidden,
            turning=sight.turning,
            shown=self._shown,
        )

    def note_dropped(self, dropped: Dropped) -> None:
        """What was followed was dropped, and may be the target for all that."""
        self._everywhere.note_dropped(self._gimbal.in_gimbal(dropped.direction), dropped.probability)

    def note_unseen(self, seconds: float, q: FloatArray, clutter: Iterable[ClutterPlace] = ()) -> None:
        """Take in an image taken at `q` without a lost target that is still waited for where it is predicted.

        What is passed by as clutter, body frame, may be it.
        """
        self._everywhere.note_unseen(q, self._in_gimbal(clutter))
        if self._lost is not None:
            self._lost.note_unseen(q, seconds)

    def resume(self, q: FloatArray) -> None:
        """Go on from joint values `q` where the search was broken off."""
        self._everywhere.resume(q)

    def resume_everything(self, q: FloatArray) -> None:
        """Go on with the search of everything: what was lost was not the target."""
        self._lost = None
        self.resume(q)

    def looks_past_mirrors(self, time_s: float) -> bool:
        """Whether the direct view is to be looked at in an image taken at a time, seconds."""
        return self._direct is not None and self._direct.is_due(time_s)

    def look_past_mirrors(
        self, image: NDArray[np.uint8], time_s: float, q: FloatArray, clutter: Iterable[ClutterPlace] = ()
    ) -> None:
        """Look at the direct view in an image, taken at `q`; after `looks_past_mirrors`.

        What is passed by as clutter, body frame, is passed by there as well.
        """
        assert self._direct is not None  # it looks there
        self._direct.take(image, time_s, q, clutter)

    def pause(self, seconds: float, *, found: bool) -> None:
        """Something is followed, and so much time passes; what was lost has been found, or it may be something else."""
        self._everywhere.pass_time(seconds)
        if found:
            self._lost = None
        elif self._lost is not None:
            self._lost.pass_time(seconds)
        if self._direct is not None:
            self._direct.end()

    def advance(self, seconds: float, q: FloatArray, clutter: Iterable[ClutterPlace] = ()) -> FloatArray:
        """Joint values to ask for, shape (2,), so much later, after an image taken at `q` without the target.

        What is passed by as clutter, body frame, may be it.
        """
        self._everywhere.pass_time(seconds)
        self._everywhere.note_unseen(q, self._in_gimbal(clutter))
        if self._direct is not None and self._direct.turned:
            pose = self._direct.pose(seconds, q)
            if pose is not None:
                return pose
            self.resume(q)
        if self._lost is not None:
            self._lost.pass_time(seconds)
            pose = self._lost.next_pose(q, seconds)
            if not self._lost.given_up:
                return pose
            self._everywhere.note_lost(self._lost.places)
            self.begin(q)
        return self._everywhere.advance(seconds, q)

    def _in_gimbal(self, clutter: Iterable[ClutterPlace]) -> list[ClutterPlace]:
        return [replace(each, direction=self._gimbal.in_gimbal(each.direction)) for each in clutter]

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""
        return {
            "everywhere": self._everywhere.snapshot(),
            "lost": None if self._lost is None else self._lost.snapshot(),
            "direct": None if self._direct is None else self._direct.snapshot(),
        }

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot."""
        self._everywhere.restore(snapshot["everywhere"])
        lost, self._lost = snapshot["lost"], None
        if lost is not None:
            self._lost = LostTarget.restored(lost, self._gimbal, self._speeds, self._step, shown=self._shown)
        if self._direct is not None:
            self._direct.restore(snapshot["direct"])
