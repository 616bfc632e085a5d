"""Whether what is followed is the target, from the odds of what was taken for it; and what was found not to be.

One image's odds are those of a guess: things that look like the target are found among corals. What is followed is
seen many times, but images of a thing that stands still are nearly the same, so that their odds do not add up: their
mean is asked for. Is it below even, the thing is dropped, and its direction is remembered as clutter: the search does
not end there again. A thing that moves with the robot, as its mount, keeps its direction in the body's frame, and
what stands around a hovering robot nearly does; a robot that swims on leaves clutter behind, so it is forgotten.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray

MEMORY_S = 0.5
"""Over which odds are averaged, exponentially."""

MOST_LOG_ODDS = 3.0
"""That one image counts for, more or less: a lucky one does not outweigh ten others."""

CLUTTER_S = 30.0
"""How long clutter is remembered: the time of a search of everything within reach."""

CLUTTER_RAD = math.radians(3.0)
"""Within which what was dropped is recognised: twice what a hovering robot sways by."""


@dataclass(frozen=True, kw_only=True)
class ClutterPlace:
    """Where something was that was not the target: unit vector, body frame, shape (3,), and when it was dropped."""

    direction: FloatArray
    dropped_s: float


@dataclass
class TrackEvidence:
    """Odds of what is followed, and the clutter.

    Attributes
    ----------
    mean : float, optional
        Mean natural logarithm of the odds; None while nothing is followed.
    clutter : list of ClutterPlace
    """

    mean: float | None = None
    clutter: list[ClutterPlace] = field(default_factory=list)

    @property
    def doubted(self) -> bool:
        """Whether what is followed is likelier not to be the target."""
        return self.mean is not None and self.mean < 0

    def update(self, log_odds: float, interval_s: float) -> None:
        """Take in the odds of what was taken for the target in one more image; infinite ones are no guess."""
        counted = min(max(log_odds, -MOST_LOG_ODDS), MOST_LOG_ODDS)
        share = -math.expm1(-interval_s / MEMORY_S)
        self.mean = counted if self.mean is None else self.mean + share * (counted - self.mean)

    def forget(self) -> None:
        """Nothing is followed any more."""
        self.mean = None

    def drop(self, direction: FloatArray, time_s: float) -> None:
        """What is followed is not the target: remember where it is."""
        self.clutter.append(ClutterPlace(direction=direction, dropped_s=time_s))
        self.forget()

    def is_clutter(self, direction: FloatArray, time_s: float) -> bool:
        """Whether something was dropped in a direction, a unit vector, not too long ago."""
        self.clutter = [each for each in self.clutter if time_s - each.dropped_s < CLUTTER_S]
        return any(float(each.direction @ direction) > math.cos(CLUTTER_RAD) for each in self.clutter)

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""
        return {
            "mean": self.mean,
            "clutter": [[each.direction.tolist(), each.dropped_s] for each in self.clutter],
        }

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot."""
        self.mean = snapshot["mean"]
        self.clutter = [
            ClutterPlace(direction=np.array(direction), dropped_s=dropped_s)
            for direction, dropped_s in snapshot["clutter"]
        ]
