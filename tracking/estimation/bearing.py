"""Where a target is estimated to be, and where it will be."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray
from tracking.estimation.sway import Sway


@dataclass(frozen=True, kw_only=True)
class Bearing:
    """Where the target is estimated to be, seen from the centre of M2, and how it moves.

    Attributes
    ----------
    direction : array, shape (3,)
        Unit vector, body frame or steady axes.
    rate : array, shape (3,)
        Of the direction, across it, rad/s.
    """

    direction: FloatArray
    rate: FloatArray

    def after(self, seconds: float) -> Bearing:
        """The same target later, along its great circle."""
        speed = math.sqrt(self.rate @ self.rate)
        if speed == 0:
            return self
        turn, along = speed * seconds, self.rate / speed
        cosine, sine = math.cos(turn), math.sin(turn)
        return Bearing(
            direction=cosine * self.direction + sine * along, rate=speed * (cosine * along - sine * self.direction)
        )

    def directions_after(self, seconds: Sequence[float]) -> FloatArray:
        """Its direction at later times, shape (n, 3), as `after` has it of one."""
        speed = math.sqrt(self.rate @ self.rate)
        if speed == 0:
            return np.tile(self.direction, (len(seconds), 1))
        turns = [speed * each for each in seconds]
        cosines, sines = np.array([[math.cos(turn), math.sin(turn)] for turn in turns]).T[..., np.newaxis]
        return np.asarray(cosines * self.direction + sines * (self.rate / speed))

    def turned(self, turn: FloatArray) -> Bearing:
        """The same in other axes; `turn`, shape (3, 3), takes a vector of these to those."""
        return Bearing(direction=turn @ self.direction, rate=turn @ self.rate)


@dataclass(frozen=True, kw_only=True)
class SwayingBearing(Bearing):
    """A bearing that sways about a path.

    Attributes
    ----------
    direction, rate : array, shape (3,)
        Of path and sway together.
    path : Bearing
        Along which it would be seen without sway.
    displacement, displacement_rate : array, shape (3,)
        What the sway adds to the path's direction, across it, and the rate of that, 1/s.
    sway : Sway
    """

    path: Bearing
    displacement: FloatArray
    displacement_rate: FloatArray
    sway: Sway

    @classmethod
    def about(
        cls, path: Bearing, displacement: FloatArray, displacement_rate: FloatArray, sway: Sway
    ) -> SwayingBearing:
        """Bearing of a path and what sways about it, both across the path."""
        direction, rate = on_the_sphere(path.direction + displacement, path.rate + displacement_rate)
        return cls(
            direction=direction,
            rate=rate,
            path=path,
            displacement=displacement,
            displacement_rate=displacement_rate,
            sway=sway,
        )

    def after(self, seconds: float) -> Bearing:
        """The same target later: the path goes on, the sway swings and dies away."""
        displacement, rate = self.sway.transition(seconds) @ [self.displacement, self.displacement_rate]
        return SwayingBearing.about(self.path.after(seconds), displacement, rate, self.sway)

    def directions_after(self, seconds: Sequence[float]) -> FloatArray:
        """Its direction at later times, shape (n, 3), as `after` has it of one."""
        swung = np.array([self.sway.transition(each)[0] for each in seconds])
        sum_ = self.path.directions_after(seconds) + swung @ [self.displacement, self.displacement_rate]
        return np.asarray(sum_ / np.linalg.norm(sum_, axis=1, keepdims=True))

    def turned(self, turn: FloatArray) -> Bearing:
        """The same in other axes."""
        return SwayingBearing.about(
            self.path.turned(turn), turn @ self.displacement, turn @ self.displacement_rate, self.sway
        )


@dataclass(frozen=True, kw_only=True)
class Sight:
    """When and where a target was last seen.

    Attributes
    ----------
    bearing : Bearing
    time_s : float
    hidden : bool
        Whether something seems to hide it since: it went out of sight in the middle of the view.
    turning : float
        Probability that it turns back, stops or slows down within `tracking.estimation.lost_places.TURNED_S`.
    """

    bearing: Bearing
    time_s: float
    hidden: bool = False
    turning: float = 0.5

    def snapshot(self) -> dict[str, Any]:
        """As plain numbers; of one that sways, where it is and how it moves altogether."""
        return {
            "direction": self.bearing.direction.tolist(),
            "rate": self.bearing.rate.tolist(),
            "time_s": self.time_s,
            "hidden": self.hidden,
            "turning": self.turning,
        }

    @classmethod
    def restored(cls, snapshot: dict[str, Any]) -> Sight:
        """From a snapshot."""
        bearing = Bearing(direction=np.array(snapshot["direction"]), rate=np.array(snapshot["rate"]))
        return cls(bearing=bearing, **{name: snapshot[name] for name in ("time_s", "hidden", "turning")})


def on_the_sphere(direction: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Unit direction, and the part of the rate across it."""
    unit = direction / math.sqrt(direction @ direction)
    return unit, rate - (rate @ unit) * unit
