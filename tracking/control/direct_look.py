"""What the direct view tells a search: something that looks like the target, and where to turn the gaze to see it.

Past the mirrors the target is seen in passing and from another place, so that a sighting is not followed: it says where
the gaze is to look. What is found there has to become a candidate, as anything that the search meets.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.gaze.motion import JointSpeeds, move_time
from optics.kernels.arrays import FloatArray
from tracking.control.gaze_view import GazeView
from tracking.control.poses import pose_grid
from tracking.estimation.clutter import ClutterPlace
from tracking.estimation.gimbal import Gimbal
from tracking.perception import ACQUIRED_LOG_ODDS
from tracking.perception.detectors import Detector
from tracking.perception.direct_view import DirectView

INTERVAL_S = 0.2
"""From look to look: a target at 2 m that swims at 0.9 m/s has moved by 5 degrees, a quarter of the gaze."""

CLEAR_CELLS = 8.0
"""From edge and robot, as `GazeView.clearance` has it, at which a sighting is to be seen, if any pose shows it so well:
4 degrees, what the wrong distance may turn it by."""

LOOK_S = 0.3
"""For which the gaze must have shown a sighting's direction without finding anything there."""

LONGEST_S = 3.0
"""Of one look, with the way there: the slowest servos of the presets turn through all their range in less."""

REMEMBERED_S, REMEMBERED_RAD = 10.0, math.radians(6.0)
"""For how long, and how far around, what was looked at is not looked at again."""

GRID_RAD = math.radians(5.0)
"""Of the gaze, between the poses that are asked whether they show a sighting."""


class DirectLook:
    """Turns a search to what the direct view shows.

    Parameters
    ----------
    view : DirectView
    detect : callable
        The loop's detector.
    gimbal : Gimbal
    speeds : JointSpeeds
        The servos'.
    shown : GazeView
        What each pose of the gaze shows.
    """

    def __init__(self, view: DirectView, detect: Detector, gimbal: Gimbal, speeds: JointSpeeds, shown: GazeView):
        self._view, self._detect, self._gimbal, self._speeds, self._shown = view, detect, gimbal, speeds, shown
        self._grid = pose_grid(gimbal, GRID_RAD, GRID_RAD / 2)
        self._looked_s = -math.inf
        self._direction: FloatArray | None = None
        self._goal: FloatArray = gimbal.middle
        self._spent_s = self._shown_s = 0.0
        self._remembered: list[tuple[FloatArray, float]] = []

    @property
    def turned(self) -> bool:
        """Whether it has a sighting."""
        return self._direction is not None

    def is_due(self, time_s: float) -> bool:
        """Whether an image at a time, seconds, is to be looked at."""
        return time_s - self._looked_s > INTERVAL_S - 1e-6

    def take(
        self, image: NDArray[np.uint8], time_s: float, q: FloatArray, clutter: Iterable[ClutterPlace] = ()
    ) -> None:
        """Look at the direct view in an image, taken at joint values `q`: the likeliest new thing is turned to.

        New is what was not looked at so before, nor is passed by as clutter, body frame.
        """
        self._looked_s = time_s
        passed_by = list(clutter)
        picture, hidden = self._view.taken_from(image)
        self._remembered = [each for each in self._remembered if time_s < each[1]]
        for blob in self._detect(picture, hidden, None).blobs:
            if blob.log_odds < ACQUIRED_LOG_ODDS:
                continue
            direction = self._view.direction_at((np.array(blob.centroid_px) + 0.5) / picture.shape[1::-1])
            known = self._is_remembered(direction) or any(_is_about(place, direction) for place in passed_by)
            goal = None if known else self._pose_for(direction, q)
            if goal is not None:
                if self._direction is None:
                    self._spent_s = self._shown_s = 0.0
                self._direction, self._goal = direction, goal
                return

    def pose(self, passed_s: float, q: FloatArray) -> FloatArray | None:
        """Joint values that show the sighting, so much later, after an image at `q` without it; None: it is over."""
        assert self._direction is not None  # it has a sighting
        if self._shown.shows_at(q, self._gimbal.in_gimbal(self._direction)[np.newaxis])[0]:
            self._shown_s += passed_s
        self._spent_s += passed_s
        if self._shown_s > LOOK_S or self._spent_s > LONGEST_S:
            self.end()
            return None
        return self._goal

    def end(self) -> None:
        """The gaze has found something, or nothing was there: what was turned to is remembered."""
        if self._direction is not None:
            self._remembered.append((self._direction, self._looked_s + REMEMBERED_S))
            self._direction = None

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""
        return {
            "looked_s": None if math.isinf(self._looked_s) else self._looked_s,
            "direction": None if self._direction is None else self._direction.tolist(),
            "goal": self._goal.tolist(),
            "spent_s": self._spent_s,
            "shown_s": self._shown_s,
            "remembered": [[direction.tolist(), until_s] for direction, until_s in self._remembered],
        }

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot."""
        looked_s, direction = snapshot["looked_s"], snapshot["direction"]
        self._looked_s = -math.inf if looked_s is None else looked_s
        self._direction = None if direction is None else np.array(direction)
        self._goal = np.array(snapshot["goal"])
        self._spent_s, self._shown_s = snapshot["spent_s"], snapshot["shown_s"]
        self._remembered = [(np.array(place), until_s) for place, until_s in snapshot["remembered"]]

    def _is_remembered(self, direction: FloatArray) -> bool:
        return any(float(place @ direction) > math.cos(REMEMBERED_RAD) for place, _ in self._remembered)

    def _pose_for(self, direction: FloatArray, q: FloatArray) -> FloatArray | None:
        """Joint values that show a direction clearly and are reached first; None where none shows it."""
        pans, tilts = self._grid
        clear = self._shown.clearance(self._gimbal.in_gimbal(direction)[np.newaxis], pans, tilts)[..., 0]
        if not clear.max() > 0:
            return None
        row, column = np.nonzero(clear >= min(float(clear.max()), CLEAR_CELLS))
        poses = np.array([self._gimbal.joint_values(*each) for each in zip(pans[row], tilts[column], strict=True)])
        return np.asarray(poses[move_time(self._speeds, q, poses).argmin()])


def _is_about(place: ClutterPlace, direction: FloatArray) -> bool:
    """Whether a direction may be clutter's: the wrong distance may turn it by as much as is remembered around it."""
    return float(place.direction @ direction) > math.cos(place.within_rad + REMEMBERED_RAD)
