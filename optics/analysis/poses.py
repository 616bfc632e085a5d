"""The view of many poses at once: one lane for each pose and each ray that M1 sends on.

A lane follows its ray from M1 to M2 (float64, M2's pose by lane), reflects it, and asks on the way there and beyond
what blocks it: the fixed parts in the body frame, the moving ones in theirs. Nothing of the size of poses times rays is
ever stored: lanes add to the counters of their pose and to the sphere of directions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.analysis.fate import Fate, fate_of_role_table
from optics.analysis.field import SKIN_M, FoldedField, folded_field
from optics.analysis.sphere import cell_of
from optics.arrays import FloatArray, opaque, opaque_vector, to_columns
from optics.backend import Array3f64, Bool, Float32, Float64, Matrix3f64, UInt32, dr
from optics.layout import Layout, pan_from_m2
from optics.mesh import Group, PartMesh
from optics.mirror import outline_edges, strike
from optics.occlusion import Occluder, first_hit
from optics.train import OpticalTrain
from rigs import Rig

LANES_PER_LAUNCH = 1 << 26
"""Poses are traced in launches of at most this many lanes: Dr.Jit can index 2^32, and progress is shown in between."""

Progress = Callable[[int, int], None]
"""Called with the number of poses done and their total."""


@dataclass(frozen=True, kw_only=True)
class Views:
    """What n poses see.

    Attributes
    ----------
    pixels : array, shape (n, len(Fate))
        Number of cells of the image by their fate.
    solid_angle_sr : array, shape (n, len(Fate))
        Solid angle in the water of those cells.
    sphere : array, shape (rows, columns)
        How many pairs of a pose and a cell of the image look into each cell of the sphere.
    """

    pixels: NDArray[np.int64]
    solid_angle_sr: FloatArray
    sphere: NDArray[np.int64]


def trace_poses(
    rig: Rig,
    parts: Sequence[PartMesh],
    *,
    q1: FloatArray,
    q2: FloatArray,
    columns: int,
    rows: int,
    sphere: tuple[int, int],
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
    sphere : (int, int)
        Columns and rows of the sphere of directions.
    progress : callable, optional
        Called with the number of poses done and their total.
    """
    layout = Layout.from_rig(rig)
    occluders = {group: Occluder.of_group(parts, group) for group in Group}
    train = OpticalTrain.from_rig(rig, q1=float(q1[0]), q2=float(q2[0]))
    field = folded_field(train, layout, occluders[Group.FIXED], columns, rows)
    pixels, solid_angle = _lost_before_m2(field)
    pixels, solid_angle = np.tile(pixels, (len(q1), 1)), np.tile(solid_angle, (len(q1), 1))
    histogram = np.zeros(sphere[0] * sphere[1], dtype=np.int64)
    parameters: dict[str, Any] = {
        "field": _field_parameters(field, layout, parts),
        "m2": _m2_parameters(layout, train),
        "occluders": {group: occluder.parameters() for group, occluder in occluders.items()},
        "fate_of_role": UInt32(fate_of_role_table()),
        "sphere": [dr.opaque(UInt32, count) for count in sphere],
    }
    step = max(1, LANES_PER_LAUNCH // max(1, len(field.cell)))
    for first in range(0, len(q1) if len(field.cell) else 0, step):
        chunk = slice(first, first + step)
        poses = _pose_parameters(layout, q1[chunk], q2[chunk])
        counts, weights, seen = _launch(parameters, poses, len(q1[chunk]), len(field.cell), len(histogram))
        pixels[chunk] += np.array(counts).reshape(-1, len(Fate))
        solid_angle[chunk] += np.array(weights).reshape(-1, len(Fate))
        histogram += np.array(seen)
        if progress is not None:
            progress(min(first + step, len(q1)), len(q1))
    return Views(pixels=pixels, solid_angle_sr=solid_angle, sphere=histogram.reshape(sphere[1], sphere[0]))


def _launch(
    parameters: dict[str, Any], poses: dict[Group, Any], pose_count: int, ray_count: int, sphere_size: int
) -> tuple[Any, Any, Any]:
    """Follow every ray at every pose of a launch: counts and solid angles by pose and fate, and the sphere.

    It is compiled once for each set of groups that have parts; numbers, meshes and sizes are its inputs. It is not
    frozen: a frozen function would be recorded anew for nearly every scene and size, and would warn of it.
    """
    lane = dr.arange(UInt32, pose_count * ray_count)
    pose = lane // dr.opaque(UInt32, ray_count)
    ray = lane - pose * dr.opaque(UInt32, ray_count)
    fate, direction = _follow(parameters, poses, pose, ray)
    seen = fate == UInt32(Fate.SEEN)
    slot = pose * len(Fate) + fate
    counts = dr.zeros(UInt32, pose_count * len(Fate))
    weights = dr.zeros(Float64, pose_count * len(Fate))
    histogram = dr.zeros(UInt32, sphere_size)
    dr.scatter_add(counts, UInt32(1), slot)
    dr.scatter_add(weights, dr.gather(Float64, parameters["field"]["solid_angle"], ray), slot)
    dr.scatter_add(histogram, UInt32(1), cell_of(direction, *parameters["sphere"]), seen)
    dr.eval(counts, weights, histogram)
    return counts, weights, histogram


def _follow(parameters: dict[str, Any], poses: dict[Group, Any], pose: Any, ray: Any) -> tuple[Any, Any]:
    """Kernel: fate of each lane's ray, and its direction behind M2 in the body frame."""
    field = parameters["field"]
    origin, direction = (dr.gather(Array3f64, field[name], ray) for name in ("origin", "direction"))
    moving = {group: dr.gather(Matrix3f64, poses[group], pose) for group in (Group.PAN, Group.TILT)}
    axes = moving[Group.TILT]
    x, y, normal = (Array3f64(axes[0, k], axes[1, k], axes[2, k]) for k in range(3))
    hit = strike({**parameters["m2"], "x": x, "y": y, "normal": normal}, origin, direction)
    fate = dr.select(hit.back, UInt32(Fate.BACK_OF_MIRROR), UInt32(Fate.MISSED_M2))
    fate = dr.select(hit.front, UInt32(Fate.SEEN), fate)
    if "port" in field:
        start = dr.gather(Array3f64, field["port"], ray)
        length = dr.norm(origin - start)
        near = dr.gather(Bool, field["near"], ray)
        stop = _first_blocker(parameters, moving, Segment(start, (origin - start) / length, length), near)
        fate = dr.select(dr.isfinite(stop.distance), stop.fate, fate)
    fixed = Stop(dr.gather(Float32, field["blocked_at"], ray), dr.gather(UInt32, field["blocked_by"], ray))
    between = Segment(origin, direction, hit.distance)
    stop = _first_blocker(parameters, moving, between, fate == UInt32(Fate.SEEN), fixed)
    blocked = (fate == UInt32(Fate.SEEN)) & (stop.distance < Float32(hit.distance - SKIN_M))
    fate = dr.select(blocked, stop.fate, fate)
    everything = {Group.FIXED: None, **moving}
    beyond = Segment(hit.point, hit.direction, Float64(dr.inf))
    stop = _first_blocker(parameters, everything, beyond, fate == UInt32(Fate.SEEN))
    fate = dr.select((fate == UInt32(Fate.SEEN)) & dr.isfinite(stop.distance), stop.fate, fate)
    return fate, hit.direction


@dataclass(frozen=True)
class Segment:
    """Pieces of rays in the body frame between two surfaces: Dr.Jit arrays, float64."""

    origin: Any
    direction: Any
    length: Any


@dataclass(frozen=True)
class Stop:
    """What stops a segment first, and how far from its origin (float32; infinite where nothing does)."""

    distance: Any
    fate: Any


def _first_blocker(
    parameters: dict[str, Any],
    body_from_group: dict[Group, Any],
    segment: Segment,
    active: Any,
    known: Stop | None = None,
) -> Stop:
    """Kernel: the first part of some groups in a segment's way, or what is known to be there when that is nearer."""
    stop = known or Stop(Float32(dr.inf), UInt32(Fate.SEEN))
    end = Float32(segment.length - SKIN_M)
    for group, rotation in body_from_group.items():
        occluder = parameters["occluders"][group]
        if not occluder:
            continue
        origin, direction = segment.origin, segment.direction
        if rotation is not None:
            origin = rotation.T @ (origin - parameters["m2"]["point"])
            direction = rotation.T @ direction
        # What is known to be nearer need not be looked for.
        reach = dr.minimum(end, stop.distance) - Float32(SKIN_M)
        hit = first_hit(occluder, origin + direction * SKIN_M, direction, reach, active)
        fate = dr.gather(UInt32, parameters["fate_of_role"], hit.role)
        found = dr.isfinite(hit.distance)
        stop = Stop(dr.select(found, hit.distance + Float32(SKIN_M), stop.distance), dr.select(found, fate, stop.fate))
    return stop


def _lost_before_m2(field: FoldedField) -> tuple[NDArray[np.int64], FloatArray]:
    """Cells of the image that are lost at every pose, and their solid angle, by fate."""
    lost = np.ones(len(field.fate), dtype=bool)
    lost[field.cell] = False
    fate = field.fate[lost]
    return (
        np.bincount(fate, minlength=len(Fate)).astype(np.int64),
        np.bincount(fate, weights=field.solid_angle_sr[lost], minlength=len(Fate)).astype(np.float64),
    )


def _field_parameters(field: FoldedField, layout: Layout, parts: Sequence[PartMesh]) -> dict[str, Any]:
    parameters = {
        "origin": Array3f64(*to_columns(field.origin_m)),
        "direction": Array3f64(*to_columns(field.direction)),
        "solid_angle": Float64(field.solid_angle_sr[field.cell]),
        "blocked_at": Float32(field.blocked_at_m.astype(np.float32)),
        "blocked_by": UInt32(field.blocked_by),
    }
    near = _near_moving_parts(field, layout, parts)
    if near.any():
        parameters |= {"port": Array3f64(*to_columns(field.port_m)), "near": Bool(near)}
    return parameters


def _near_moving_parts(field: FoldedField, layout: Layout, parts: Sequence[PartMesh]) -> NDArray[np.bool_]:
    """Rays that between port and M1 enter the sphere around the gimbal in which all moving parts turn."""
    reach = max((np.linalg.norm(p.vertices_m, axis=1).max() for p in parts if p.group is not Group.FIXED), default=0.0)
    way = field.origin_m - field.port_m
    to_gimbal = layout.body_from_gimbal.translation - field.port_m
    share = np.clip((way * to_gimbal).sum(axis=1) / (way**2).sum(axis=1), 0, 1)
    return np.asarray(np.linalg.norm(share[:, np.newaxis] * way - to_gimbal, axis=1) < reach)


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
    return {Group.PAN: _matrices(body_from_pan), Group.TILT: _matrices(body_from_pan @ from_m2)}


def _matrices(matrices: FloatArray) -> Any:
    return Matrix3f64([[Float64(np.ascontiguousarray(matrices[:, i, j])) for j in range(3)] for i in range(3)])
