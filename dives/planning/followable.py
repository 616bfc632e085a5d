"""For how long a mirror could have had a target in view, had it known the target's path beforehand.

Where a target goes, joints of a given speed cannot always follow: past pan's end the mirror must turn round, and beside
the zenith it must turn faster than any servo. Dynamic programming (Bellman 1957) over a grid of poses finds the most
frames in which one that moves within its speeds shows the target, to within the grid's step.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import maximum_filter

from dives.metrics.frames import BoolArray
from optics.gaze.motion import JointSpeeds
from optics.kernels.arrays import FloatArray
from tracking.control.gaze_view import GazeView
from tracking.estimation.gimbal import Gimbal

STEP_S = 0.1
"""From one look at the target to the next."""

FINEST_DEG = 2.5
"""Of a joint, between two poses at most: a view is 18 degrees of gaze high, 9 of tilt."""


def longest_in_view_s(
    gimbal: Gimbal,
    view: GazeView,
    speeds: JointSpeeds,
    *,
    start: FloatArray,
    times_s: FloatArray,
    direction: FloatArray,
    available: BoolArray,
) -> float:
    """Most time in which a mirror can show a target, seconds.

    Parameters
    ----------
    gimbal : Gimbal
    view : GazeView
        What each pose shows.
    speeds : JointSpeeds
        That the joints keep to; how fast they speed up is not asked.
    start : array, shape (2,)
        Joint values at the first time, radians.
    times_s : array, shape (n,)
        Evenly rising.
    direction : array, shape (n, 3)
        Unit vectors from the gaze mirror's centre to the target, body frame.
    available : array, shape (n,)
        Whether anything shows it then.
    """
    if len(times_s) < 2:
        return 0.0
    lasts_s = float(times_s[1] - times_s[0])
    every = max(round(STEP_S / lasts_s), 1)
    there = np.array([gimbal.in_gimbal(each) for each in direction[::every]])
    axes, reach = zip(
        *(
            _nodes(gimbal.limits(joint), speed * every * lasts_s)
            for joint, speed in enumerate((speeds.pan, speeds.tilt))
        ),
        strict=True,
    )
    shown = view.shows(there, *axes) & available[::every]
    seconds = np.full(shown.shape[:2], -np.inf)
    seconds[tuple(np.abs(axis - angle).argmin() for axis, angle in zip(axes, gimbal.angles(start), strict=True))] = 0.0
    for index in range(shown.shape[2]):
        if index:
            seconds = maximum_filter(seconds, size=[2 * cells + 1 for cells in reach], mode="nearest")
        seconds += shown[:, :, index]
    return float(seconds.max()) * every * lasts_s


def _nodes(limits: tuple[float, float], step: float) -> tuple[FloatArray, int]:
    """Poses along a joint, radians, and how many of them it passes in one look of the target at most."""
    low, high = limits
    cells = math.ceil(step / math.radians(FINEST_DEG))
    return np.linspace(low, high, math.ceil((high - low) / (step / cells)) + 1), cells
