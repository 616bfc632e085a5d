"""The view of many poses at once: one lane for each pose and each ray that leaves the port.

A lane follows its ray from the port to M1, to M2 (float64, M2's pose by lane) and into the water, and asks on each
piece of the way what blocks it: the fixed parts in the body frame, the moving ones in theirs. Nothing of the size of
poses times rays is ever stored: lanes add to the counters of their pose and of the cell of the sphere they look into.
All counters are integers, so that the order in which lanes arrive does not change a bit of the result.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.analysis.fate import Fate, Way, fates_at_parts
from optics.analysis.field import SKIN_M, FoldedField, folded_field, pixels_per_degree
from optics.analysis.sphere import cell_count, cell_of
from optics.arrays import FloatArray, opaque, opaque_vector, to_columns
from optics.backend import Array3f32, Array3f64, Bool, Float32, Float64, UInt32, UInt64, dr
from optics.layout import Layout, pan_from_m2
from optics.mesh import Group, PartMesh
from optics.mirror import outline_edges, strike
from optics.occlusion import Occluder, first_hit
from optics.train import OpticalTrain
from rigs import Rig

LANES_PER_LAUNCH = 1 << 26
"""Poses are traced in launches of at most this many lanes: Dr.Jit can index 2^32, and progress is shown in between."""

BITS_PER_LAUNCH = 1 << 28
"""Poses times cells of the sphere of one launch at most: each pair is a bit, 32 MB in all."""

STERADIANS_PER_UNIT = 2.0**-54
"""Solid angles are added up as integers: exact to 6e-17 sr a cell, and whole spheres fit 64 bits."""

WORD = 32
"""Bits in a word of the table of poses that see a cell."""

TABLE = len(Way) * len(Fate)

Progress = Callable[[int, int], None]
"""Called with the number of poses done and their total."""


@dataclass(frozen=True, kw_only=True)
class Views:
    """What n poses see.

    Attributes
    ----------
    pixels : array, shape (n, len(Way), len(Fate))
        Number of cells of the image by how far port and mirrors lead them, and what they then meet (SEEN: open water).
    solid_angle_sr : array, shape (n, len(Way), len(Fate))
        Solid angle in the water of those cells.
    rays : array, shape (len(Fate), cells)
        Pairs of a pose and a cell of the image whose ray M2 sends towards each cell of the sphere, whether it gets
        there (SEEN) or is stopped on its way.
    poses_seeing : array, shape (cells,)
        Number of poses that see each cell of the sphere.
    pixels_per_degree : array, shape (cells,)
        Best resolution at which one of them does; zero where none does.
    """

    pixels: NDArray[np.int64]
    solid_angle_sr: FloatArray
    rays: NDArray[np.int64]
    poses_seeing: NDArray[np.int64]
    pixels_per_degree: FloatArray


def trace_poses(
    rig: Rig,
    parts: Sequence[PartMesh],
    *,
    q1: FloatArray,
    q2: FloatArray,
    columns: int,
    rows: int,
    nside: int,
    progress: Progress | None = None,
) -> Views:
    """Views of n poses.

    Parameters
    ----------
    rig : Rig
        With mirrors.
    parts : sequence of PartMesh
        What blocks rays; may be empty.
    q1, q2 : arrays, shape (n,)
        Joint values, radians, within the limits.
    columns, rows : int
        Cells of the image.
    nside : int
        Of the sphere of directions.
    progress : callable, optional
        Called with the number of poses done and their total.
    """
    layout = Layout.from_rig(rig)
    occluders = {group: Occluder.of_group(parts, group) for group in Group}
    train = OpticalTrain.from_rig(rig, q1=float(q1[0]), q2=float(q2[0]))
    field = folded_field(train, layout, occluders[Group.FIXED], columns, rows)
    near = _near_moving_parts(field, layout, parts)
    # Direct view far from all that moves is the same at all poses.
    moving = field.folded | near
    pixels, solid_angle = _same_at_all_poses(field, moving)
    pixels, solid_angle = np.tile(pixels, (len(q1), 1)), np.tile(solid_angle, (len(q1), 1))
    resolution = pixels_per_degree(train.camera, train.port, columns, rows)[field.cell]
    ray_count, cells = int(moving.sum()), cell_count(nside)
    rays = np.zeros(len(Fate) * cells, dtype=np.int64)
    poses_seeing, best = np.zeros(cells, dtype=np.int64), np.zeros(cells, dtype=np.float32)
    parameters: dict[str, Any] = {
        "field": _field_parameters(field, moving, near, resolution),
        "m2": _m2_parameters(layout, train),
        "occluders": {group: occluder.parameters() for group, occluder in occluders.items()},
        "fates": {group: UInt32(fates_at_parts(occluder.parts)) for group, occluder in occluders.items()},
        "nside": opaque(nside),
    }
    step = max(1, min(LANES_PER_LAUNCH // max(1, ray_count), BITS_PER_LAUNCH // cells))
    for first in range(0, len(q1) if ray_count else 0, step):
        chunk = slice(first, first + step)
        poses = _pose_parameters(layout, q1[chunk], q2[chunk])
        found = _launch(parameters, poses, len(q1[chunk]), ray_count, cells)
        pixels[chunk] += np.array(found.pixels).reshape(-1, TABLE)
        solid_angle[chunk] += np.array(found.solid_angle).reshape(-1, TABLE) * STERADIANS_PER_UNIT
        rays += np.array(found.rays)
        poses_seeing += np.array(found.poses_seeing)
        best = np.maximum(best, np.array(found.best))
        if progress is not None:
            progress(min(first + step, len(q1)), len(q1))
    return Views(
        pixels=pixels.reshape(-1, len(Way), len(Fate)),
        solid_angle_sr=solid_angle.reshape(-1, len(Way), len(Fate)),
        rays=rays.reshape(len(Fate), cells),
        poses_seeing=poses_seeing,
        pixels_per_degree=best.astype(np.float64),
    )


@dataclass(frozen=True, kw_only=True)
class Counters:
    """What the lanes of one launch add up to: Dr.Jit arrays."""

    pixels: Any
    solid_angle: Any
    rays: Any
    poses_seeing: Any
    best: Any


def _launch(
    parameters: dict[str, Any], poses: dict[Group, Any], pose_count: int, ray_count: int, cells: int
) -> Counters:
    """Follow every ray at every pose of a launch.

    It is compiled once for each set of groups that have parts; numbers, meshes and sizes are its inputs. It is not
    frozen: a frozen function would be recorded anew for nearly every scene and size, and would warn of it.

    Poses that see a cell are counted without counting any twice: every pair of a pose and a cell has a bit, which any
    number of rays may set in any order, and a pose is never split between launches.
    """
    lane = dr.arange(UInt32, pose_count * ray_count)
    pose = lane // dr.opaque(UInt32, ray_count)
    ray = lane - pose * dr.opaque(UInt32, ray_count)
    way, fate, direction = _follow(parameters, poses, pose, ray)
    towards = way == UInt32(Way.GAZE)
    seen = towards & (fate == UInt32(Fate.SEEN))
    slot = pose * TABLE + way * len(Fate) + fate
    cell = cell_of(direction, parameters["nside"])
    words = -(-pose_count // WORD)
    pixels = dr.zeros(UInt32, pose_count * TABLE)
    solid_angle = dr.zeros(UInt64, pose_count * TABLE)
    rays = dr.zeros(UInt32, len(Fate) * cells)
    seeing = dr.zeros(UInt32, cells * words)
    best = dr.zeros(Float32, cells)
    dr.scatter_add(pixels, UInt32(1), slot)
    dr.scatter_add(solid_angle, dr.gather(UInt64, parameters["field"]["solid_angle"], ray), slot)
    dr.scatter_add(rays, UInt32(1), fate * dr.opaque(UInt32, cells) + cell, towards)
    word = cell * dr.opaque(UInt32, words) + pose // WORD
    dr.scatter_reduce(dr.ReduceOp.Or, seeing, UInt32(1) << (pose % WORD), word, seen)
    dr.scatter_reduce(dr.ReduceOp.Max, best, dr.gather(Float32, parameters["field"]["resolution"], ray), cell, seen)
    dr.eval(pixels, solid_angle, rays, seeing, best)
    poses_seeing = dr.block_sum(dr.popcnt(seeing), words)
    return Counters(pixels=pixels, solid_angle=solid_angle, rays=rays, poses_seeing=poses_seeing, best=best)


def _follow(parameters: dict[str, Any], poses: dict[Group, Any], pose: Any, ray: Any) -> tuple[Any, Any, Any]:
    """Kernel: `Way` and `Fate` of each lane's ray, and its direction behind M2 in the body frame."""
    field = parameters["field"]
    x, y, normal = (dr.gather(Array3f64, axis, pose) for axis in poses[Group.TILT])
    moving = {group: [Array3f32(dr.gather(Array3f64, axis, pose)) for axis in axes] for group, axes in poses.items()}
    stop, folded = _before_m1(parameters, moving, ray)
    origin, direction = (dr.gather(Array3f64, field[name], ray) for name in ("origin", "direction"))
    hit = strike({**parameters["m2"], "x": x, "y": y, "normal": normal}, origin, direction)
    front, back = folded & hit.front, folded & hit.back
    way = dr.select(front, UInt32(Way.GAZE), dr.select(back, UInt32(Way.BACK), UInt32(Way.FOLD)))
    way = dr.select(folded, way, UInt32(Way.DIRECT))
    fate = stop.fate
    # The fold view goes on past M2; what is known of the fixed parts counts up to M2, where there is one.
    onwards = folded & (fate == UInt32(Fate.SEEN))
    between = Segment(origin, direction, dr.select(front | back, hit.distance, dr.inf))
    fixed = Stop(dr.gather(Float32, field["behind_at"], ray), dr.gather(UInt32, field["behind_by"], ray))
    stop = _first_blocker(parameters, moving, between, onwards, fixed)
    stopped = onwards & (stop.distance < Float32(between.length - SKIN_M))
    fate = dr.select(stopped, stop.fate, dr.select(onwards & back, UInt32(Fate.BACK_OF_MIRROR), fate))
    out = front & (fate == UInt32(Fate.SEEN))
    everything = {Group.FIXED: None, **moving}
    stop = _first_blocker(parameters, everything, Segment(hit.point, hit.direction, Float64(dr.inf)), out)
    return way, dr.select(out, stop.fate, fate), hit.direction


