"""Where a target that was lost can have gone by now, and how much of that something may hide.

A target that goes out of sight in the middle of the view has gone behind something, of which nobody knows how far it
reaches: any of a few radii about where the target was seen last is as likely. Images of what is within it do not show a
target that is there, and so say nothing of it: it comes out at the edge, sooner or later.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray
from tracking.estimation.bearing import Bearing

HIDDEN_RADII = np.radians([0.0, 8.0, 15.0, 25.0])
"""Of what hides a target. A ball of 0.4 m reaches 13 degrees to each side at 0.9 m, and a target of 0.2 m behind it is
seen from 10 on; none, for what is not seen for another reason. With 0, 10, 20 and 40 degrees 38 dives without images
lose 124 s instead of 120 (144 with none)."""

TURNED_S = 3.0
"""Within which what turns back, stops or slows down has done so, at any time alike."""

FIRST_S = TURNED_S / math.log(2.0)
"""For which a target is taken to have been seen, with one turn, before it is seen at all: it turns within `TURNED_S` as
likely as not."""

GAP_S = 1.0
"""From which a gap is long enough for a target to come back, and to be seen to have: it has gone by 4 degrees."""

LEAST_RATE = math.radians(4.0)
"""Per second, from which a rate has a sense that sway and noise do not turn round."""


@dataclass
class Turns:
    """How often a target has turned back.

    Attributes
    ----------
    number : int
    seen_s : float
        Time in which it could have.
    time_s : float, optional
        When it was last seen.
    last : Bearing, optional
        When its rate last had a sense, steady axes.
    """

    number: int = 0
    seen_s: float = 0.0
    time_s: float | None = None
    last: Bearing | None = None

    @property
    def turning(self) -> float:
        """Probability that it turns within `TURNED_S`: turns come at random, at the rate seen (Gamma prior)."""
        return -math.expm1(-TURNED_S * (self.number + 1) / (self.seen_s + FIRST_S))

    def note(self, bearing: Bearing, time_s: float) -> None:
        """Note how a target that is seen moves, at a time.

        After a gap it has turned, if it is seen on the side from which it came, whichever way it goes by then. What has
        gone on evenly gets to that side after half a circle, and goes that way after a quarter of one.
        """
        gap_s = 0.0 if self.time_s is None else time_s - self.time_s
        self.seen_s += min(gap_s, TURNED_S)
        self.time_s = time_s
        if np.linalg.norm(bearing.rate) < LEAST_RATE:
            return
        if self.last is not None:
            way = gap_s * np.linalg.norm(self.last.rate)
            came_back = (
                gap_s >= GAP_S and way < math.pi and self.last.rate @ (bearing.direction - self.last.direction) < 0
            )
            goes_back = way < math.pi / 2 and self.last.rate @ bearing.rate < 0
            self.number += bool(came_back or goes_back)
        self.last = bearing

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""
        last = None if self.last is None else [self.last.direction.tolist(), self.last.rate.tolist()]
        return {"number": self.number, "seen_s": self.seen_s, "time_s": self.time_s, "last": last}

    @classmethod
    def restored(cls, snapshot: dict[str, Any]) -> Turns:
        """From a snapshot."""
        last = snapshot["last"]
        return cls(**snapshot | {"last": last and Bearing(direction=np.array(last[0]), rate=np.array(last[1]))})


@dataclass(frozen=True, kw_only=True)
class LostPlaces:
    """Places to which it can have gone.

    Attributes
    ----------
    direction : array, shape (n, 3)
        Unit vectors, gimbal's frame.
    weight : array, shape (n,)
    radius : array, shape (n,)
        Of what hides it there, radians, one of a few; zero of a target that nothing hides.
    hidden_at : array, shape (3,)
        Unit vector, gimbal's frame: the middle of that.
    bearing : Bearing
        When it was last seen, body frame.
    """

    direction: FloatArray
    weight: FloatArray
    radius: FloatArray
    hidden_at: FloatArray
    bearing: Bearing


def in_the_open(direction: FloatArray, hidden_at: FloatArray, radius: FloatArray) -> NDArray[np.bool_]:
    """Which unit vectors, shape (..., 3), are not within a radius, radians, of where something hides a target.

    The radius broadcasts with the directions; one of zero hides nothing.
    """
    return np.asarray((radius == 0) | (direction @ hidden_at < np.cos(radius)))
