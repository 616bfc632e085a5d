"""What a loop made of one dive of the arena, against what it could have done.

A target that no gaze shows, or that something stands before, cannot be held. *Available* is it where some joint values
show its direction past hull and mount (`optics.coverage`), and nothing of the world and no decoy lies between the gaze
mirror's centre and its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from dives.dive import Dive
from dives.metrics.frames import BoolArray, Frames, share, unit_vectors
from dives.metrics.holding import Loss, losses, not_found_causes, runs
from dives.metrics.pointing import pointing_metrics
from dives.metrics.search_time import search_time_metrics
from dives.paths import body_pose, decoy_pose, target_pose
from dives.rendered_camera import dive_scene
from optics.coverage.coverage import compute_coverage
from optics.coverage.sphere import cells_of
from optics.kernels.arrays import FloatArray
from optics.kernels.backend import Array3f32, Bool, Float32, mi
from optics.kernels.cache import load_or_make, result_key
from optics.kernels.ray_scene import mesh_scene
from optics.layout import Layout
from optics.mesh import PartMesh
from rigs import Rig
from scenes.stage.targets import Ball

COVERED_VERSION = 1
"""Raised when the same rig is found to show other directions."""

NSIDE, POSES = 32, 41
"""Cells of 1.8 degrees, and poses along each joint's range, at most 5 degrees apart: a view is 20 wide."""

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
    available = is_available(dive, rig, parts, frames)
    after, lasts = frames.after_acquisition, frames.lasts_s
    on = followed_thing(frames, np.array(table["detected_thing"].to_pylist(), dtype=np.str_))
    counted = [loss for loss in losses(frames) if _seconds(frames, available, loss) >= SHORTEST_LOSS_S]
    recovered = [loss for loss in counted if loss.reacquired]
    searched = search_time_metrics(rig, dive.loop_variant(), frames)
    acquired_s = None if frames.acquired is None else float(frames.time_s[frames.acquired])
    return {
        "available_s": float(lasts[available].sum()),
        "acquired": frames.acquired is not None,
        "acquisition_time_s": acquired_s,
        **searched,
        "held_fraction": share(frames.held, available & after, lasts),
        "held_of_all_fraction": share(frames.held, available, lasts),
        "identity_error_fraction": share(on != "target", frames.following, lasts),
        **{f"longest_on_{thing}_s": longest_s(frames, frames.following & (on == thing)) for thing in THINGS},
        "losses": len(counted),
        "losses_recovered": len(recovered),
        "reacquisition_times_s": [_seconds(frames, available, loss) for loss in recovered],
        "gaze_error_held_rms_deg": pointing_metrics(frames)["gaze_error_held_rms_deg"],
        "target_rate_p95_deg_per_s": _rate(frames, available),
        "not_found_causes_frames": not_found_causes(frames, available),
        "loss_causes": [[loss.start_s, loss.duration_s, loss.cause, loss.reacquired] for loss in counted],
    }


def is_available(dive: Dive, rig: Rig, parts: Sequence[PartMesh], frames: Frames) -> BoolArray:
    """Whether the loop could hold the target, shape (n,)."""
    true = unit_vectors(frames.numbers["true_azimuth_deg"], frames.numbers["true_elevation_deg"])
    within = covered_cells(rig, parts)[cells_of(true, NSIDE)]
    times_s = frames.time_s
    eye = body_pose(dive, times_s).apply(Layout.from_rig(rig).body_from_gimbal.translation)
    target = target_pose(dive, times_s).translation
    hidden = _behind_world(dive, rig, eye, target)
    for decoy in dive.decoys:
        shape = decoy.load_shape()
        if isinstance(shape, Ball):
            hidden |= crosses_ball(eye, target, decoy_pose(dive, decoy, times_s).translation, shape.radius_m)
    return np.asarray(within & ~hidden)


def covered_cells(rig: Rig, parts: Sequence[PartMesh]) -> BoolArray:
    """Cells of the sphere of directions (HEALPix, `NSIDE`) that some joint values show; from the cache when it can."""

    def covered() -> BoolArray:
        q1, q2 = (np.linspace(*joint.limits, POSES) for joint in (layout.pan, layout.tilt))
        return compute_coverage(rig, parts, q1=q1, q2=q2, nside=NSIDE).covered

    layout = Layout.from_rig(rig)
    numbers = rig.model_dump(mode="json", include={"camera", "port", "water", "gaze"})
    shapes = [[part.group.value, part.vertices_m, part.faces] for part in parts]
    return load_or_make(
        "covered directions",
        result_key("covered directions", COVERED_VERSION, numbers, shapes, NSIDE, POSES),
        covered,
        pack=lambda cells: {"cells": cells},
        unpack=lambda stored: stored["cells"],
    )


def crosses_ball(start: FloatArray, end: FloatArray, centre: FloatArray, radius_m: float) -> BoolArray:
    """Whether segments pass through balls, each of shape (n, 3)."""
    along = end - start
    share_of_it = np.clip(((centre - start) * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1)
    nearest = start + share_of_it[:, np.newaxis] * along
    return np.asarray(np.linalg.norm(centre - nearest, axis=1) < radius_m)


def followed_thing(frames: Frames, detected: NDArray[np.str_]) -> NDArray[np.str_]:
    """What the loop is on while it tracks or predicts, shape (n,): what most of the last detection's mask showed.

    The target where that mask met it, as `Frames.held` has it; empty where nothing is followed.
    """
    last = np.maximum.accumulate(np.where(frames.detected, np.arange(len(detected)), -1))
    thing = np.where(last >= 0, detected[last], "")
    thing = np.where(thing == "target", "water", thing)
    return np.where(frames.following, np.where(frames.on_target, "target", thing), "")


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


def _behind_world(dive: Dive, rig: Rig, eye: FloatArray, target: FloatArray) -> BoolArray:
    world = dive_scene(dive, rig).world
    if len(world.faces) == 0:
        return np.zeros(len(eye), dtype=bool)
    away = np.linalg.norm(target - eye, axis=1)
    origin, direction = (Array3f32(*each.T.astype(np.float32)) for each in (eye, (target - eye) / away[:, np.newaxis]))
    ray = mi.Ray3f(origin, direction, Float32(away.astype(np.float32)), 0.0, [])
    return np.asarray(mesh_scene(world.vertices_m, world.faces).ray_test(ray, coherent=True, active=Bool(True)).numpy())