def _before_m1(parameters: dict[str, Any], moving: dict[Group, Any], ray: Any) -> tuple[Stop, Any]:
    """Kernel: what stops rays between port and M1, or in the direct view anywhere; and whether they reach M1."""
    field = parameters["field"]
    stop = Stop(dr.gather(Float32, field["before_at"], ray), dr.gather(UInt32, field["before_by"], ray))
    folded = dr.gather(Bool, field["folded"], ray)
    if "port" in field:
        start, direction = (dr.gather(Array3f64, field[name], ray) for name in ("port", "port_direction"))
        near = dr.gather(Bool, field["near"], ray)
        way = Segment(start, direction, dr.gather(Float64, field["length"], ray))
        stop = _first_blocker(parameters, moving, way, near, stop)
    return stop, folded


@dataclass(frozen=True)
class Segment:
    """Pieces of rays in the body frame between two surfaces: Dr.Jit arrays, float64."""

    origin: Any
    direction: Any
    length: Any


@dataclass(frozen=True)
class Stop:
    """What stops a segment first (SEEN: nothing does), and how far from its origin (float32; infinite: nowhere)."""

    distance: Any
    fate: Any


def _first_blocker(
    parameters: dict[str, Any],
    axes_of_group: dict[Group, Any],
    segment: Segment,
    active: Any,
    known: Stop | None = None,
) -> Stop:
    """Kernel: the first part of some groups in a segment's way, or what is known to be there when that is nearer.

    A group comes with the axes of its frame in the body frame, or with None when that is the body's.
    """
    stop = known or Stop(Float32(dr.inf), UInt32(Fate.SEEN))
    end = Float32(segment.length - SKIN_M)
    for group, axes in axes_of_group.items():
        occluder = parameters["occluders"][group]
        if not occluder:
            continue
        origin, direction = segment.origin, segment.direction
        if axes is not None:
            # Rays meet triangles in float32 anyway; turned in it they cost half.
            from_gimbal = Array3f32(origin - parameters["m2"]["point"])
            along = Array3f32(direction)
            origin, direction = (Array3f32(*(dr.dot(axis, vector) for axis in axes)) for vector in (from_gimbal, along))
        # What is known to be nearer need not be looked for.
        reach = dr.minimum(end, stop.distance) - Float32(SKIN_M)
        hit = first_hit(occluder, dr.fma(direction, SKIN_M, origin), direction, reach, active)
        fate = dr.gather(UInt32, parameters["fates"][group], hit.part)
        found = dr.isfinite(hit.distance)
        stop = Stop(dr.select(found, hit.distance + Float32(SKIN_M), stop.distance), dr.select(found, fate, stop.fate))
    return stop


