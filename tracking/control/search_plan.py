"""A search that looks where a target is likely first: of all sweeps, next the one that gains most per second.

What is searched for may be anywhere within reach, but is more often level with the robot than above or below it, since
who is followed swims, or is held, at its depth, and rather ahead than behind. The sphere of directions is divided into
cells with that probability. A sweep tilts while pan stands, or goes on by up to two views: one up, the next down, they
zigzag along the horizon. It is as fast as the servos are, unless too few images show then what it passes. Each image
that shows a cell finds with the same probability what is there, and what it does not find stays where it is. From where
the mirror is, the next sweep is the one that finds with the largest probability, divided by the time to get to its
beginning and along it, until everything within reach is seen. Taking the best rate first is what is best of all for
sweeps that do not overlap and cost nothing to get to (Stone 1975, Theory of Optimal Search, 2.4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from optics.gaze.motion import JointSpeeds, move_time
from optics.kernels.arrays import FloatArray
from tracking.control.gaze_view import LEAST_SHOWN, GazeView
from tracking.control.joint_paths import JointPath
from tracking.estimation.gimbal import Gimbal

LEVEL_DEG = 20.0
"""Standard deviation of a target's elevation: half a metre up or down at 1.5 m."""

ANYWHERE = 0.05
"""Of the probability at the horizon, what is left far above and below."""

AHEAD, AHEAD_DEG = 0.5, 45.0
"""By how much more likely it is to be ahead than abeam or behind, and the standard deviation of azimuth there: a robot
is turned to what it works with, and a search that comes round to it late is a nuisance."""

CELL_DEG = 6.0
"""Of the directions; a view is three or four of them wide."""

ENDS = np.array([0.75, 1.0])
"""Of a step across and upwards, from one place in pan and in tilt at which sweeps begin and end to the next."""

BESIDE = 3
"""Places in pan by which a sweep goes on at most: two steps. With more, slow servos miss what lies level."""

INSTANTS = 60
"""Of a sweep at which it is told what it shows: over the whole range of tilt 5 degrees of gaze apart."""

FINENESS = 4
"""Poses in a step, to which these instants are rounded."""

IMAGES = 2
"""That a sweep takes at least of what it passes: servos that turn the gaze past in one smear it, and give no second
look."""

FOUND = 0.5
"""Probability that an image in which the target is whole finds it: of 55 such images of the arena's searches (seeds 0
to 7 and 20 to 27) the detector gave 31 the odds that acquire a target."""

LOOKED_AT = 0.2
"""Probability of finding what is in a cell, from which a sweep has looked at it."""

ALIKE = 0.99
"""Of the largest rate, from which sweeps gain alike: then the one at the lower pan is next, not the one of rounding."""

LEFT_OUT = 0.01
"""Of the solid angle within reach, what may be left unseen: cells at the limits whose middles are just beyond."""


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
        The same once it was seen elsewhere, or not found: what is ahead is no likelier then.
    """

    direction: FloatArray
    solid_angle: FloatArray
    probability: FloatArray
    probability_later: FloatArray


@dataclass(frozen=True, kw_only=True)
class _Sweeps:
    """Both ends, shape (2, n, 2), time from one to the other, (n,), and how likely each finds what is in a cell."""

    ends: FloatArray
    lasting_s: FloatArray
    found: csr_array


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


def likely_paths(
    gimbal: Gimbal, view: GazeView, step: FloatArray, speeds: JointSpeeds, interval_s: float
) -> tuple[JointPath, JointPath]:
    """Searches of all that is within reach, likely places first, from the middle of the joints' ranges.

    The first one, and the one of every other (`Directions.probability`, `probability_later`).

    Parameters
    ----------
    gimbal : Gimbal
    view : GazeView
        What each pose shows.
    step : array, shape (2,)
        Across and upwards, radians of gaze: a view, less what the next one is to have in common with it.
    speeds : JointSpeeds
        The servos'.
    interval_s : float
        From image to image.
    """
    there = likely_directions(gimbal, view)
    ends = _sweeps(*pose_grid(gimbal, *(ENDS * step / [1, 2]).tolist()))
    lasting_s = move_time(slowed(speeds, step, interval_s), *ends)
    found = _shown(gimbal, view, step, there, ends)
    found.data = 1 - (1 - FOUND) ** (found.data * np.repeat(lasting_s / interval_s, np.diff(found.indptr)))
    sweeps = _Sweeps(ends=ends, lasting_s=lasting_s, found=found)
    first, later = (
        _best_rates_first(gimbal, speeds, sweeps, there.solid_angle, each)
        for each in (there.probability, there.probability_later)
    )
    return first, later


def first_seen_s(path: JointPath, there: Directions, view: GazeView, every_s: float = 0.05) -> FloatArray:
    """When a path first has each direction in the view, seconds, shape (n,); infinite where never."""
    times_s = np.arange(0.0, path.duration_s + every_s, every_s)
    first = np.full(len(there.probability), np.inf)
    for time_s in times_s[::-1].tolist():
        first[view.shows_at(path.at(time_s), there.direction)] = time_s
    return first


def in_view(gimbal: Gimbal, q: FloatArray, direction: FloatArray, view: FloatArray) -> NDArray[np.bool_]:
    """Which unit vectors, gimbal's frame, shape (n, 3), lie in the view at joint values, shape (n,)."""
    pan, tilt = gimbal.angles(q)
    return np.asarray(seen_from(direction, np.array([pan]), np.array([tilt]), view)[0, 0])


