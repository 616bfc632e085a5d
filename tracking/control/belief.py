"""Where a target that is searched for may be: a probability for each cell of the directions within reach.

At first it may be anywhere within reach, but is more often level with the robot than above or below it, since who is
followed swims, or is held, at its depth, and rather ahead than behind. An image that shows a cell without the target
takes probability from it, as Bayes' rule says. Meanwhile a target that does not stand still moves on, to cells nearby:
its probability spreads, at length to where targets are often. So what was looked at is worth another look after some
time, where a target was lost is likelier than the other side of the robot, and what is known stays known while
something else is followed.

It spreads by hops that would leave the lasting probability as it is: a cell nearby is drawn evenly by solid angle, and
hopped to with the ratio of the densities there and here, at most 1 (Metropolis et al. 1953, J. Chem. Phys. 21, 1087).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from optics.kernels.arrays import FloatArray
from tracking.control.gaze_view import LEAST_SHOWN, GazeView
from tracking.control.poses import pose_grid
from tracking.estimation.gimbal import Gimbal

LEVEL_DEG = 20.0
"""Standard deviation of a target's elevation: half a metre up or down at 1.5 m."""

ANYWHERE = 0.05
"""Of the probability at the horizon, what is left far above and below."""

AHEAD, AHEAD_DEG = 0.5, 45.0
"""By how much more likely it is to be ahead than abeam or behind, and the standard deviation of azimuth there: a robot
is turned to what it works with, and a search that comes round to it late is a nuisance."""

CELL_DEG = 7.5
"""Of the directions; a view is three of them wide."""

FOUND = 0.5
"""Probability that an image in which the target is whole finds it: of 55 such images of the arena's searches (seeds 0
to 7 and 20 to 27) the detector gave 31 the odds that acquire a target."""

HOP_DEG = 12.0
"""A hop's length at most, and 0.71 of it in the mean square."""

HOPS_PER_S = 4.0
"""Which make 38 degrees in 5 s in the mean square: the arena's targets go 41, those from point to point 57."""

STILL_OR_MOVING = 0.5, 0.5
"""Probability of a target that stands still, and of one that moves. If all moved, what is likeliest would be looked at
again and again, and never what is far above and below."""

MOST_HOPS = 0.5
"""In one step of the spreading."""

ELSEWHERE = 0.2
"""Probability that a target that was lost has not gone where it can have gone as it moved."""


@dataclass(frozen=True, kw_only=True)
class Directions:
    """Cells of the sphere within reach.

    Attributes
    ----------
    direction : array, shape (n, 3)
        Unit vectors, gimbal's frame.
    solid_angle : array, shape (n,)
    probability : array, shape (n,)
        That the target is there, given that it is within reach, at first; they add up to 1.
    probability_later : array, shape (n,)
        The same after a long time, of which nothing is known: what is ahead is no likelier then.
    """

    direction: FloatArray
    solid_angle: FloatArray
    probability: FloatArray
    probability_later: FloatArray


def likely_directions(gimbal: Gimbal, view: GazeView) -> Directions:
    """Where a target can be: cells that some pose within the limits shows."""
    cell = math.radians(CELL_DEG)
    elevation = np.arange(-math.pi / 2 + cell / 2, math.pi / 2, cell)
    azimuth = np.arange(-math.pi + cell / 2, math.pi, cell)
    up, around = (each.ravel() for each in np.meshgrid(elevation, azimuth, indexing="ij"))
    body = np.stack([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)], axis=-1)
    direction = gimbal.in_gimbal(body)
    within = view.shown(direction, *pose_grid(gimbal, cell / 2, cell / 4)).max(axis=(0, 1)) >= LEAST_SHOWN
    solid_angle = np.cos(up)[within] * cell * cell
    later = (ANYWHERE + np.exp(-0.5 * (up[within] / math.radians(LEVEL_DEG)) ** 2)) * solid_angle
    first = later * (1 + AHEAD * np.exp(-0.5 * (around[within] / math.radians(AHEAD_DEG)) ** 2))
    return Directions(
        direction=direction[within],
        solid_angle=solid_angle,
        probability=first / first.sum(),
        probability_later=later / later.sum(),
    )


class Belief:
    """Probability of where the target is, by cell, and of whether it stands still or moves.

    Parameters
    ----------
    there : Directions
    view : GazeView
        What each pose shows.

    Attributes
    ----------
    state : array, shape (2, n)
        Of one that stands still in each cell, and of one that moves; they add up to 1.
    missed : array, shape (n,)
        Probability that the images since the last sweep have missed it if it is there.
    """

    def __init__(self, there: Directions, view: GazeView):
        self._direction, self._view = there.direction, view
        self._hops = _hops(there)
        self.state: FloatArray = np.outer(STILL_OR_MOVING, there.probability)
        self.missed: FloatArray = np.ones(len(there.direction))

    @property
    def probability(self) -> FloatArray:
        """That the target is there, shape (n,); they add up to 1."""
        return np.asarray(self.state.sum(axis=0))

    def note_unseen(self, q: FloatArray) -> None:
        """Take in an image taken at joint values `q` that did not show the target."""
        missed = 1.0 - FOUND * self._view.shown_at(q, self._direction).astype(np.float64)
        self.missed *= missed
        self._count(missed)

    def note_swept(self, found: FloatArray) -> None:
        """A sweep has ended that was to find what is there with a probability, shape (n,).

        Where the images missed more than that the sweep does not show what it is said to: a mirror that lags behind
        turns before it is at the sweep's end, and between two bars a hair's breadth decides. It would be swept again
        and again.
        """
        self._count(np.minimum((1.0 - found) / self.missed, 1.0))
        self.missed[:] = 1

    def _count(self, missed: FloatArray) -> None:
        """Bayes' rule for something that was not found where it is missed with a probability, shape (n,)."""
        left = self.state * missed
        self.state = left / left.sum()

    def pass_time(self, seconds: float) -> None:
        """A target that moves moves on."""
        hops = HOPS_PER_S * seconds
        steps = math.ceil(hops / MOST_HOPS)
        for _ in range(steps):
            self.state[1] += hops / steps * (self._hops @ self.state[1])

    def note_places(self, places: FloatArray, weights: FloatArray) -> None:
        """It was lost, and can have gone to places, unit vectors, gimbal's frame, shape (n, 3), weights (n,).

        One beyond reach counts where it comes within reach.
        """
        nearest = (places @ self._direction.T).argmax(axis=1)
        there = np.bincount(nearest, weights / weights.sum(), minlength=len(self._direction))
        self.state = ELSEWHERE * self.state + (1 - ELSEWHERE) * np.outer(STILL_OR_MOVING, there)


def _hops(there: Directions) -> csr_array:
    """By how much each probability grows a hop, shape (n, n), times all of them."""
    near = there.direction @ there.direction.T > math.cos(math.radians(HOP_DEG))
    to, of = np.nonzero(near & ~np.eye(len(near), dtype=bool))
    density = there.probability_later / there.solid_angle
    disc = 2 * math.pi * (1 - math.cos(math.radians(HOP_DEG)))
    rate = there.solid_angle[to] / disc * np.minimum(density[to] / density[of], 1.0)
    size = len(density)
    leaving = np.bincount(of, rate, minlength=size)
    return csr_array(
        (np.concatenate([rate, -leaving]), (np.append(to, np.arange(size)), np.append(of, np.arange(size)))),
        shape=(size, size),
    )
