"""Where a target that was lost can have gone, and where to look for it next.

A few hundred places stand for what is known: each goes on from where the target was last estimated, at a rate of its
own about the estimated one, from standing still to turning away. A place that an image showed without the
target loses weight, and slowly gains it again, since what hid the target may let it go; one that the robot itself hid
in that image keeps it, and so does one behind what seems to hide the target (`tracking.estimation.lost_places`).
Where to look next is the gaze that shows most weight when the servos get there, divided by the time that this takes, as
among the sweeps of a search for a target of which nothing is known (`search_plan`; Stone 1975, Theory of Optimal
Search, chapter 9, for targets that move).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from optics.gaze.motion import JointSpeeds
from optics.kernels.arrays import FloatArray
from tracking.control.gaze_view import GazeView
from tracking.control.poses import in_view, pose_grid, seen_from
from tracking.estimation.bearing import Bearing
from tracking.estimation.gimbal import Gimbal
from tracking.estimation.lost_places import HIDDEN_RADII, TURNED_S, LostPlaces, in_the_open

PLACES = 256

TURNING = np.arange(PLACES) % 2 == 1
"""Of the places, those that turn back, stop or slow down some time later."""

GOLDEN_ANGLE = math.pi * (3 - math.sqrt(5))

GOLDEN_RATIO = (math.sqrt(5) - 1) / 2

SILVER_RATIO = math.sqrt(2) - 1

KEPT = (-1.0, 0.5)
"""Of its rate, what one has at least and at most that has turned back, stopped or slowed down."""

MOST_RATE = math.radians(20.0)
"""That the target's rate is off by at most; half of the places are within a quarter of it."""

SEEN_S = 0.1
"""Time in view after which a place that does not show the target has lost two thirds of its weight: three images."""

REGAINED_S = 15.0
"""After which it has regained two thirds of what it lost."""

GIVEN_UP_S = 2.5
"""After which everything is searched, what is likely first, about these places as well: they say less and less of one
that turns every few seconds. Of 80 paths from point to point at random the loop without images holds 1542 s with it,
1520 with 1.5 s and 1479 with 5 s."""

LOOK_S = 0.1
"""Least time of a look: a mirror that stops at a place to see something must slow down first."""

ASKED = 40
"""Poses at most that are asked what they show."""

GRID = 0.35
"""Of a view, between gazes that are weighed."""

ARRIVALS_S = np.array([0.1, 0.25, 0.5, 1.0, 1.75, 2.5])
"""Times at which the places are extrapolated; a gaze takes the nearest to when the servos get there."""


