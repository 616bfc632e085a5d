"""Searches of everything within reach: in strips, as the paper's, or where a target is likely first."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Protocol

import numpy as np

from optics.gaze.motion import JointSpeeds, move_time
from optics.kernels.arrays import FloatArray
from tracking.control.belief import Belief, likely_directions
from tracking.control.gaze_view import GazeView
from tracking.control.joint_paths import JointPath, raster_path
from tracking.control.search_plan import SearchPlan, slowed
from tracking.estimation.clutter import ClutterPlace
from tracking.estimation.gimbal import Gimbal
from tracking.estimation.lost_places import LostPlaces


class Everywhere(Protocol):
    """A search of everything. Joint values have shape (2,), radians."""

    def begin(self, q: FloatArray) -> None:
        """Begin from joint values `q`."""

    def resume(self, q: FloatArray) -> None:
        """Go on from joint values `q` after it was broken off."""

    def pass_time(self, seconds: float) -> None:
        """It is broken off, and so much time passes."""

    def note_unseen(self, q: FloatArray, clutter: Iterable[ClutterPlace] = ()) -> None:
        """Take in an image taken at `q` without the target, but for what is passed by as clutter, gimbal's frame."""

    def note_dropped(self, direction: FloatArray, probability: float) -> None:
        """What was followed in a direction, gimbal's frame, was dropped, and is the target with a probability."""

    def note_lost(self, places: LostPlaces) -> None:
        """The target was lost, and can have gone to places."""

    def advance(self, seconds: float, q: FloatArray) -> FloatArray:
        """Joint values to ask for, so much later, at joint values `q`."""

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot."""


class Raster:
    """Strips, to and fro; what images show is not kept."""

    def __init__(self, gimbal: Gimbal, speeds: JointSpeeds, step: FloatArray):
        self._speeds = speeds
        self._path = raster_path(gimbal, speeds, step)
        self._longest_s = _longest_s(speeds, step)
        self._time_s = self._approach_s = 0.0

    def begin(self, q: FloatArray) -> None:
        """Begin at the nearer end: from an end, everything has been looked at soonest.

        The path waits at its beginning until the mirror has come, which would cut the first strip short otherwise.
        """
        approaches_s = move_time(self._speeds, q, self._path.q[[0, -1]])
        nearer = int(np.argmin(approaches_s))
        self._time_s = nearer * self._path.duration_s
        self._approach_s = float(approaches_s[nearer])

    def resume(self, q: FloatArray) -> None:
        """Go on where it was broken off."""
        self._approach_s = float(move_time(self._speeds, q, self._place()[np.newaxis])[0])

    def pass_time(self, seconds: float) -> None:
        """Nothing is kept."""

    def note_unseen(self, q: FloatArray, clutter: Iterable[ClutterPlace] = ()) -> None:
        """Nothing is kept."""

    def note_dropped(self, direction: FloatArray, probability: float) -> None:
        """Nothing is kept."""

    def note_lost(self, places: LostPlaces) -> None:
        """Nothing is kept."""

    def advance(self, seconds: float, q: FloatArray) -> FloatArray:
        """Joint values to ask for, so much later."""
        passed_s = min(seconds, self._longest_s)
        self._time_s += max(passed_s - self._approach_s, 0.0)
        self._approach_s = max(self._approach_s - passed_s, 0.0)
        return self._place()

    def _place(self) -> FloatArray:
        there_and_back = 2 * self._path.duration_s
        time_s = self._time_s % there_and_back
        return self._path.at(min(time_s, there_and_back - time_s))

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""
        return {"time_s": self._time_s, "approach_s": self._approach_s}

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot."""
        self._time_s, self._approach_s = snapshot["time_s"], snapshot["approach_s"]


class LikelyFirst:
    """Sweeps, each chosen when the one before has ended by where the target may be then."""

    def __init__(self, gimbal: Gimbal, speeds: JointSpeeds, step: FloatArray, view: GazeView, interval_s: float):
        there = likely_directions(gimbal, view)
        self._plan = SearchPlan(gimbal, view, there, step, speeds, interval_s=interval_s)
        self._belief = Belief(there, view)
        self._longest_s = _longest_s(slowed(speeds, step, interval_s), step)
        self._begun = False
        self._path: JointPath | None = None
        self._sweep = 0
        self._time_s = 0.0

    def begin(self, q: FloatArray) -> None:
        """Begin from where the mirror is."""
        self._begun = True
        self.resume(q)

    def resume(self, q: FloatArray) -> None:
        """Choose a sweep from where the mirror is."""
        self._path = None

    def pass_time(self, seconds: float) -> None:
        """The target moves on, from when the search has begun."""
        if self._begun:
            self._belief.pass_time(seconds)

    def note_unseen(self, q: FloatArray, clutter: Iterable[ClutterPlace] = ()) -> None:
        """The target is less likely where an image did not show it."""
        self._belief.note_unseen(q, clutter)

    def note_dropped(self, direction: FloatArray, probability: float) -> None:
        """The target is as likely there as that is it."""
        self._belief.note_dropped(direction, probability)

    def note_lost(self, places: LostPlaces) -> None:
        """The target is likely where it can have gone, and moves on as fast as it went, about as high."""
        self._belief.note_lost(places)

    def advance(self, seconds: float, q: FloatArray) -> FloatArray:
        """Joint values to ask for, so much later; lost images leave no gap in a sweep."""
        if self._path is None:
            (self._path, self._sweep), self._time_s = self._plan.next_from(q, self._belief.probability_in_the_open), 0.0
            self._belief.missed[:] = 1
        self._time_s += min(seconds, self._longest_s)
        if self._time_s > self._path.duration_s:
            self._time_s -= self._path.duration_s
            self._belief.note_swept(self._plan.found_by(self._sweep))
            self._path, self._sweep = self._plan.next_from(self._path.q[-1], self._belief.probability_in_the_open)
        return self._path.at(self._time_s)

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""
        path = self._path
        return {
            "belief": self._belief.snapshot(),
            "begun": self._begun,
            "path": None if path is None else [path.q.tolist(), path.time_s.tolist()],
            "sweep": self._sweep,
            "time_s": self._time_s,
        }

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot."""
        self._belief.restore(snapshot["belief"])
        self._sweep = snapshot["sweep"]
        self._begun, self._time_s, path = snapshot["begun"], snapshot["time_s"], snapshot["path"]
        self._path = None if path is None else JointPath(q=np.array(path[0]), time_s=np.array(path[1]))


def _longest_s(sweeping: JointSpeeds, step: FloatArray) -> float:
    """In which a sweep goes on by a step at most: more is not counted of the time between two images."""
    return min(float(step[0]) / sweeping.pan, float(step[1]) / (2 * sweeping.tilt))
