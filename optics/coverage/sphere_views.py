"""Which directions a pose shows: one lane for each pose and each cell of the sphere near its view.

A cell is decided by its centre, traced back. Things far away in that direction are unfolded over M2 and M1 and aimed at
through the port; that gives the one ray of the camera that can show them. The cell is seen when that ray lies in the
image and goes through the port's aperture, over both faces, past every part and into the open water.

Whether it is seen does not depend on how finely the image is divided, and a cell at the rim of a view counts when its
centre is in it, neither always nor never: the area seen has no bias.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.coverage.blockers import Occluders, Segment, blocker_parameters, first_blocker
from optics.coverage.field import pixels_per_degree
from optics.coverage.gaze_cone import Cone, gaze_cone
from optics.coverage.outcome import Outcome
from optics.coverage.pose_axes import PoseAxes, Progress, axes_at, gaze_mirror_at
from optics.coverage.sphere import cell_count, cell_directions, cells_of
from optics.kernels.arrays import FloatArray, aligned, opaque, opaque_vector, to_columns
from optics.kernels.backend import Array3f64, Float32, Float64, Matrix3f64, UInt32, dr
from optics.kernels.refraction import reflect
from optics.layout import Layout
from optics.mesh import Group
from optics.mirror import MirrorPlane, reflect_over
from optics.ports.port import FlatPort, Port
from optics.train import OpticalTrain

FAR_M = 1e6
"""Distance of what is looked at behind a dome some decimetres wide: its direction is off by less than 1e-6 rad."""

FAMILY = 8
"""Cells are first looked at in families of 8 x 8, of which only those near a view are taken apart."""

LANES_PER_LAUNCH = 1 << 26


@dataclass(frozen=True, kw_only=True)
class SphereViews:
    """Which cells of the sphere n poses show.

    Attributes
    ----------
    poses_by_outcome : array, shape (len(Outcome), cells)
        Number of poses whose mirrors point a ray of the camera at each cell's centre, by what that ray hits: open
        water (SEEN) or a part.
    pixels_per_degree : array, shape (cells,)
        Best resolution at which a pose sees each cell; zero where none does.
    """

    poses_by_outcome: NDArray[np.int64]
    pixels_per_degree: FloatArray


def see_sphere(
    train: OpticalTrain,
    layout: Layout,
    occluders: Occluders,
    poses: PoseAxes,
    *,
    columns: int,
    rows: int,
    nside: int,
    chosen: NDArray[np.int64] | None = None,
    progress: Progress | None = None,
) -> SphereViews:
    """Decide every cell of the sphere at n poses.

    Parameters
    ----------
    train : OpticalTrain
        Of the rig at any pose.
    layout : Layout
    occluders : mapping
        An `Occluder` for each group.
    poses : PoseAxes
    columns, rows : int
        Cells of the image, by which the resolution is counted.
    nside : int
    chosen : array of int, optional
        Cells that must be decided; of the others, some that are not near one of them are left at zero.
    progress : callable, optional
        Called with the number of poses done and their total.
    """
    cells, count = cell_count(nside), len(poses)
    by_outcome, best = np.zeros(len(Outcome) * cells, dtype=np.int64), np.zeros(cells, dtype=np.float32)
    cone = gaze_cone(train, layout)
    if cone is not None and (chosen is None or len(chosen)):
        families = _Families.of(nside, chosen)
        parameters = _numbers(train, layout, families, cone, (columns, rows)) | blocker_parameters(occluders)
        share = (1 - np.cos(min(np.pi, cone.half_angle + 2 * families.radius))) / 2
        step = max(1, int(LANES_PER_LAUNCH / max(len(families.middles), share * cells)))
        for first in range(0, count, step):
            found = _launch(train, parameters, poses.kernel(slice(first, first + step)), families, cells)
            by_outcome += np.array(found[0])
            best = np.maximum(best, np.array(found[1]))
            if progress is not None:
                progress(min(first + step, count), count)
    return SphereViews(
        poses_by_outcome=by_outcome.reshape(len(Outcome), cells), pixels_per_degree=best.astype(np.float64)
    )


@dataclass(frozen=True, kw_only=True)
class _Families:
    """Cells by the cell of a coarser sphere that they lie in.

    `middles`, shape (families, 3); `members`, shape (families, size): numbers of cells; `directions`, shape (families,
    size, 3): to their centres; `radius`: the largest angle between a family's middle and the centre of a member.
    """

    middles: FloatArray
    members: NDArray[np.int64]
    directions: FloatArray
    radius: float

    @classmethod
    def of(cls, nside: int, chosen: NDArray[np.int64] | None) -> _Families:
        coarse = max(1, nside // FAMILY)
        directions, middles = cell_directions(nside), cell_directions(coarse)
        family = cells_of(directions, coarse)
        members = np.argsort(family, kind="stable").reshape(len(middles), -1)
        if chosen is not None:
            wanted = np.unique(family[chosen])
            members, middles = members[wanted], middles[wanted]
        cosine = np.einsum("fmk,fk->fm", directions[members], middles).min()
        radius = float(np.arccos(np.clip(cosine, -1, 1)))
        return cls(middles=middles, members=members, directions=directions[members], radius=radius)


def _numbers(
    train: OpticalTrain, layout: Layout, families: _Families, cone: Cone, grid: tuple[int, int]
) -> dict[str, Any]:
    """Numbers for the kernels; mirrors in the body frame."""
    camera, turn = train.camera, layout.body_from_camera.rotation
    x, y, normal = (opaque_vector(axis) for axis in turn.apply(train.mirrors[0].axes.T))
    m1_outline, m2_outline = (mirror.parameters().outline for mirror in train.mirrors)
    m1_point = opaque_vector(layout.body_from_m1.translation)
    return {
        "gimbal": opaque_vector(layout.body_from_gimbal.translation),
        "camera": camera.parameters(),
        "port": train.port.parameters(),
        "size": [opaque(camera.width_px), opaque(camera.height_px)],
        "grid": [dr.opaque(UInt32, count) for count in grid],
        "resolution": Float32(pixels_per_degree(camera, train.port, *grid).astype(np.float32)),
        "body_from_camera": _matrix(turn.as_matrix()),
        "camera_from_body": _matrix(turn.inv().as_matrix()),
        "pinhole": opaque_vector(layout.body_from_camera.translation),
        "m1": MirrorPlane(point=m1_point, x=x, y=y, normal=normal, outline=m1_outline),
        "m2_outline": m2_outline,
        "cone_axis": opaque_vector(turn.apply(cone.axis)),
        "least_cosine": opaque(np.cos(min(np.pi, cone.half_angle + families.radius))),
        "middles": Array3f64(*to_columns(families.middles)),
        "members": UInt32(aligned(families.members, np.uint32)),
        "directions": Array3f64(*to_columns(families.directions.reshape(-1, 3))),
    }


def _matrix(values: FloatArray) -> Any:
    return Matrix3f64([[opaque(value) for value in row] for row in values])


def _launch(
    train: OpticalTrain, parameters: dict[str, Any], poses: dict[Group, Any], families: _Families, cells: int
) -> tuple[Any, Any]:
    """Decide all cells near the views of some poses: counts by outcome and cell, and the best resolution of each cell.

    Twice the lanes are thinned out, first to families of cells near a view, then to the cells in it: packets of rays
    that all hit triangles are several times as fast as those of which a few do.
    """
    near = _near_views(parameters, poses, families)
    counts, best = dr.zeros(UInt32, len(Outcome) * cells), dr.zeros(Float32, cells)
    lane = dr.arange(UInt32, dr.width(near) * families.members.shape[1])
    if dr.width(lane):
        lane = dr.compress(_look_back(train, parameters, poses, *_pairs(near, lane, families)).pointed)
    if dr.width(lane):
        pose, place = _pairs(near, lane, families)
        view = _look_back(train, parameters, poses, pose, place)
        outcome = _outcome(parameters, poses, pose, view)
        cell = dr.gather(UInt32, parameters["members"], place)
        dr.scatter_add(counts, UInt32(1), outcome * dr.opaque(UInt32, cells) + cell, view.pointed)
        seen = view.pointed & (outcome == UInt32(Outcome.SEEN))
        dr.scatter_reduce(dr.ReduceOp.Max, best, view.resolution, cell, seen)
        dr.eval(counts, best)
    return counts, best


def _near_views(parameters: dict[str, Any], poses: dict[Group, Any], families: _Families) -> Any:
    """Pairs of a pose and a family of cells at which the pose's mirrors may point: pose times families, and family."""
    count = dr.opaque(UInt32, len(families.middles))
    lane = dr.arange(UInt32, dr.width(poses[Group.TILT]) * len(families.middles))
    pose = lane // count
    axis = reflect(parameters["cone_axis"], parameters["m1"].normal)
    axis = reflect(axis, dr.gather(Array3f64, poses[Group.TILT][2], pose))
    middle = dr.gather(Array3f64, parameters["middles"], lane - pose * count)
    return dr.compress(dr.dot(axis, middle) >= parameters["least_cosine"])


