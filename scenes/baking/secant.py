"""Iterations that settle sooner: Anderson's method (1965, J. ACM 12, 547) with one step of memory.

In turbid water each iteration of scattering and reflecting changes half of what the one before did, all over alike.
Two iterations tell that share, and with it where it leads.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Fields = Sequence[NDArray[Any]]


class Secant:
    """What an iteration is best begun with, from what the last two were begun with and made of it."""

    def __init__(self) -> None:
        self._before: tuple[Fields, Fields] | None = None

    def following(self, begun: Fields, made: Fields) -> Fields:
        """What the next iteration begins with: several fields that change together.

        That mixture of what two iterations made whose changes cancel best, in the mean of their squares.
        """
        change = [m - b for b, m in zip(begun, made, strict=True)]
        before, self._before = self._before, (made, change)
        if before is None:
            return made
        last_made, last_change = before
        apart = [c - last for c, last in zip(change, last_change, strict=True)]
        scale = [1 / max(float(np.square(c, dtype=np.float64).sum()), 1e-300) for c in last_change]
        along = sum(s * float(np.vdot(c, a)) for s, c, a in zip(scale, change, apart, strict=True))
        length = sum(s * float(np.vdot(a, a)) for s, a in zip(scale, apart, strict=True))
        share = along / length if length > 0 else 0.0
        return [m - m.dtype.type(share) * (m - last) for m, last in zip(made, last_made, strict=True)]
