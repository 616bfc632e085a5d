"""The image in many poses at once: one lane for each pose and each ray that leaves the port.

A lane follows its ray from the port to M1, to M2 (float64, M2's pose by lane) and into the water, and asks on each
segment of its path what blocks it: the fixed parts in the body frame, the moving ones in theirs. Nothing of the size of
poses times rays is ever stored: lanes add to the counters of their pose. All counters are integers, so that the order
in which lanes arrive does not change a bit of the result.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.coverage.blockers import Occluders, Segment, Stop, blocker_parameters, first_blocker
from optics.coverage.field import SKIN_M, FoldedField, folded_field
from optics.coverage.outcome import OpticalPath, Outcome
from optics.coverage.pose_axes import PoseAxes, Progress, axes_at, gaze_mirror_at
from optics.kernels.arrays import FloatArray, opaque_vector, to_columns
from optics.kernels.backend import Array3f64, Bool, Float32, Float64, UInt32, UInt64, dr
from optics.layout import Layout
from optics.mesh import Group
from optics.mirror import intersect
from optics.train import OpticalTrain

LANES_PER_LAUNCH = 1 << 26
"""Poses are traced in launches of at most this many lanes: Dr.Jit can index 2^32, and progress is shown in between."""

STERADIANS_PER_UNIT = 2.0**-54
"""Solid angles are added up as integers: exact to 6e-17 sr a cell, and whole spheres fit 64 bits."""

SHAPE = (len(OpticalPath), len(Outcome))
TABLE = SHAPE[0] * SHAPE[1]


@dataclass(frozen=True, kw_only=True)
class Views:
    """What n poses see.

    Attributes
    ----------
    pixels : array, shape (n, len(OpticalPath), len(Outcome))
        Number of cells of the image by how far port and mirrors lead them, and what they then hit (SEEN: open water).
    solid_angle_sr : array, shape (n, len(OpticalPath), len(Outcome))
        Solid angle in the water of those cells.
    """

    pixels: NDArray[np.int64]
    solid_angle_sr: FloatArray


def trace_poses(
    train: OpticalTrain,
    layout: Layout,
    occluders: Occluders,
    poses: PoseAxes,
    *,
    columns: int,
    rows: int,
    progress: Progress | None = None,
) -> Views:
    """Images of n poses.

    Parameters
    ----------
    train : OpticalTrain
        Of the rig at any pose.
    layout : Layout
    occluders : mapping
        An `Occluder` for each group.
    poses : PoseAxes
    columns, rows : int
        Cells of the image.
    progress : callable, optional
        Called with the number of poses done and their total.
    """
    field, count = folded_field(train, layout, occluders[Group.FIXED], columns, rows), len(poses)
    near = near_moving_parts(field, layout, occluders)
    # Direct view far from all that moves is the same at all poses.
    moving = field.folded | near
    pixels, solid_angle = _same_at_all_poses(field, moving)
    pixels, solid_angle = np.tile(pixels, (count, 1)), np.tile(solid_angle, (count, 1))
    ray_count = int(moving.sum())
    parameters = _kernel_parameters(train, layout, occluders, field, moving)
    step = max(1, LANES_PER_LAUNCH // max(1, ray_count))
    for first in range(0, count if ray_count else 0, step):
        chunk = slice(first, first + step)
        counters = _launch(parameters, poses.kernel(chunk), len(pixels[chunk]), ray_count)
        pixels[chunk] += np.array(counters[0]).reshape(-1, TABLE)
        solid_angle[chunk] += np.array(counters[1]).reshape(-1, TABLE) * STERADIANS_PER_UNIT
        if progress is not None:
            progress(min(first + step, count), count)
    return Views(pixels=pixels.reshape(-1, *SHAPE), solid_angle_sr=solid_angle.reshape(-1, *SHAPE))


def seen_cells(
    train: OpticalTrain, layout: Layout, occluders: Occluders, poses: PoseAxes, *, columns: int, rows: int
) -> NDArray[np.bool_]:
    """Which cells of the image look over both mirrors into the open water, shape (n, rows, columns).

    All others show the robot itself, or look past one of the mirrors. Parameters are those of `trace_poses`.
    """
    field, count = folded_field(train, layout, occluders[Group.FIXED], columns, rows), len(poses)
    moving, ray_count = field.folded, int(field.folded.sum())
    parameters = _kernel_parameters(train, layout, occluders, field, moving)
    seen = np.zeros((count, rows * columns), dtype=bool)
    step = max(1, LANES_PER_LAUNCH // max(1, ray_count))
    for first in range(0, count if ray_count else 0, step):
        axes = poses.kernel(slice(first, first + step))
        some = min(step, count - first)
        lane = dr.arange(UInt32, some * ray_count)
        pose = lane // dr.opaque(UInt32, ray_count)
        path, outcome = _follow(parameters, axes, pose, lane - pose * dr.opaque(UInt32, ray_count))
        open_water = (path == UInt32(OpticalPath.GAZE)) & (outcome == UInt32(Outcome.SEEN))
        seen[first : first + some, field.cell[moving]] = np.array(open_water).reshape(some, ray_count)
    return seen.reshape(count, rows, columns)


def _kernel_parameters(
    train: OpticalTrain, layout: Layout, occluders: Occluders, field: FoldedField, moving: NDArray[np.bool_]
) -> dict[str, Any]:
    """What `_follow` takes: the rays that poses change, M2 and the parts in their way."""
    return {
        "field": _field_parameters(field, moving, near_moving_parts(field, layout, occluders)),
        "m2_outline": train.mirrors[1].parameters().outline,
        "gimbal": opaque_vector(layout.body_from_gimbal.translation),
        **blocker_parameters(occluders),
    }


def _launch(parameters: dict[str, Any], poses: dict[Group, Any], pose_count: int, ray_count: int) -> tuple[Any, Any]:
    """Follow every ray at every pose of a launch: cells of the image and their solid angle, by pose, path and outcome.

    It is compiled once for each set of groups that have parts; numbers, meshes and sizes are its inputs. It is not
    frozen: a frozen function would be recorded again for nearly every scene and size, and would warn of it.
    """
    lane = dr.arange(UInt32, pose_count * ray_count)
    pose = lane // dr.opaque(UInt32, ray_count)
    ray = lane - pose * dr.opaque(UInt32, ray_count)
    path, outcome = _follow(parameters, poses, pose, ray)
    slot = pose * TABLE + path * len(Outcome) + outcome
    pixels, solid_angle = dr.zeros(UInt32, pose_count * TABLE), dr.zeros(UInt64, pose_count * TABLE)
    dr.scatter_add(pixels, UInt32(1), slot)
    dr.scatter_add(solid_angle, dr.gather(UInt64, parameters["field"]["solid_angle"], ray), slot)
    dr.eval(pixels, solid_angle)
    return pixels, solid_angle


def _follow(parameters: dict[str, Any], poses: dict[Group, Any], pose: Any, ray: Any) -> tuple[Any, Any]:
    """Kernel: `OpticalPath` and `Outcome` of each lane's ray."""
    field = parameters["field"]
    moving = axes_at(poses, pose)
    stop, folded = _before_m1(parameters, moving, ray)
    origin, direction = (dr.gather(Array3f64, field[name], ray) for name in ("origin", "direction"))
    hit = intersect(gaze_mirror_at(parameters, poses, pose), origin, direction)
    front, back = folded & hit.front, folded & hit.back
    path = dr.select(
        front, UInt32(OpticalPath.GAZE), dr.select(back, UInt32(OpticalPath.BACK), UInt32(OpticalPath.FOLD))
    )
    path = dr.select(folded, path, UInt32(OpticalPath.DIRECT))
    outcome = stop.outcome
    # The fold view goes on past M2; what is known of the fixed parts counts up to M2, where there is one.
    onwards = folded & (outcome == UInt32(Outcome.SEEN))
    between = Segment(origin, direction, dr.select(front | back, hit.distance, dr.inf))
    fixed = Stop(dr.gather(Float32, field["behind_at"], ray), dr.gather(UInt32, field["behind_by"], ray))
    stop = first_blocker(parameters, moving, between, onwards, fixed)
    stopped = onwards & (stop.distance < Float32(between.length - SKIN_M))
    outcome = dr.select(stopped, stop.outcome, dr.select(onwards & back, UInt32(Outcome.BACK_OF_MIRROR), outcome))
    out = front & (outcome == UInt32(Outcome.SEEN))
    everything = {Group.FIXED: None, **moving}
    stop = first_blocker(parameters, everything, Segment(hit.point, hit.direction, Float64(dr.inf)), out)
    return path, dr.select(out, stop.outcome, outcome)


