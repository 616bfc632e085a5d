"""Whether what is followed has moved by itself, as before a hovering robot no coral does, or stays where it was.

What is seen again after a gap has not moved there: it may be another thing. But it has not stayed either, if it is far
from where it was first seen.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray

STAYS_RAD, STAYS_AS_LARGE = math.radians(14.0), 2.0
"""From where it was first seen, within which what stands still stays, and times as large or as small as in its first
second, within which its area does: a hovering robot turns by 5 degrees to each side about two axes, and sways by 6 cm.
Of 1,000 looks at decoys of the arena that stand still 993 are within both for 15 s."""

SIZED_S = 1.0
"""After which its usual area is known: the first images may show a part of it."""

WAY_M, SOONEST_S = 1.4, 3.0
"""What a target of known speed has swum, and the least time that it has had, when it has left the place where it was
first seen: of 1,500 looks at moving targets of the arena 0.01 to 0.05 had not by then, and 0.995 of decoys at rest.
They are up to 3 m away, where 1.4 m across are 25 degrees; twice as far away a target seems half as fast."""

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
    begin : array, shape (3,), optional
        Unit vector to where it was seen in the very first image.
    begin_px2 : float
        Its usual area in the first second, pixels of the crop; zero where that is not known.
    total : array, shape (3,)
        Sum of its directions: where it is in the middle of the robot's sway.
    left : bool
        Whether it has once been farther from there than what stands still gets, or that much nearer or farther away.
    stayed_s : float
        For how long it was seen before that.
    """

    first: FloatArray | None = None
    moved: bool = False
    swing_rad: float = 0.0
    begin: FloatArray | None = None
    begin_px2: float = 0.0
    total: FloatArray = field(default_factory=lambda: np.zeros(3), compare=False)
    left: bool = False
    stayed_s: float = 0.0

    @property
    def middle(self) -> FloatArray:
        """Unit vector to the middle of where it has been."""
        return np.asarray(self.total / np.linalg.norm(self.total))

    def note(self, direction: FloatArray, interval_s: float, usual_px2: float) -> bool:
        """Note where it is, and how large; whether that is away from where it was first seen.

        Parameters
        ----------
        direction : array, shape (3,)
            Unit vector, steady axes.
        interval_s : float
            Since the image before.
        usual_px2 : float
            Area that most of the last images showed, pixels of the crop; zero where that is not known.
        """
        self.first = direction if self.first is None else self.first
        self.begin = direction if self.begin is None else self.begin
        swing_rad = _angle_rad(self.first, direction)
        away = swing_rad > MOVED_RAD
        self.moved, self.swing_rad = self.moved or away, max(self.swing_rad, swing_rad)
        self.left = self.left or _angle_rad(self.begin, direction) > STAYS_RAD
        if self.begin_px2 == 0 and self.stayed_s >= SIZED_S:
            self.begin_px2 = usual_px2
        if self.begin_px2 > 0 and usual_px2 > 0:
            self.left = self.left or not 1 / STAYS_AS_LARGE <= usual_px2 / self.begin_px2 <= STAYS_AS_LARGE
        self.stayed_s += 0.0 if self.left else interval_s
        self.total = self.total + direction
        return away

    def stays(self, speed_m_per_s: float) -> bool:
        """Whether it is still where it was first seen when a target of a speed would have left."""
        return not self.left and self.stayed_s > max(SOONEST_S, WAY_M / speed_m_per_s)

    def interrupt(self) -> None:
        """An image did not show it."""
        self.first = None

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""
        first, begin = (None if each is None else each.tolist() for each in (self.first, self.begin))
        return {**vars(self), "first": first, "begin": begin, "total": self.total.tolist()}

    @classmethod
    def restored(cls, snapshot: dict[str, Any]) -> OwnMotion:
        """The motion that a snapshot was taken of."""
        first, begin = (None if snapshot[name] is None else np.array(snapshot[name]) for name in ("first", "begin"))
        return cls(**{**snapshot, "first": first, "begin": begin, "total": np.array(snapshot["total"])})


def _angle_rad(first: FloatArray, second: FloatArray) -> float:
    return math.acos(min(float(first @ second), 1.0))