class LostTarget:
    """A search around where a target was lost.

    Parameters
    ----------
    gimbal : Gimbal
    speeds : JointSpeeds
        The servos'.
    view : array, shape (2,)
        What the view sees safely in passing, across and upwards, radians.
    bearing : Bearing
        Of the target when it was last seen.
    age_s : float
        Since then.
    hidden : bool
        Whether something hides it.
    turning : float
        Probability that it turns back, stops or slows down within `TURNED_S`.
    shown : GazeView, optional
        What each pose shows; without it, all that lies in the view.
    """

    def __init__(
        self,
        gimbal: Gimbal,
        speeds: JointSpeeds,
        view: FloatArray,
        bearing: Bearing,
        age_s: float,
        *,
        hidden: bool = False,
        turning: float = 0.5,
        shown: GazeView | None = None,
    ):
        self._gimbal, self._speeds, self._view, self._bearing = gimbal, speeds, view, bearing
        self._hidden_at = gimbal.in_gimbal(bearing.direction)
        self._radius: FloatArray = np.resize(HIDDEN_RADII if hidden else 0.0, PLACES)
        self._grid = pose_grid(gimbal, GRID * float(view[0]), GRID * float(view[1]) / 2)
        self._shown = shown
        self._places = _Places(gimbal, bearing)
        self._turning = turning
        self._first_weights: FloatArray = 2 * np.where(TURNING, turning, 1 - turning)
        self._weights = self._first_weights
        self._age_s = age_s
        self._goal: FloatArray | None = None
        self._goal_s = 0.0

    @property
    def given_up(self) -> bool:
        """Whether the target may be anywhere by now."""
        return self._age_s > GIVEN_UP_S

    @property
    def places(self) -> LostPlaces:
        """Where it can have gone by now."""
        return LostPlaces(
            direction=self._places.after(self._age_s),
            weight=self._weights,
            radius=self._radius,
            hidden_at=self._hidden_at,
            bearing=self._bearing,
        )

    def pass_time(self, seconds: float) -> None:
        """It goes on."""
        self._age_s += seconds

    def next_pose(self, q: FloatArray, passed_s: float) -> FloatArray:
        """Joint values to ask for, shape (2,), after an image taken at `q` that did not show the target."""
        self.note_unseen(q, passed_s)
        self._goal_s -= passed_s
        if self._goal is None or self._goal_s <= 0:
            pan, tilt, travel_s = self._best(*self._gimbal.angles(q))
            self._goal, self._goal_s = self._gimbal.joint_values(pan, tilt), travel_s + LOOK_S
        return self._goal

    def note_unseen(self, q: FloatArray, passed_s: float) -> None:
        """Take in an image taken at `q` that did not show the target, so long after the one before."""
        places = self._places.after(self._age_s)
        seen = in_view(self._gimbal, q, places, self._view) * self._in_the_open(places)
        if self._shown is not None:
            seen *= self._shown.shown_at(q, places)
        weights = self._weights * np.exp(-passed_s / SEEN_S * seen)
        self._weights = weights + (self._first_weights - weights) * -math.expm1(-passed_s / REGAINED_S)

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""
        return {
            "direction": self._bearing.direction.tolist(),
            "rate": self._bearing.rate.tolist(),
            "hidden": bool(self._radius.any()),
            "turning": self._turning,
            "weights": self._weights.tolist(),
            "age_s": self._age_s,
            "goal": None if self._goal is None else self._goal.tolist(),
            "goal_s": self._goal_s,
        }

    @classmethod
    def restored(
        cls,
        snapshot: dict[str, Any],
        gimbal: Gimbal,
        speeds: JointSpeeds,
        view: FloatArray,
        *,
        shown: GazeView | None = None,
    ) -> LostTarget:
        """A search that goes on from a snapshot."""
        bearing = Bearing(direction=np.array(snapshot["direction"]), rate=np.array(snapshot["rate"]))
        hidden, turning = snapshot["hidden"], snapshot["turning"]
        search = cls(gimbal, speeds, view, bearing, snapshot["age_s"], hidden=hidden, turning=turning, shown=shown)
        search._weights = np.array(snapshot["weights"])
        search._goal = None if snapshot["goal"] is None else np.array(snapshot["goal"])
        search._goal_s = snapshot["goal_s"]
        return search

    def _best(self, pan: float, tilt: float) -> tuple[float, float, float]:
        """Pan and tilt of the gaze that gains most per second, and the time to get there."""
        pans, tilts = self._grid
        travel_s = np.maximum(
            (np.abs(pans - pan) / self._speeds.pan)[:, np.newaxis], np.abs(tilts - tilt) / self._speeds.tilt
        )
        arrival = np.abs(travel_s[..., np.newaxis] + LOOK_S / 2 - ARRIVALS_S).argmin(axis=-1)
        arrived = {
            index: self._places.after(self._age_s + seconds) for index, seconds in enumerate(ARRIVALS_S.tolist())
        }
        gain = np.zeros(travel_s.shape)
        for index, places in arrived.items():
            then = arrival == index
            rows, columns = then.any(axis=1), then.any(axis=0)
            if rows.any():
                weights = self._weights * self._in_the_open(places)
                seen = seen_from(places, pans[rows], tilts[columns], self._view) @ weights
                gain[np.ix_(rows, columns)] = np.where(then[np.ix_(rows, columns)], seen, gain[np.ix_(rows, columns)])
        most_first = np.unravel_index(np.argsort(-gain / (travel_s + LOOK_S), axis=None)[:ASKED], gain.shape)
        candidates = list(zip(*(each.tolist() for each in most_first), strict=True))
        best, most = candidates[0], 0.0
        for pose in candidates:
            if self._shown is None:
                break
            # What a pose shows is at most what lies in its view, so that few poses are asked what they show.
            time_s = float(travel_s[pose]) + LOOK_S
            if gain[pose] <= most * time_s:
                break
            row, column = pose
            places, gaze = arrived[int(arrival[pose])], (pans[row : row + 1], tilts[column : column + 1])
            shown = seen_from(places, *gaze, self._view) * self._shown.shown(places, *gaze)
            per_s = float(shown[0, 0] @ (self._weights * self._in_the_open(places))) / time_s
            best, most = (pose, per_s) if per_s > most else (best, most)
        return float(pans[best[0]]), float(tilts[best[1]]), float(travel_s[best])

    def _in_the_open(self, places: FloatArray) -> FloatArray:
        """1 of places, shape (PLACES, 3), that nothing hides, 0 of others."""
        return in_the_open(places, self._hidden_at, self._radius).astype(np.float64)


class _Places:
    """Places that a target can have gone to, in the gimbal's frame, by the time since it was lost."""

    def __init__(self, gimbal: Gimbal, bearing: Bearing):
        self._direction = gimbal.in_gimbal(bearing.direction)
        rate = gimbal.in_gimbal(bearing.rate)
        across = np.linalg.svd(self._direction[np.newaxis])[2][1:]
        index = np.arange(PLACES) + 0.5
        # A spiral of points whose distances grow as the square of their share: dense about the estimated rate.
        off = MOST_RATE * (index / PLACES) ** 2
        turn = GOLDEN_ANGLE * index
        around = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        rates = rate + (off[:, np.newaxis] * around) @ across
        self._speeds = np.linalg.norm(rates, axis=1)
        self._along = rates / np.maximum(self._speeds, np.finfo(float).tiny)[:, np.newaxis]
        # The others keep their rates.
        self._kept = np.where(TURNING, KEPT[0] + (KEPT[1] - KEPT[0]) * (GOLDEN_RATIO * index % 1), 1.0)
        self._turned_s = TURNED_S * (SILVER_RATIO * index % 1)

    def after(self, seconds: float) -> FloatArray:
        """Unit vectors, shape (PLACES, 3), each along its great circle."""
        before_s = np.minimum(seconds, self._turned_s)
        angle = (self._speeds * (before_s + self._kept * (seconds - before_s)))[:, np.newaxis]
        return np.asarray(np.cos(angle) * self._direction + np.sin(angle) * self._along)