def _before_m1(parameters: dict[str, Any], moving: dict[Group, Any], ray: Any) -> tuple[Stop, Any]:
    """Kernel: what stops rays between port and M1, or in the direct view anywhere; and whether they reach M1."""
    field = parameters["field"]
    stop = Stop(dr.gather(Float32, field["before_at"], ray), dr.gather(UInt32, field["before_by"], ray))
    folded = dr.gather(Bool, field["folded"], ray)
    if "port" in field:
        start, direction = (dr.gather(Array3f64, field[name], ray) for name in ("port", "port_direction"))
        near = dr.gather(Bool, field["near"], ray)
        segment = Segment(start, direction, dr.gather(Float64, field["length"], ray))
        stop = first_blocker(parameters, moving, segment, near, stop)
    return stop, folded


def _same_at_all_poses(field: FoldedField, moving: NDArray[np.bool_]) -> tuple[NDArray[np.int64], FloatArray]:
    """Cells of the image that no pose changes, and their solid angle; shape (TABLE,)."""
    housed = np.ones(len(field.outcome), dtype=bool)
    housed[field.cell] = False
    still = field.cell[~moving]
    slot = np.concatenate(
        [
            OpticalPath.HOUSING * len(Outcome) + field.outcome[housed],
            OpticalPath.DIRECT * len(Outcome) + field.before.outcome[~moving].astype(int),
        ]
    )
    solid_angle = np.concatenate([field.solid_angle_sr[housed], field.solid_angle_sr[still]])
    return (
        np.bincount(slot, minlength=TABLE).astype(np.int64),
        np.bincount(slot, weights=solid_angle, minlength=TABLE).astype(np.float64),
    )


