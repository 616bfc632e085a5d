"""How long and how well a mirror could have had a target in view, had it known the target's path beforehand.

Where a target goes, joints of a given speed cannot always follow: past pan's end the mirror must turn round, and beside
the zenith it must turn faster than any servo. Dynamic programming (Bellman 1957) over a grid of poses finds the most
frames in which one that moves within its speeds shows the target, to within the grid's step. Nor does every pose show
it in the middle: where pan ends, the nearest gaze passes it by.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import maximum_filter

from dives.dive import Dive
from dives.metrics.frames import BoolArray, Frames
from dives.metrics.search_time import gaze_view
from dives.planning.availability import Availability
from optics.gaze.motion import JointSpeeds
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from rigs import Rig
from tracking.control.gaze_view import GazeView
from tracking.estimation.gimbal import Gimbal
from tracking.perception.robot_view import RobotView

SERVO_SHARE = 0.8
"""Of the servos' highest speeds: what needs more of them need not be held."""

POSSIBLE_DEFINITIONS = {
    "possible_s": "longest that the gaze mirror could have shown the target's middle from the acquisition on, at"
    f" {SERVO_SHARE:.0%} of the servos' speeds and with the path known beforehand; None where it was never acquired",
    "possible_fraction": "that, of the time from the acquisition on; at least what was held, as past the hull's edge",
    "gaze_error_possible_rms_deg": "deg: root mean square of the gaze error of the nearest gaze within the joints'"
    " limits, in frames in which the target is held; None without one",
}

STEP_S = 0.1
"""From one look at the target to the next."""

FINEST_DEG = 2.5
"""Of a joint, between two poses at most: a view is 18 degrees of gaze high, 9 of tilt."""

PANS = 91
"""Between its ends at which the nearest gaze is sought, beside those from which the gaze is exact."""


def possible_metrics(
    dive: Dive, rig: Rig, robot_view: RobotView, frames: Frames, there: Availability
) -> dict[str, float | None]:
    """Everything of `POSSIBLE_DEFINITIONS`.

    Parameters
    ----------
    dive : Dive
    rig : Rig
        That it was dived with.
    robot_view : RobotView
        Where the crop shows the robot.
    frames : Frames
        Its log.
    there : Availability
        At the frames' times.
    """
    first = frames.acquired
    if first is None:
        return dict.fromkeys(POSSIBLE_DEFINITIONS)
    layout = Layout.from_rig(rig)
    gimbal = Gimbal(layout)
    possible_s = longest_in_view_s(
        gimbal,
        gaze_view(rig, dive.loop_variant(), robot_view),
        JointSpeeds.from_rig(rig).slowed(SERVO_SHARE),
        start=np.radians([frames.numbers[f"{joint}_true_deg"][first] for joint in ("q1", "q2")]),
        times_s=frames.time_s[first:],
        direction=there.direction[first:],
        available=there.available[first:],
    )
    held, lasts_s = frames.after_acquisition & frames.held, frames.lasts_s
    held_s = float(lasts_s[held].sum())
    least_deg = np.degrees(least_gaze_error(layout, there.direction[held], there.distance_m[held]))
    return {
        "possible_s": possible_s,
        "possible_fraction": min(max(possible_s, held_s) / float(lasts_s[first:].sum()), 1.0),
        "gaze_error_possible_rms_deg": float(np.sqrt(np.mean(least_deg**2))) if held.any() else None,
    }


def least_gaze_error(layout: Layout, direction: FloatArray, distance_m: FloatArray) -> FloatArray:
    """Least angle at the virtual camera between its axis and targets, shape (n,), radians.

    That camera is behind the gaze mirror, as far as the real one is from there over M1, on the axis of the gaze: seen
    from it a target is less off the axis than from the mirror.

    Parameters
    ----------
    layout : Layout
    direction : array, shape (n, 3)
        Unit vectors from the gaze mirror's centre, body frame.
    distance_m : array, shape (n,)
        Along them.
    """
    path = (layout.body_from_camera, layout.body_from_m1, layout.body_from_gimbal)
    camera, m1, m2 = (each.translation for each in path)
    behind_m = np.linalg.norm(camera - m1) + np.linalg.norm(m1 - m2)
    gimbal = Gimbal(layout)
    off = np.array([nearest_gaze(gimbal, each) for each in direction])
    return np.asarray(np.arctan2(distance_m * np.sin(off), behind_m + distance_m * np.cos(off)))


def nearest_gaze(gimbal: Gimbal, direction: FloatArray) -> float:
    """Angle from a direction, body frame, shape (3,), to the nearest gaze within the joints' limits, radians."""
    there = gimbal.in_gimbal(direction)
    lowest, highest = gimbal.limits(0)
    exact = np.arctan2(there[1], there[0]) + math.pi * np.arange(-4, 5)
    pans = np.concatenate([np.linspace(lowest, highest, PANS), exact[(exact >= lowest) & (exact <= highest)]])
    return float(gimbal.off_gaze(there[np.newaxis], pans).min())


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
    """Most time in which a mirror can show a target's middle, seconds.

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
    shown = (view.clearance(there, *axes) >= 0) & available[::every]
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
