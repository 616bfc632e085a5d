"""The mirrors on a dive's clock: commands that arrive late, and the motion that an exposure sees.

An image is exposed from before its time to after it, and the next one may begin before the command that this one led
to arrives. So commands wait in a queue until the clock reaches them, and the true motion is kept for a while.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from optics.kernels.arrays import FloatArray
from tracking.protocols import MirrorDriver, MirrorReport

STEP_S = 0.002
"""Between two looks at the mirrors; servos turn by a tenth of a degree meanwhile, and evenly but for where they start
and stop."""

KEPT_S = 0.25
"""Motion that is kept: longer than any exposure with its read-out."""


class TrueMirrors(MirrorDriver, Protocol):
    """Simulated mirrors: a driver that can be asked where the mirrors really are."""

    def true_q(self, time_s: float) -> FloatArray:
        """Pan and tilt at a time that is not before the last one asked for, radians, shape (2,)."""

    def snapshot(self) -> dict[str, Any]:
        """State, as JSON holds it."""

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a state."""


class MovingJoints(Protocol):
    """Joints whose true motion an exposure sees."""

    def advance(self, time_s: float) -> None:
        """Let the mirrors move up to a time; one that is over already changes nothing."""

    def q(self, times_s: FloatArray) -> FloatArray:
        """True pan and tilt at times until which the mirrors have moved, radians, shape (n, 2)."""


class TimedMirrors:
    """Mirrors with a queue of commands and a record of their motion.

    Parameters
    ----------
    mirrors : TrueMirrors
    """

    def __init__(self, mirrors: TrueMirrors):
        self.mirrors = mirrors
        self._waiting: list[tuple[float, FloatArray]] = []
        self._times_s = [0.0]
        self._q = [np.array(mirrors.true_q(0.0), dtype=np.float64)]

    def command(self, q: FloatArray, time_s: float) -> None:
        """Let a command arrive at a time, not before those that are on their way."""
        self._waiting.append((time_s, np.array(q, dtype=np.float64)))

    def advance(self, time_s: float) -> None:
        """Let the mirrors move up to a time; one that is over already changes nothing."""
        while self._waiting and self._waiting[0][0] <= time_s:
            arrival, q = self._waiting.pop(0)
            self._follow(arrival)
            self.mirrors.command(q, max(arrival, self._times_s[-1]))
        self._follow(time_s)

    def report(self, time_s: float) -> MirrorReport:
        """What the driver knows at a time."""
        self.advance(time_s)
        return self.mirrors.report(time_s)

    def q(self, times_s: FloatArray) -> FloatArray:
        """True pan and tilt at times until which the mirrors have moved, shape (n, 2); at rest before the dive."""
        record = np.array(self._q)
        return np.stack([np.interp(times_s, self._times_s, column) for column in record.T], axis=-1)

    def snapshot(self) -> dict[str, Any]:
        """State, as JSON holds it."""
        return {
            "mirrors": self.mirrors.snapshot(),
            "waiting": [[time, q.tolist()] for time, q in self._waiting],
            "times_s": list(self._times_s),
            "q": [q.tolist() for q in self._q],
        }

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a state."""
        self.mirrors.restore(snapshot["mirrors"])
        self._waiting = [(time, np.array(q)) for time, q in snapshot["waiting"]]
        self._times_s = list(snapshot["times_s"])
        self._q = [np.array(q) for q in snapshot["q"]]

    def _follow(self, time_s: float) -> None:
        last = self._times_s[-1]
        if time_s <= last:
            return
        for time in np.linspace(last, time_s, int(np.ceil((time_s - last) / STEP_S)) + 1)[1:].tolist():
            self._times_s.append(time)
            self._q.append(np.array(self.mirrors.true_q(time), dtype=np.float64))
        first = int(np.searchsorted(self._times_s, time_s - KEPT_S))
        del self._times_s[:first], self._q[:first]
