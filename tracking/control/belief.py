"""Where a target that is searched for may be: a probability for each cell of the directions within reach.

At first it may be anywhere within reach, but is more often level with the robot than above or below it, since who is
followed swims, or is held, at its depth, and rather ahead than behind. An image that shows a cell without the target
takes probability from it, as Bayes' rule says. Meanwhile a target that does not stand still moves on, to cells nearby:
its probability spreads, at length to where targets are often. So what was looked at is worth another look after some
time, where a target was lost is likelier than the other side of the robot, and what is known stays known while
something else is followed. Of a target that was lost speed and height are known: one that goes round the robot in ten
seconds may soon be anywhere about as high as it was, and one that hardly moves is where it was. Images take nothing
where something may hide it (`tracking.estimation.lost_places`).

What was followed and dropped may be the target for all that, as likely as its odds say. It is passed by for some time:
images tell nothing of its place meanwhile, and no sweep is made for it; one that moves is found again beside it.

It spreads by hops that would leave the lasting probability as it is: a cell nearby is drawn evenly by solid angle, and
hopped to with the ratio of the densities there and here, at most 1 (Metropolis et al. 1953, J. Chem. Phys. 21, 1087).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from optics.kernels.arrays import FloatArray
from tracking.control.gaze_view import LEAST_SHOWN, GazeView
from tracking.control.poses import pose_grid
from tracking.estimation.bearing import Bearing
from tracking.estimation.clutter import ClutterPlace
from tracking.estimation.gimbal import Gimbal
from tracking.estimation.lost_places import LostPlaces, in_the_open

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
"""Which make 38 degrees in 5 s in the mean square: the arena's targets go 41, those from point to point 57. Of a target
whose speed is not known."""

TURNED_S = 3.0
"""After which the velocity of one whose speed v is known has changed: its mean square way grows by 2 v^2 `TURNED_S` per
second (Taylor 1921, Proc. London Math. Soc. s2-20, 196). Of 1.5, 3 and 6 s this makes truest where targets are 3 to
10 s after any time on 120 of the arena's paths (seeds 100 to 219). The mean log likelihood of that is 0.18 larger with
it than with `HOPS_PER_S` for all; above 15 degrees/s by 0.45, where theirs is smaller than if nothing were known."""

MOST_HOPS_PER_S = 50.0
"""Those of 25 degrees/s: a second of them leaves as little as one of faster targets."""

LOST_LEVEL_DEG = 12.0
"""Standard deviation of elevation about that at which a target was lost: on the same paths it goes 7 degrees up or down
in 3 s and 9 in 10 s, from point to point 8 and 11, and 8 to 15 are about as true. The log likelihood grows by 0.2."""

STILL_OR_MOVING = 0.5, 0.5
"""Probability of a target that stands still, and of one that moves. If all moved, what is likeliest would be looked at
again and again, and never what is far above and below."""

LOST_STILL_OR_MOVING = 0.25, 0.75
"""The same of one that was lost; truest on the same paths of 0.1, 0.25 and 0.5."""

MOST_HOPS = 0.5
"""In one step of the spreading."""

ELSEWHERE = 0.1
"""Probability that a target that was lost has not gone where it can have gone as it moved; truer there than 0.2."""


@dataclass(frozen=True, kw_only=True)
class Directions:
    """Cells of the sphere within reach.

    Attributes
    ----------
    direction : array, shape (n, 3)
        Unit vectors, gimbal's frame.
    solid_angle : array, shape (n,)
    elevation : array, shape (n,)
        Above the horizon of the body frame, radians.
    probability : array, shape (n,)
        That the target is there, given that it is within reach, at first; they add up to 1.
    """

    direction: FloatArray
    solid_angle: FloatArray
    elevation: FloatArray
    probability: FloatArray


@dataclass(frozen=True, kw_only=True)
class Spreading:
    """How one that moves spreads.

    Attributes
    ----------
    hops_per_s : float
    elevation, deviation : float
        Mean and standard deviation of its elevation after a long time, radians; what is ahead is no likelier then.
    """

    hops_per_s: float = HOPS_PER_S
    elevation: float = 0.0
    deviation: float = math.radians(LEVEL_DEG)

    @classmethod
    def of_lost(cls, bearing: Bearing) -> Spreading:
        """Of one that was last seen at a bearing, body frame."""
        hops_per_s = 4 * TURNED_S * (float(np.linalg.norm(bearing.rate)) / math.radians(HOP_DEG)) ** 2
        return cls(
            hops_per_s=min(hops_per_s, MOST_HOPS_PER_S),
            elevation=math.asin(min(max(float(bearing.direction[2]), -1.0), 1.0)),
            deviation=math.radians(LOST_LEVEL_DEG),
        )

    def density(self, elevation: FloatArray) -> FloatArray:
        """Of where it is after a long time by elevation, radians, not normalised."""
        return np.asarray(ANYWHERE + np.exp(-0.5 * ((elevation - self.elevation) / self.deviation) ** 2))


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
    ahead = 1 + AHEAD * np.exp(-0.5 * (around[within] / math.radians(AHEAD_DEG)) ** 2)
    probability = Spreading().density(up[within]) * ahead * solid_angle
    return Directions(
        direction=direction[within],
        solid_angle=solid_angle,
        elevation=up[within],
        probability=probability / probability.sum(),
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
    state : array, shape (2, k, n)
        Of one that stands still in each cell, and of one that moves, by what may hide it; they add up to 1.
    missed : array, shape (n,)
        Probability that the images since the last sweep have missed it if it is there.
    """

    def __init__(self, there: Directions, view: GazeView):
        self._there, self._view = there, view
        near = there.direction @ there.direction.T > math.cos(math.radians(HOP_DEG))
        self._near = np.nonzero(near & ~np.eye(len(near), dtype=bool))
        self._spread(Spreading())
        self.state: FloatArray = np.outer(STILL_OR_MOVING, there.probability)[:, np.newaxis]
        self.missed: FloatArray = np.ones(len(there.direction))
        self._open: NDArray[np.bool_] = np.ones((1, len(there.direction)), dtype=bool)
        # Told with each image before it is asked for, and so in no snapshot.
        self._passed_by: NDArray[np.bool_] = np.zeros(len(there.direction), dtype=bool)

    @property
    def probability(self) -> FloatArray:
        """That the target is there, shape (n,); they add up to 1."""
        return np.asarray(self.state.sum(axis=(0, 1)))

    @property
    def probability_in_the_open(self) -> FloatArray:
        """That the target is there, nothing hides it, and it would not be passed by, shape (n,)."""
        return np.asarray((self.state * (self._open & ~self._passed_by)).sum(axis=(0, 1)))

    def note_dropped(self, direction: FloatArray, probability: float) -> None:
        """What was followed in a direction, unit vector, shape (3,), was dropped, and is the target with a probability.

        It counts as one that moves: what stands still is passed by.
        """
        self.state *= 1 - probability
        self.state[1, 0, (self._there.direction @ direction).argmax()] += probability

    def note_unseen(self, q: FloatArray, clutter: Iterable[ClutterPlace] = ()) -> None:
        """Take in an image taken at joint values `q` that did not show the target, or showed it among the clutter."""
        missed = 1.0 - FOUND * self._view.shown_at(q, self._there.direction).astype(np.float64)
        self._passed_by[:] = False
        for place in clutter:
            within = place.within_rad + math.radians(CELL_DEG) / 2
            self._passed_by |= self._there.direction @ place.direction > math.cos(within)
        self.missed *= np.where(self._passed_by, 1.0, missed)
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
        left = self.state * np.where(self._open & ~self._passed_by, missed, 1.0)
        self.state = left / left.sum()

    def pass_time(self, seconds: float) -> None:
        """A target that moves moves on."""
        hops = self._spreading.hops_per_s * seconds
        steps = math.ceil(hops / MOST_HOPS)
        # By cell first, which is the order of the sparse product.
        moving = np.ascontiguousarray(self.state[1].T)
        for _ in range(steps):
            moving += hops / steps * (self._hops @ moving)
        self.state[1] = moving.T

    def note_lost(self, places: LostPlaces) -> None:
        """It was lost, and can have gone to some places; one beyond reach counts where it comes within reach."""
        nearest = (places.direction @ self._there.direction.T).argmax(axis=1)
        radii, hidden_by = np.unique(np.append(0.0, places.radius), return_inverse=True)
        lost = np.zeros((len(radii), len(self._there.direction)))
        np.add.at(lost, (hidden_by[1:], nearest), places.weight / places.weight.sum())
        elsewhere = self.state.sum(axis=1)
        self.state = (1 - ELSEWHERE) * np.multiply.outer(LOST_STILL_OR_MOVING, lost)
        self.state[:, 0] += ELSEWHERE * elsewhere
        self._open = in_the_open(self._there.direction, places.hidden_at, radii[:, np.newaxis])
        self._spread(Spreading.of_lost(places.bearing))

    def _spread(self, spreading: Spreading) -> None:
        """Spread so from now on: by how much each probability grows a hop, shape (n, n), times all of them."""
        to, of = self._near
        density = spreading.density(self._there.elevation)
        disc = 2 * math.pi * (1 - math.cos(math.radians(HOP_DEG)))
        rate = self._there.solid_angle[to] / disc * np.minimum(density[to] / density[of], 1.0)
        size = len(density)
        leaving = np.bincount(of, rate, minlength=size)
        places = np.append(to, np.arange(size)), np.append(of, np.arange(size))
        self._spreading = spreading
        self._hops = csr_array((np.concatenate([rate, -leaving]), places), shape=(size, size))

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""
        return {
            "state": self.state.tolist(),
            "missed": self.missed.tolist(),
            "open": self._open.tolist(),
            "spreading": asdict(self._spreading),
        }

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot."""
        self.state, self.missed = np.array(snapshot["state"]), np.array(snapshot["missed"])
        self._open = np.array(snapshot["open"])
        self._spread(Spreading(**snapshot["spreading"]))
