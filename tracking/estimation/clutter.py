"""Where something was that was not the target: the search does not end there again."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray


@dataclass(frozen=True, kw_only=True)
class ClutterPlace:
    """Where something was: unit vector, shape (3,), how far about, until when."""

    direction: FloatArray
    within_rad: float
    until_s: float


@dataclass
class Clutter:
    """Places of what was dropped, for as long as it is remembered."""

    places: list[ClutterPlace] = field(default_factory=list)

    def add(self, direction: FloatArray, within_rad: float, until_s: float) -> None:
        """Remember a direction and what is about it."""
        self.places.append(ClutterPlace(direction=direction, within_rad=within_rad, until_s=until_s))

    def covers(self, direction: FloatArray, time_s: float) -> bool:
        """Whether something was dropped in a direction, a unit vector, not too long ago."""
        return any(float(each.direction @ direction) > math.cos(each.within_rad) for each in self.at(time_s))

    def at(self, time_s: float) -> list[ClutterPlace]:
        """What is remembered at a time; the rest is forgotten."""
        self.places = [each for each in self.places if time_s < each.until_s]
        return self.places

    def snapshot(self) -> list[Any]:
        """State as plain numbers."""
        return [[each.direction.tolist(), each.within_rad, each.until_s] for each in self.places]

    def restore(self, snapshot: list[Any]) -> None:
        """Go on from a snapshot."""
        self.places = [
            ClutterPlace(direction=np.array(direction), within_rad=within_rad, until_s=until_s)
            for direction, within_rad, until_s in snapshot
        ]
