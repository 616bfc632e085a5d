"""Which sweep of a search is next: of all, the one that gains most per second.

A sweep tilts by up to six steps, each a view less what the next has in common with it, while pan stands or goes on by
up to two: one up, the next down, they zigzag along the horizon. It is as fast as the servos are, unless too few images
show then what it passes. Each image that shows a cell of the directions within reach finds with the same probability
what is there. From where the mirror is, the next sweep is the one that finds the target with the largest probability,
divided by the time to get to its beginning and along it. Taking the best rate first is what is best of all for sweeps
that do not overlap and cost nothing to get to (Stone 1975, Theory of Optimal Search, 2.4). How likely the target is in
each cell is known anew when a sweep ends (`Belief`).
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from optics.gaze.motion import JointSpeeds, move_time
from optics.kernels.arrays import FloatArray
from tracking.control.belief import FOUND, Directions
from tracking.control.gaze_view import GazeView
from tracking.control.joint_paths import JointPath
from tracking.control.poses import pose_grid
from tracking.estimation.gimbal import Gimbal

ENDS = np.array([0.75, 1.0])
"""Of a step across and upwards, from one place in pan and in tilt at which sweeps begin and end to the next."""

BESIDE, ABOVE = 3, 6
"""Places in pan and in tilt by which a sweep goes on at most. With more in pan, slow servos miss what lies level; more
in tilt is as good as a sweep after the other, and four times as many of them are weighed."""

INSTANTS = 60
"""Of a sweep at which it is told what it shows: over the whole range of tilt 5 degrees of gaze apart."""

FINENESS = 4
"""Poses in a step, to which these instants are rounded."""

IMAGES = 2
"""That a sweep takes at least of what it passes: servos that turn the gaze past in one smear it, and give no second
look."""

ALIKE = 0.99
"""Of the largest rate, from which sweeps gain alike: then the one at the lower pan is next, not the one of rounding."""


class SearchPlan:
    """All sweeps, and what each shows.

    Parameters
    ----------
    gimbal : Gimbal
    view : GazeView
        What each pose shows.
    there : Directions
    step : array, shape (2,)
        Across and upwards, radians of gaze: a view, less what the next one is to have in common with it.
    speeds : JointSpeeds
        The servos'.
    interval_s : float
        From image to image.
    """

    def __init__(
        self,
        gimbal: Gimbal,
        view: GazeView,
        there: Directions,
        step: FloatArray,
        speeds: JointSpeeds,
        *,
        interval_s: float,
    ):
        self._gimbal, self._speeds = gimbal, speeds
        self._ends = _sweeps(*pose_grid(gimbal, *(ENDS * step / [1, 2]).tolist()))
        self._lasting_s = move_time(slowed(speeds, step, interval_s), *self._ends)
        found = _shown(gimbal, view, step, there, self._ends)
        found.data = 1 - (1 - FOUND) ** (found.data * np.repeat(self._lasting_s / interval_s, np.diff(found.indptr)))
        self._found = found.astype(np.float32)

    def next_from(self, q: FloatArray, probability: FloatArray) -> tuple[JointPath, int]:
        """Path from joint values `q` to the next sweep's nearer end and along it, and which sweep that is.

        `probability` is by cell, shape (n,).
        """
        ends = self._ends
        here = np.array(self._gimbal.angles(q))
        way_s = move_time(self._speeds, here, ends)
        rate = self._found @ probability.astype(np.float32) / (way_s.min(axis=0) + self._lasting_s)
        best = int((rate >= ALIKE * rate.max()).argmax())
        nearer = int(way_s[:, best].argmin())
        points = np.array([here, ends[nearer, best], ends[1 - nearer, best]])
        path = JointPath.timed(
            [self._gimbal.joint_values(*each) for each in points.tolist()],
            [0.0, float(way_s[nearer, best]), float(self._lasting_s[best])],
        )
        return path, best

    def found_by(self, sweep: int) -> FloatArray:
        """Probability that a sweep finds what is there, by cell, shape (n,)."""
        return np.asarray(self._found[[sweep]].toarray()[0], dtype=np.float64)


def slowed(speeds: JointSpeeds, step: FloatArray, interval_s: float) -> JointSpeeds:
    """Speeds of sweeps: the servos', or less where these would take fewer than `IMAGES` of what they pass."""
    pan, tilt = np.minimum([speeds.pan, speeds.tilt], step / [1, 2] / interval_s / IMAGES)
    return JointSpeeds(pan=float(pan), tilt=float(tilt))


def _sweeps(pan: FloatArray, tilt: FloatArray) -> FloatArray:
    """Both ends of all sweeps, shape (2, n, 2): at any two places in tilt, and in pan at two that are near."""
    one, other = np.triu_indices(len(pan) * len(tilt), k=1)
    places = np.stack(np.meshgrid(pan, tilt, indexing="ij"), axis=-1).reshape(-1, 2)
    beside = other // len(tilt) - one // len(tilt) <= BESIDE
    above = abs(other % len(tilt) - one % len(tilt)) <= ABOVE
    return places[[one[beside & above], other[beside & above]]]


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
