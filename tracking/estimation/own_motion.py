"""Whether what is followed has moved by itself: before a hovering robot no coral does.

What is seen again after a gap has not moved there: it may be another thing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray

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
    """

    first: FloatArray | None = None
    moved: bool = False
    swing_rad: float = 0.0

    def note(self, direction: FloatArray) -> bool:
        """Note where it is, a unit vector, steady axes; whether that is away from where it was first seen."""
        self.first = direction if self.first is None else self.first
        swing_rad = math.acos(min(float(self.first @ direction), 1.0))
        away = swing_rad > MOVED_RAD
        self.moved, self.swing_rad = self.moved or away, max(self.swing_rad, swing_rad)
        return away

    def interrupt(self) -> None:
        """An image did not show it."""
        self.first = None

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""
        first = None if self.first is None else self.first.tolist()
        return {"first": first, "moved": self.moved, "swing_rad": self.swing_rad}

    @classmethod
    def restored(cls, snapshot: dict[str, Any]) -> OwnMotion:
        """The motion that a snapshot was taken of."""
        first = None if snapshot["first"] is None else np.array(snapshot["first"])
        return cls(first=first, moved=snapshot["moved"], swing_rad=snapshot["swing_rad"])