def _same_at_all_poses(field: FoldedField, moving: NDArray[np.bool_]) -> tuple[NDArray[np.int64], FloatArray]:
    """Cells of the image that no pose changes, and their solid angle; shape (TABLE,)."""
    housed = np.ones(len(field.fate), dtype=bool)
    housed[field.cell] = False
    still = field.cell[~moving]
    slot = np.concatenate(
        [Way.HOUSING * len(Fate) + field.fate[housed], Way.DIRECT * len(Fate) + field.before.fate[~moving].astype(int)]
    )
    solid_angle = np.concatenate([field.solid_angle_sr[housed], field.solid_angle_sr[still]])
    return (
        np.bincount(slot, minlength=TABLE).astype(np.int64),
        np.bincount(slot, weights=solid_angle, minlength=TABLE).astype(np.float64),
    )


def _field_parameters(
    field: FoldedField, moving: NDArray[np.bool_], near: NDArray[np.bool_], resolution: FloatArray
) -> dict[str, Any]:
    """Rays that poses change, for the kernels."""
    units = np.round(field.solid_angle_sr[field.cell[moving]] / STERADIANS_PER_UNIT)
    parameters = {
        "origin": Array3f64(*to_columns(field.origin_m[moving])),
        "direction": Array3f64(*to_columns(field.direction[moving])),
        "folded": Bool(field.folded[moving]),
        "solid_angle": UInt64(units.astype(np.uint64)),
        "resolution": Float32(resolution[moving].astype(np.float32)),
    }
    for name, stops in (("before", field.before), ("behind", field.behind)):
        parameters[f"{name}_at"] = Float32(stops.distance_m[moving].astype(np.float32))
        parameters[f"{name}_by"] = UInt32(stops.fate[moving])
    if near.any():
        parameters |= {
            "port": Array3f64(*to_columns(field.port_m[moving])),
            "port_direction": Array3f64(*to_columns(field.port_direction[moving])),
            "length": Float64(field.length_m[moving]),
            "near": Bool(near[moving]),
        }
    return parameters


