"""Control latency, measured from the log: how long after the command the joint, and after the target the gaze."""

from __future__ import annotations

import numpy as np

from dives.metrics.frames import Frames, unit_vectors
from dives.metrics.holding import runs
from optics.kernels.arrays import FloatArray

LAGS_S = (-0.5, 2.0)
"""Where a lag is looked for. A negative one leads: a prediction can."""

LEAST_MOTION_DEG = 1.0
"""What hardly moves says nothing of time."""

LATENCY_DEFINITIONS = {
    "command_to_joint_lag_q1_s": "shift in time at which the commanded pan fits the true one best",
    "command_to_joint_lag_q2_s": "the same for tilt",
    "target_to_gaze_lag_s": "shift in time at which the direction to the target fits the true optical axis best: for"
    " unit vectors the peak of their cross-correlation",
}


def latency_metrics(frames: Frames) -> dict[str, object]:
    """Everything of `LATENCY_DEFINITIONS`, over the longest run of frames in which the loop follows the target.

    None when there is no such run, when nothing moves by more than `LEAST_MOTION_DEG` in it, or when the best shift
    lies on the edge of `LAGS_S`.
    """
    numbers = frames.numbers
    followed = runs(frames.following & frames.after_acquisition)
    first, end = max(followed, key=lambda run: run[1] - run[0], default=(0, 0))
    part = slice(first, end)
    time_s = frames.time_s[part]
    target, gaze = (
        np.degrees(unit_vectors(numbers[f"{name}_azimuth_deg"][part], numbers[f"{name}_elevation_deg"][part]))
        for name in ("true", "gaze")
    )
    return {
        **{
            f"command_to_joint_lag_q{joint}_s": lag_s(
                time_s,
                numbers[f"q{joint}_command_deg"][part, np.newaxis],
                numbers[f"q{joint}_true_deg"][part, np.newaxis],
            )
            for joint in (1, 2)
        },
        "target_to_gaze_lag_s": lag_s(time_s, target, gaze),
    }


def lag_s(time_s: FloatArray, leader_deg: FloatArray, follower_deg: FloatArray) -> float | None:
    """Shift in time by which a follower is behind its leader: the one with the least squared difference.

    Parameters
    ----------
    time_s : array, shape (n,)
        Rising; need not be even.
    leader_deg, follower_deg : arrays, shape (n, k)
        Vectors of unit length differ least where their cross-correlation peaks. Rows with nan do not count.

    Returns
    -------
    float or None
        To a fraction of a frame, from the parabola through the least difference and its neighbours: exact for a steady
        motion, and good to the square of the phase per frame for a swing. None when it cannot be told.
    """
    usable = np.isfinite(leader_deg).all(axis=1) & np.isfinite(follower_deg).all(axis=1)
    if usable.sum() < 3 or np.ptp(leader_deg[usable], axis=0).max() < LEAST_MOTION_DEG:
        return None
    step_s = float(np.median(np.diff(time_s[usable])))
    even_s = np.arange(time_s[usable][0], time_s[usable][-1] + 0.5 * step_s, step_s)
    leader, follower = (
        np.stack([np.interp(even_s, time_s[usable], column) for column in signal[usable].T], axis=-1)
        for signal in (leader_deg, follower_deg)
    )
    # A third of the frames at most is shifted out, so that every difference stands on most of the motion.
    most = (len(even_s) - 1) // 3
    shifts = np.arange(max(round(LAGS_S[0] / step_s), -most), min(round(LAGS_S[1] / step_s), most) + 1)
    differences = np.array([_difference(leader, follower, int(shift)) for shift in shifts])
    best = int(differences.argmin())
    if best in (0, len(shifts) - 1):
        return None
    before, least, after = differences[best - 1 : best + 2]
    return float((shifts[best] + 0.5 * (before - after) / (before - 2 * least + after)) * step_s)


def _difference(leader: FloatArray, follower: FloatArray, shift: int) -> float:
    """Mean squared difference between the follower and the leader `shift` frames earlier."""
    count = len(leader) - abs(shift)
    led = leader[max(-shift, 0) :][:count]
    following = follower[max(shift, 0) :][:count]
    return float(((following - led) ** 2).sum(axis=1).mean())