def slowed(speeds: JointSpeeds, step: FloatArray, interval_s: float) -> JointSpeeds:
    """Speeds of sweeps: the servos', or less where these would take fewer than `IMAGES` of what they pass."""
    pan, tilt = np.minimum([speeds.pan, speeds.tilt], step / [1, 2] / interval_s / IMAGES)
    return JointSpeeds(pan=float(pan), tilt=float(tilt))


def _angles(gimbal: Gimbal, q: FloatArray) -> FloatArray:
    return np.array(gimbal.angles(q))


def pose_grid(gimbal: Gimbal, pan_step: float, tilt_step: float) -> tuple[FloatArray, FloatArray]:
    """Pan and tilt in the gimbal's frame over their ranges, at most a step apart."""
    return tuple(
        np.linspace(low, high, math.ceil((high - low) / step) + 1)
        for (low, high), step in ((gimbal.limits(0), pan_step), (gimbal.limits(1), tilt_step))
    )  # type: ignore[return-value]


def seen_from(direction: FloatArray, pan: FloatArray, tilt: FloatArray, view: FloatArray) -> NDArray[np.bool_]:
    """Which directions lie in the view, across and upwards, shape (pans, tilts, n)."""
    cosine, sine = np.cos(pan)[:, np.newaxis], np.sin(pan)[:, np.newaxis]
    x, y, z = direction.T
    forward, aside = cosine * x + sine * y, cosine * y - sine * x
    cosine, sine = np.cos(2 * tilt)[:, np.newaxis], np.sin(2 * tilt)[:, np.newaxis]
    ahead = cosine * forward[:, np.newaxis] + sine * z
    up = cosine * z - sine * forward[:, np.newaxis]
    across, upwards = np.tan(view / 2)
    return np.asarray((np.abs(aside)[:, np.newaxis] <= across * ahead) & (np.abs(up) <= upwards * ahead))


def _best_rates_first(
    gimbal: Gimbal, speeds: JointSpeeds, sweeps: _Sweeps, solid_angle: FloatArray, probability: FloatArray
) -> JointPath:
    """Sweeps one after the other, the one that finds most per second next, until all cells were looked at."""
    ends, lasting_s, found = sweeps.ends, sweeps.lasting_s, sweeps.found
    points, taken_s = [_angles(gimbal, gimbal.middle)], [0.0]
    unseen, left = found.max(axis=0).toarray().ravel() >= LOOKED_AT, probability.copy()
    left_out = LEFT_OUT * solid_angle[unseen].sum()
    while solid_angle[unseen].sum() > left_out:
        way_s = move_time(speeds, points[-1], ends)
        rate = found @ left / (way_s.min(axis=0) + lasting_s)
        best = int((rate >= ALIKE * rate.max()).argmax())
        nearer = int(way_s[:, best].argmin())
        points += [ends[nearer, best], ends[1 - nearer, best]]
        taken_s += [float(way_s[nearer, best]), float(lasting_s[best])]
        cells = slice(*found.indptr[best : best + 2])
        unseen[found.indices[cells][found.data[cells] >= LOOKED_AT]] = False
        left[found.indices[cells]] *= 1 - found.data[cells]
    return JointPath.timed([gimbal.joint_values(*each) for each in np.array(points).tolist()], taken_s)


def _sweeps(pan: FloatArray, tilt: FloatArray) -> FloatArray:
    """Both ends of all sweeps, shape (2, n, 2): at any two places in tilt, and in pan at two that are near."""
    one, other = np.triu_indices(len(pan) * len(tilt), k=1)
    places = np.stack(np.meshgrid(pan, tilt, indexing="ij"), axis=-1).reshape(-1, 2)
    beside = other // len(tilt) - one // len(tilt) <= BESIDE
    return places[[one[beside], other[beside]]]


def _shown(gimbal: Gimbal, view: GazeView, step: FloatArray, there: Directions, ends: FloatArray) -> csr_array:
    """Share of a sweep's time in which it shows a cell, shape (sweeps, cells)."""
    pan, tilt = pose_grid(gimbal, *(step / [1, 2] / FINENESS).tolist())
    shows = csr_array(view.shown(there.direction, pan, tilt).reshape(len(pan) * len(tilt), -1))
    passed = np.linspace(ends[0], ends[1], INSTANTS, axis=-1)
    nearest = [
        np.interp(passed[:, joint], each, np.arange(len(each))).round().astype(np.int32)
        for joint, each in enumerate((pan, tilt))
    ]
    poses = nearest[0] * len(tilt) + nearest[1]
    rows = np.arange(0, poses.size + 1, INSTANTS, dtype=np.int32)
    share = np.full(poses.size, 1 / INSTANTS)
    return csr_array((share, poses.ravel(), rows), shape=(len(poses), len(pan) * len(tilt))) @ shows
