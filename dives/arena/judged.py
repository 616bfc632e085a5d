"""What a loop made of one dive of the arena, against what it could have done.

A target that no gaze shows, or that something stands before, cannot be held (`dives.planning.availability`), nor one
that outruns the servos (`dives.planning.followable`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyarrow as pa

from dives.dive import Dive
from dives.metrics.frames import BoolArray, Frames, share, unit_vectors
from dives.metrics.holding import Loss, losses, not_found_causes, runs
from dives.metrics.pointing import pointing_metrics
from dives.metrics.search_time import search_time_metrics
from dives.planning.availability import availability
from dives.planning.followable import possible_metrics
from dives.views.robot_view import robot_view
from optics.mesh import PartMesh
from rigs import Rig

SHORTEST_AVAILABLE_S = 2.0
"""A dive whose target is available for less says nothing of the loop."""

SHORTEST_LOSS_S = 0.5
"""A loss counts when the target was available so long of it."""

THINGS = ("robot", "decoy", "world", "water")
"""What a loop can be on instead of the target, as the log's `detected_thing` has it."""


def judged(dive: Dive, rig: Rig, parts: Sequence[PartMesh], table: pa.Table) -> dict[str, Any]:
    """Numbers of a dive, units at the end of their names; None where a quantity is not defined.

    Parameters
    ----------
    dive : Dive
    rig : Rig
        That it was dived with.
    parts : sequence of PartMesh
        Hull and mount.
    table : pyarrow.Table
        Its log.
    """
    frames = Frames.of(table)
    there = availability(dive, rig, parts, frames.time_s)
    available = there.available
    after, lasts = frames.after_acquisition, frames.lasts_s
    on = frames.followed
    counted = [loss for loss in losses(frames) if _seconds(frames, available, loss) >= SHORTEST_LOSS_S]
    recovered = [loss for loss in counted if loss.reacquired]
    shown = robot_view(rig, parts)
    searched = search_time_metrics(rig, dive.loop_variant(), frames, shown)
    possible_s = possible_metrics(dive, rig, shown, frames, there)["possible_s"]
    return {
        "available_s": float(lasts[available].sum()),
        "acquired": frames.acquired is not None,
        "acquisition_time_s": None if frames.acquired is None else float(frames.time_s[frames.acquired]),
        **searched,
        "held_fraction": share(frames.held, available & after, lasts),
        "possible_s": possible_s,
        "held_of_possible_fraction": _of_possible(float(lasts[frames.held & available & after].sum()), possible_s),
        "held_of_all_fraction": share(frames.held, available, lasts),
        "following_s": float(lasts[frames.following].sum()),
        "identity_error_fraction": share(on != "target", frames.following, lasts),
        **{f"longest_on_{thing}_s": longest_s(frames, frames.following & (on == thing)) for thing in THINGS},
        "losses": len(counted),
        "losses_recovered": len(recovered),
        "reacquisition_times_s": [_seconds(frames, available, loss) for loss in recovered],
        "unrecovered_times_s": [_seconds(frames, available, loss) for loss in counted if not loss.reacquired],
        "gaze_error_held_rms_deg": pointing_metrics(frames)["gaze_error_held_rms_deg"],
        "target_rate_p95_deg_per_s": _rate(frames, available),
        "not_found_causes_frames": not_found_causes(frames, available),
        "loss_causes": [[loss.start_s, loss.duration_s, loss.cause, loss.reacquired] for loss in counted],
    }


def _of_possible(held_s: float, possible_s: float | None) -> float | None:
    """Time held as a share of the longest that a mirror could have shown the target; a glimpse past an edge counts."""
    return min(held_s / possible_s, 1.0) if possible_s else None


def longest_s(frames: Frames, flags: BoolArray) -> float:
    """Length of the longest run of true values, shape (n,), seconds."""
    return max((float(frames.lasts_s[first:end].sum()) for first, end in runs(flags)), default=0.0)


def _seconds(frames: Frames, available: BoolArray, loss: Loss) -> float:
    """Time of a loss in which the target was available."""
    return float(frames.lasts_s[loss.first : loss.end][available[loss.first : loss.end]].sum())


def _rate(frames: Frames, available: BoolArray) -> float | None:
    """Rate of the target's true direction, body frame, that 95 % of the available frames stay under."""
    true = unit_vectors(frames.numbers["true_azimuth_deg"], frames.numbers["true_elevation_deg"])
    turned = np.degrees(np.linalg.norm(np.gradient(true, frames.time_s, axis=0), axis=1))
    return float(np.percentile(turned[available], 95)) if available.any() else None
