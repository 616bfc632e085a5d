"""Whether what is followed has moved by itself, as before a hovering robot no coral does, or stays where it was.

What is seen again after a gap has not moved there: it may be another thing. But it has not stayed either, if it is far
from where it was seen before.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field
from statistics import median
from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray

STAYS_RAD, STAYS_AS_LARGE = math.radians(15.0), 1.5
"""From end to end of its directions, within which what stands still stays, and its largest usual area over its
smallest: a hovering robot turns by 5 degrees to each side about two axes, and sways by 6 cm. By their paths none of the
arena's decoys at rest has more than 13.9 degrees and 1.10 in 1,530 times of 15 s."""

AREAS = 15
"""Of the last images in which it was round that its usual area is the median of."""

WAY_M, SOONEST_S = 1.4, 3.0
"""What a target of known speed has swum, and the least time that it has had, when it has left the place where it was
first seen: of 1,650 such times of the arena's moving targets, by their paths, 0.009 had not by then, of those to and
fro 0.029. They are up to 3 m away, where 1.4 m across are 25 degrees; twice as far away a target seems half as fast."""

MOVED_RAD = math.radians(20.0)
"""From where it was first seen, by which only a thing that moves by itself gets: a hovering robot turns by 5 degrees
to each side about two axes, which is 14 from end to end, and sways by 6 cm, which are 6 more at 1.5 m."""


@dataclass
class OwnMotion:
    """Directions of what is followed, an image at a time.

    Attributes
    ----------
    first : array, shape (3,), optional
        Unit vector to where it was first seen in all images since, steady axes.
    moved : bool
        Whether it has once got away from there by itself.
    swing_rad : float
        How far it has got from there at most, by itself or by the robot's sway.
    ends : array, shape (2, 3), optional
        Unit vectors to where it was seen, about as far apart as any two, across gaps.
    areas_px2 : deque of float
        Of the last images in which it was round, pixels of the crop.
    least_px2, most_px2 : float
        Median of as many, the least and the most; zero before there were as many.
    total : array, shape (3,)
        Sum of its directions: where it is in the middle of the robot's sway.
    left : bool
        Whether its directions or its areas are farther apart than those of what stands still.
    stayed_s : float
        For how long it was seen before that.
    """

    first: FloatArray | None = None
    moved: bool = False
    swing_rad: float = 0.0
    ends: FloatArray | None = None
    areas_px2: deque[float] = field(default_factory=lambda: deque(maxlen=AREAS))
    least_px2: float = 0.0
    most_px2: float = 0.0
    total: FloatArray = field(default_factory=lambda: np.zeros(3), compare=False)
    left: bool = False
    stayed_s: float = 0.0

    @property
    def middle(self) -> FloatArray:
        """Unit vector to the middle of where it has been."""
        return np.asarray(self.total / np.linalg.norm(self.total))

    def note(self, direction: FloatArray, interval_s: float, round_px2: float | None) -> bool:
        """Note where it is, and how large; whether that is away from where it was first seen.

        Parameters
        ----------
        direction : array, shape (3,)
            Unit vector, steady axes.
        interval_s : float
            Since the image before.
        round_px2 : float, optional
            Its area, pixels of the crop; None where it is not round, as when it is hidden in part.
        """
        self.first = direction if self.first is None else self.first
        swing_rad = _angle_rad(self.first, direction)
        away = swing_rad > MOVED_RAD
        self.moved, self.swing_rad = self.moved or away, max(self.swing_rad, swing_rad)
        self._part_ends(direction)
        if round_px2 is not None:
            self._note_area(round_px2)
        self.stayed_s += 0.0 if self.left else interval_s
        self.total = self.total + direction
        return away

    def _part_ends(self, direction: FloatArray) -> None:
        """Put one of the ends where it is, if the two are farther apart then; what they are tells whether it left."""
        if self.ends is None:
            self.ends = np.stack([direction, direction])
        apart_rad = _angle_rad(*self.ends)
        to_ends_rad = [_angle_rad(end, direction) for end in self.ends]
        if max(to_ends_rad) > apart_rad:
            self.ends = np.stack([self.ends[int(np.argmax(to_ends_rad))], direction])
            self.left = self.left or max(to_ends_rad) > STAYS_RAD

    def _note_area(self, area_px2: float) -> None:
        self.areas_px2.append(area_px2)
        if len(self.areas_px2) == AREAS:
            usual_px2 = median(self.areas_px2)
            self.least_px2 = min(self.least_px2 or usual_px2, usual_px2)
            self.most_px2 = max(self.most_px2, usual_px2)
            self.left = self.left or self.most_px2 > STAYS_AS_LARGE * self.least_px2

    def stays(self, speed_m_per_s: float) -> bool:
        """Whether it is still where it was first seen when a target of a speed would have left."""
        return not self.left and self.stayed_s > max(SOONEST_S, WAY_M / speed_m_per_s)

    def interrupt(self) -> None:
        """An image did not show it."""
        self.first = None

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""
        first, ends = (None if each is None else each.tolist() for each in (self.first, self.ends))
        arrays = {"first": first, "ends": ends, "areas_px2": list(self.areas_px2), "total": self.total.tolist()}
        return {**vars(self), **arrays}

    @classmethod
    def restored(cls, snapshot: dict[str, Any]) -> OwnMotion:
        """The motion that a snapshot was taken of."""
        first, ends = (None if snapshot[name] is None else np.array(snapshot[name]) for name in ("first", "ends"))
        areas_px2, total = deque(snapshot["areas_px2"], maxlen=AREAS), np.array(snapshot["total"])
        return cls(**{**snapshot, "first": first, "ends": ends, "areas_px2": areas_px2, "total": total})


def _angle_rad(first: FloatArray, second: FloatArray) -> float:
    return math.acos(min(float(first @ second), 1.0))
