"""Holding the target: acquisition, time on target, losses, what they were due to, and getting it back."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dives.metrics.frames import BoolArray, Frames, share

LOSS_FRAMES = 5
"""A target that is not held for more frames than this is lost: a sixth of a second at 30 frames/s."""

UNNAMED = "unnamed"
"""Cause of a loss in which the log names none: the loop let go of a target that it had found."""

HOLDING_DEFINITIONS = {
    "duration_s": "from the first frame to the end of the last",
    "frames": "rows of the log",
    "functional_check_frames": "of them the functional check",
    "acquired": "whether the loop ever tracked the target: mode `track` with the target found",
    "acquisition_time_s": "from the dive's first frame to the acquisition, the functional check included",
    "search_time_s": "from the first frame that is no functional check to the acquisition",
    "time_on_target_s": "time in which the target is held: visible while the loop tracks or predicts it: what the"
    " detector last found was the target",
    "time_on_target_fraction": "of the time from the acquisition on",
    "visible_fraction": "of the time from the acquisition on, in which at least one pixel of the target is seen over"
    " the gaze mirror, whatever the loop does",
    "found_fraction": "of the time from the acquisition on, in which the detector finds the target",
    "false_tracking_s": "time in which the loop tracks or predicts something else: what the detector last found was not"
    " the target; in the whole dive",
    "false_tracking_fraction": "of the time that is no functional check",
    "false_tracking_things_s": "false_tracking_s by what it was: robot, decoy, world or water",
    "beyond_reach_s": "time in which the loop takes the target to be beyond the joints' reach, and waits for it",
    "losses": f"runs of more than {LOSS_FRAMES} frames after the acquisition in which the target is not held; None for"
    " a dive that never acquired it, which had nothing to lose",
    "losses_reacquired": "losses after which it is held again",
    "recovered_fraction": "losses_reacquired of losses",
    "reacquisition_times_s": "of each reacquired loss: from its first frame to the first in which the target is held",
    "reacquisition_time_mean_s": "mean of reacquisition_times_s",
    "reacquisition_time_max_s": "largest of reacquisition_times_s",
    "lost_time_s": "time of all losses",
    "loss_causes": "losses by cause: the first that the log names after the target was last found",
    "not_found_causes_frames": "frames that are no functional check in which the target is not found, by cause",
}


@dataclass(frozen=True, kw_only=True)
class Loss:
    """One loss of the target.

    Attributes
    ----------
    first, end : int
        Frames: first of the loss, first after it.
    start_s, duration_s : float
        On the dive's clock, until the target is held again or the log ends.
    reacquired : bool
        False when the log ends first.
    cause : str
    """

    first: int
    end: int
    start_s: float
    duration_s: float
    reacquired: bool
    cause: str


def losses(frames: Frames, *, loss_frames: int = LOSS_FRAMES) -> list[Loss]:
    """Losses after the acquisition, in order.

    Parameters
    ----------
    frames : Frames
    loss_frames : int
        Runs of more frames than this without holding the target are losses.
    """
    ends_s = np.append(frames.time_s, frames.time_s[-1] + frames.lasts_s[-1])
    return [
        Loss(
            first=first,
            end=end,
            start_s=float(frames.time_s[first]),
            duration_s=float(ends_s[end] - frames.time_s[first]),
            reacquired=end < len(frames.time_s),
            cause=_cause(frames, first, end),
        )
        for first, end in runs(~frames.held & frames.after_acquisition)
        if end - first > loss_frames
    ]


def runs(flags: BoolArray) -> list[tuple[int, int]]:
    """First and one past the last index of each run of true values, shape (n,)."""
    edges = np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8))
    return list(zip(np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist(), strict=True))


def holding_metrics(frames: Frames) -> dict[str, object]:
    """Everything of `HOLDING_DEFINITIONS`; None where it is not defined."""
    lost = losses(frames)
    after, acquired = frames.after_acquisition, frames.acquired is not None
    times = [loss.duration_s for loss in lost if loss.reacquired]
    return {
        "duration_s": float(frames.lasts_s.sum()),
        "frames": len(frames.time_s),
        "functional_check_frames": int((~frames.looking).sum()),
        "acquired": acquired,
        "acquisition_time_s": _acquisition_time_s(frames, since=0),
        "search_time_s": _acquisition_time_s(frames, since=_first_after_check(frames)),
        "time_on_target_s": float(frames.lasts_s[frames.held & after].sum()),
        "time_on_target_fraction": share(frames.held, after, frames.lasts_s),
        "visible_fraction": share(frames.visible, after, frames.lasts_s),
        "found_fraction": share(frames.found, after, frames.lasts_s),
        "false_tracking_s": float(frames.lasts_s[frames.false_tracking].sum()),
        "false_tracking_fraction": share(frames.false_tracking, frames.looking, frames.lasts_s),
        "false_tracking_things_s": _false_things_s(frames),
        "beyond_reach_s": float(frames.lasts_s[frames.following & frames.beyond_reach].sum()),
        "losses": len(lost) if acquired else None,
        "losses_reacquired": len(times) if acquired else None,
        "recovered_fraction": len(times) / len(lost) if lost else None,
        "reacquisition_times_s": times,
        "reacquisition_time_mean_s": float(np.mean(times)) if times else None,
        "reacquisition_time_max_s": max(times, default=None),
        "lost_time_s": float(sum(loss.duration_s for loss in lost)) if acquired else None,
        "loss_causes": _counted([loss.cause for loss in lost]),
        "not_found_causes_frames": not_found_causes(frames, frames.looking),
    }


def not_found_causes(frames: Frames, among: BoolArray) -> dict[str, int]:
    """Why the target was not found, over the frames of a flag, shape (n,): frames by cause, the most frequent first."""
    return _counted([cause or UNNAMED for cause in frames.cause[among & ~frames.found]])


def _false_things_s(frames: Frames) -> dict[str, float]:
    """Time on something else by what it was, the longest first."""
    on, false = frames.followed, frames.false_tracking
    lasting = {str(thing): float(frames.lasts_s[false & (on == thing)].sum()) for thing in np.unique(on[false])}
    return dict(sorted(lasting.items(), key=lambda each: -each[1]))


def _acquisition_time_s(frames: Frames, *, since: int) -> float | None:
    return None if frames.acquired is None else float(frames.time_s[frames.acquired] - frames.time_s[since])


def _first_after_check(frames: Frames) -> int:
    others = np.flatnonzero(frames.looking)
    return int(others[0]) if len(others) else 0


def _cause(frames: Frames, first: int, end: int) -> str:
    """What a loss is due to: it begins where the target was last found, and a prediction bridges some frames."""
    last_found = np.flatnonzero(frames.found[: first + 1])[-1]  # the acquisition at the latest
    named = [cause for cause in frames.cause[last_found + 1 : end] if cause]
    return str(named[0]) if named else UNNAMED


def _counted(causes: Sequence[str]) -> dict[str, int]:
    """How often each occurs, the most frequent first, of equals in alphabetical order."""
    return dict(sorted(((str(cause), count) for cause, count in Counter(causes).items()), key=lambda e: (-e[1], e[0])))