def _pairs(near: Any, lane: Any, families: _Families) -> tuple[Any, Any]:
    """Kernel: pose of each lane, and its cell by the place in the table of families."""
    count, size = (dr.opaque(UInt32, number) for number in families.members.shape)
    position = lane // size
    family = dr.gather(UInt32, near, position)
    pose = family // count
    return pose, (family - pose * count) * size + (lane - position * size)


@dataclass(frozen=True, kw_only=True)
class _View:
    """Rays that show cells: Dr.Jit arrays.

    `pointed`: whether port and mirrors lead a ray of the image to the cell; `segments` of its path; `resolution`.
    """

    pointed: Any
    segments: tuple[Segment, Segment, Segment]
    resolution: Any


def _look_back(
    train: OpticalTrain, parameters: dict[str, Any], poses: dict[Group, Any], pose: Any, place: Any
) -> _View:
    """Kernel: the ray of the camera that shows each lane's cell."""
    towards = dr.gather(Array3f64, parameters["directions"], place)
    mirrors = (parameters["m1"], gaze_mirror_at(parameters, poses, pose))
    # A reflection is its own inverse.
    in_water = reflect(reflect(towards, mirrors[1].normal), parameters["m1"].normal)
    to_body = parameters["body_from_camera"]
    port, (model, distorted) = type(train.port), train.camera.kind
    in_air, found = _project_far(port, parameters["port"], parameters["camera_from_body"] @ in_water)
    u, v, valid = model.pixel(parameters["camera"], distorted, in_air)
    columns, rows = parameters["grid"]
    column, row = (
        (pixel + 0.5) / size * Float64(cells)
        for pixel, size, cells in zip((u, v), parameters["size"], (columns, rows), strict=True)
    )
    in_image = (column >= 0) & (column <= Float64(columns)) & (row >= 0) & (row <= Float64(rows))
    exit_ = port.trace(parameters["port"], in_air)
    point, direction = to_body @ exit_.point + parameters["pinhole"], to_body @ exit_.direction
    at_m1, at_m2 = reflect_over(mirrors, point, direction)
    pointed = found & valid & in_image & exit_.inside & exit_.transmitted & at_m1.front & at_m2.front
    cell = dr.minimum(UInt32(row), rows - 1) * columns + dr.minimum(UInt32(column), columns - 1)
    return _View(
        pointed=pointed,
        segments=(
            Segment(point, direction, at_m1.distance),
            Segment(at_m1.point, at_m1.direction, at_m2.distance),
            Segment(at_m2.point, at_m2.direction, Float64(dr.inf)),
        ),
        resolution=dr.gather(Float32, parameters["resolution"], cell, pointed),
    )