def _field_parameters(field: FoldedField, moving: NDArray[np.bool_], near: NDArray[np.bool_]) -> dict[str, Any]:
    """Rays that poses change, for the kernels."""
    units = np.round(field.solid_angle_sr[field.cell[moving]] / STERADIANS_PER_UNIT)
    parameters = {
        "origin": Array3f64(*to_columns(field.origin_m[moving])),
        "direction": Array3f64(*to_columns(field.direction[moving])),
        "folded": Bool(field.folded[moving]),
        "solid_angle": UInt64(units.astype(np.uint64)),
    }
    for name, stops in (("before", field.before), ("behind", field.behind)):
        parameters[f"{name}_at"] = Float32(stops.distance_m[moving].astype(np.float32))
        parameters[f"{name}_by"] = UInt32(stops.outcome[moving])
    if near.any():
        parameters |= {
            "port": Array3f64(*to_columns(field.port_m[moving])),
            "port_direction": Array3f64(*to_columns(field.port_direction[moving])),
            "length": Float64(field.length_m[moving]),
            "near": Bool(near[moving]),
        }
    return parameters


def near_moving_parts(
    field: FoldedField, layout: Layout, occluders: Occluders, *, least_reach_m: float = 0.0
) -> NDArray[np.bool_]:
    """Rays that between port and M1, or in the direct view, enter the sphere in which all moving parts turn.

    Its radius is `least_reach_m` where the parts reach less far.
    """
    moving = [part for group in (Group.PAN, Group.TILT) for part in occluders[group].parts]
    reach = max((np.linalg.norm(part.vertices_m, axis=1).max() for part in moving), default=0.0)
    reach = max(float(reach), least_reach_m)
    to_gimbal = layout.body_from_gimbal.translation - field.port_m
    along = np.clip((field.port_direction * to_gimbal).sum(axis=1), 0, field.length_m)
    distance = np.linalg.norm(along[:, np.newaxis] * field.port_direction - to_gimbal, axis=1)
    return np.asarray(distance < reach)
