"""The smallest gap over a box of joint values, with a proven lower bound.

A gap between two bodies changes by no more than any of their points travels. When a joint turns by dq, a
point at the distance r from its axis goes r dq at most, so over a cell with half-widths h the gap is at least that at
the cell's middle less the sum of r h. Cells are halved, the least promising first, until the bound meets the smallest
gap that was seen (Piyavskii's search for Lipschitz functions).
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from optics.kernels.arrays import FloatArray

GapFunction = Callable[[FloatArray], float]
"""Joint values, shape (k,), radians, to the gap there, millimetres; 0 where the bodies intersect."""

CLOSE_MM = 0.1
"""Bound and smallest gap may differ by this much, unless a limit lies between them."""
CLOSE_FRACTION = 0.35
"""Of a gap that is known to be on the good side of its limit: its exact size does not matter then."""
CLOSEST_MM = 0.01
"""With a limit between them they may still differ by this much; a printer does not resolve it."""


@dataclass(frozen=True, kw_only=True)
class Cell:
    """Box of joint values: its middle and half-widths, shape (k,) each, radians."""

    middle: FloatArray
    half: FloatArray

    @classmethod
    def between(cls, low: FloatArray, high: FloatArray) -> Cell:
        """Box by its limits."""
        return cls(middle=(low + high) / 2, half=(high - low) / 2)

    def halves(self, reach_mm: FloatArray) -> Iterator[Cell]:
        """Two cells, cut across the joint that moves the body furthest."""
        axis = int(np.argmax(self.half * reach_mm))
        half = self.half.copy()
        half[axis] /= 2
        for side in (-1, 1):
            middle = self.middle.copy()
            middle[axis] += side * half[axis]
            yield Cell(middle=middle, half=half)


@dataclass(frozen=True, kw_only=True)
class SmallestGap:
    """Smallest gap over a box of joint values.

    Attributes
    ----------
    gap_mm : float
        Smallest gap that was seen, at `q`.
    bound_mm : float
        No gap in the box is smaller than this.
    q : array, shape (k,)
        Joint values where it was seen, radians.
    poses : int
        How many gaps were measured.
    """

    gap_mm: float
    bound_mm: float
    q: FloatArray
    poses: int


def smallest_gap(gap: GapFunction, box: Cell, reach_mm: FloatArray, limit_mm: float, wanted_mm: float) -> SmallestGap:
    """Find the smallest gap over a box of joint values.

    Parameters
    ----------
    gap : callable
        Gap at given joint values.
    box : Cell
        Where to look.
    reach_mm : array, shape (k,)
        Largest distance of a moving point from each joint's axis, millimetres; 0 for a joint that does not matter.
    limit_mm : float
        What the gap will be held against: the search goes on until it is known on which side of it the gap is.
    wanted_mm : float
        What it would be good to prove, at least the limit: the search goes on for it, but less far.

    Returns
    -------
    SmallestGap
        Bound and gap differ by 0.1 mm or a third of the gap at most. Bodies that intersect end the search at once, with
        both at 0.
    """
    order = itertools.count()
    poses = 1
    best, where = gap(box.middle), box.middle
    heap = [(best - float(box.half @ reach_mm), next(order), box)]
    while best > 0:
        bound, _, cell = heap[0]
        if bound >= best - _close_enough(bound, best, limit_mm, wanted_mm):
            return SmallestGap(gap_mm=best, bound_mm=max(bound, 0.0), q=where, poses=poses)
        heapq.heappop(heap)
        for part in cell.halves(reach_mm):
            value = gap(part.middle)
            poses += 1
            if value < best:
                best, where = value, part.middle
            # What holds for the whole cell holds for its halves.
            lower = max(bound, value - float(part.half @ reach_mm))
            heapq.heappush(heap, (lower, next(order), part))
    return SmallestGap(gap_mm=0.0, bound_mm=0.0, q=where, poses=poses)


def _close_enough(bound: float, best: float, limit_mm: float, wanted_mm: float) -> float:
    """How far bound and smallest gap may be apart, millimetres."""
    if bound < limit_mm <= best:
        return CLOSEST_MM
    if bound < wanted_mm <= best:
        return CLOSE_MM
    return max(CLOSE_MM, CLOSE_FRACTION * best)