def _outcome(parameters: dict[str, Any], poses: dict[Group, Any], pose: Any, view: _View) -> Any:
    """Kernel: the first part in the way of each ray, or SEEN."""
    groups = {Group.FIXED: None, **axes_at(poses, pose)}
    outcome = UInt32(Outcome.SEEN)
    for segment in view.segments:
        free = view.pointed & (outcome == UInt32(Outcome.SEEN))
        stop = first_blocker(parameters, groups, segment, free)
        outcome = dr.select(free, stop.outcome, outcome)
    return outcome


def _project_far(port: type[Port], parameters: dict[str, Any], in_water: Any) -> tuple[Any, Any]:
    """Kernel: direction at the pinhole of the ray that goes on along `in_water` behind the port, and whether it exists.

    Two parallel planes keep n times the part of the direction along them, whatever their distances (Snell). Any other
    port is aimed at a point far away.
    """
    if port is FlatPort:
        normal = parameters["normal"]
        cosine = dr.dot(in_water, normal)
        tangent = (in_water - normal * cosine) * (parameters["n_water"] / parameters["n_inside"])
        square = 1 - dr.squared_norm(tangent)
        return tangent + normal * dr.safe_sqrt(square), (cosine > 0) & (square > 0)
    in_air, converged, outside = port.project(parameters, in_water * FAR_M)
    return in_air, converged & outside
