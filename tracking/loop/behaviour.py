"""The behaviour of figure 12 as a state machine: check, scan, track, predict, and scan again.

    CHECK    --- its time is over ----------------------------> SCAN
    SCAN     --- seen in `confirm_frames` images, likely ---> TRACK
    TRACK    --- not seen ------------------------------------> PREDICT
    PREDICT  --- seen ----------------------------------------> TRACK
    PREDICT  --- not seen for more than `predict_frames` -----> SCAN
    any      --- what is followed is likely not the target ---> SCAN

What was seen in few images is not waited for longer than it was seen, if `earned` says so: a speck that looked like the
target for a tenth of a second would stop a search for four.

While scanning, a target that was seen but not yet often enough is a candidate: it is already followed, and given up
after `look_frames` images running without it. While predicting, an image that does not show the place where the
target is expected, because the mirror is still on its way there, says nothing; those images do not count.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from tracking.records import Mode


@dataclass(frozen=True, kw_only=True)
class BehaviourSettings:
    """When the mode changes.

    Attributes
    ----------
    check_s : float
        Duration of the functional check, seconds; 0 leaves it out. The paper's takes the first 30 s.
    confirm_frames : int
        Images that a target must be seen in before it is tracked; the paper's first is enough.
    look_frames : int
        Images running without a candidate after which the search goes on.
    predict_frames : int
        Images that a lost target is looked for where it is predicted; the paper's 30.
    unseen_frames : int
        Images that do not count, because the place where it is predicted is not in the crop. The paper counts all.
    wait_frames : int
        Images that do not count, because the target is predicted beyond the joints' reach: it is waited for.
    earned : bool
        Whether all three are at most as many as the target was seen in since it was tracked.
    """

    check_s: float = 30.0
    confirm_frames: int = 1
    look_frames: int = 0
    predict_frames: int = 30
    unseen_frames: int = 0
    wait_frames: int = 0
    earned: bool = False

    def __post_init__(self) -> None:
        problems = []
        if not (math.isfinite(self.check_s) and self.check_s >= 0):
            problems.append(f"expected check_s of at least 0 s, got {self.check_s}")
        if self.confirm_frames < 1:
            problems.append(f"expected confirm_frames of at least 1, got {self.confirm_frames}")
        problems += [
            f"expected {name} of at least 0, got {getattr(self, name)}"
            for name in ("look_frames", "predict_frames", "unseen_frames", "wait_frames")
            if getattr(self, name) < 0
        ]
        if problems:
            raise ValueError("; ".join(problems))


@dataclass(frozen=True, kw_only=True)
class BehaviourState:
    """Mode and what decides the next one.

    Attributes
    ----------
    mode : Mode
    hits : int
        While scanning: in how many images a candidate was seen.
    missed : int
        Images running without a candidate; while predicting: images without the target that count.
    unseen : int
        While predicting: images that do not.
    waited : int
        While predicting: images in which it was waited for beyond reach.
    seen : int
        While tracking and predicting: images that the target was seen in.
    """

    mode: Mode = Mode.CHECK
    hits: int = 0
    missed: int = 0
    unseen: int = 0
    waited: int = 0
    seen: int = 0


def next_state(
    state: BehaviourState,
    settings: BehaviourSettings,
    *,
    elapsed_s: float,
    found: bool,
    expected: bool,
    beyond_reach: bool = False,
    likely: bool = True,
    doubted: bool = False,
) -> BehaviourState:
    """State in which the command after one more image is decided.

    Parameters
    ----------
    state : BehaviourState
        After the image before.
    settings : BehaviourSettings
    elapsed_s : float
        Since the first image.
    found : bool
        Whether the target is seen in this image. The functional check does not look.
    expected : bool
        Whether the place where it is predicted lies in the crop.
    beyond_reach : bool
        Whether it is predicted where the joints do not reach.
    likely : bool
        Whether a candidate looks enough like the target to be tracked.
    doubted : bool
        Whether what is followed is likelier not to be the target.
    """
    if state.mode is Mode.CHECK:
        if elapsed_s < settings.check_s:
            return state
        state = BehaviourState(mode=Mode.SCAN)
    if doubted:
        return BehaviourState(mode=Mode.SCAN)
    if state.mode is Mode.SCAN:
        if not found:
            looks_on = state.hits > 0 and state.missed < settings.look_frames
            return replace(state, missed=state.missed + 1) if looks_on else BehaviourState(mode=Mode.SCAN)
        hits = min(state.hits + 1, settings.confirm_frames)
        confirmed = hits >= settings.confirm_frames and likely
        return BehaviourState(mode=Mode.TRACK, seen=hits) if confirmed else BehaviourState(mode=Mode.SCAN, hits=hits)
    if found:
        return BehaviourState(mode=Mode.TRACK, seen=state.seen + 1)
    return _predicted(replace(state, mode=Mode.PREDICT), settings, expected=expected, beyond_reach=beyond_reach)


def _predicted(
    lost: BehaviourState, settings: BehaviourSettings, *, expected: bool, beyond_reach: bool
) -> BehaviourState:
    """State after an image without a target that was tracked."""
    most = lost.seen if settings.earned else max(settings.wait_frames, settings.unseen_frames, settings.predict_frames)
    if beyond_reach and lost.waited < min(settings.wait_frames, most):
        return replace(lost, waited=lost.waited + 1)
    if not expected and lost.unseen < min(settings.unseen_frames, most):
        return replace(lost, unseen=lost.unseen + 1)
    if lost.missed < min(settings.predict_frames, most):
        return replace(lost, missed=lost.missed + 1)
    return BehaviourState(mode=Mode.SCAN)