def _near_moving_parts(field: FoldedField, layout: Layout, parts: Sequence[PartMesh]) -> NDArray[np.bool_]:
    """Rays that between port and M1, or in the direct view, enter the sphere in which all moving parts turn."""
    reach = max((np.linalg.norm(p.vertices_m, axis=1).max() for p in parts if p.group is not Group.FIXED), default=0.0)
    to_gimbal = layout.body_from_gimbal.translation - field.port_m
    along = np.clip((field.port_direction * to_gimbal).sum(axis=1), 0, field.length_m)
    distance = np.linalg.norm(along[:, np.newaxis] * field.port_direction - to_gimbal, axis=1)
    return np.asarray(distance < reach)


def _m2_parameters(layout: Layout, train: OpticalTrain) -> dict[str, Any]:
    """What of M2 does not change with the pose: its centre, where the joint axes cross, and its outline."""
    outline = np.asarray(train.mirrors[1].outline_m, dtype=np.float64)
    return {
        "point": opaque_vector(layout.body_from_gimbal.translation),
        "edges": [[opaque(value) for value in edge] for edge in outline_edges(outline)],
    }


def _pose_parameters(layout: Layout, q1: FloatArray, q2: FloatArray) -> dict[Group, Any]:
    """Axes of the moving groups in the body frame, by pose; each joint value is turned into a rotation once."""
    pans, pan = np.unique(q1, return_inverse=True)
    tilts, tilt = np.unique(q2, return_inverse=True)
    body_from_pan = np.stack([layout.body_from_pan(q).rotation.as_matrix() for q in pans])[pan]
    from_m2 = np.stack([pan_from_m2(layout.tilt_angle(q)).rotation.as_matrix() for q in tilts])[tilt]
    rotations = {Group.PAN: body_from_pan, Group.TILT: body_from_pan @ from_m2}
    return {group: [Array3f64(*to_columns(turn[:, :, k])) for k in range(3)] for group, turn in rotations.items()}
