"""The optical train: camera, port and mirrors in a row, exact, in float64, in the camera frame.

`trace` follows pixels out into the water; `project` follows points back by unfolding: reflected over M2 and then
over M1 the mirrors are gone, and what is left is one port. Both are one compiled kernel for any number of rays.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import RigidTransform

from optics.camera import Camera, camera_from_spec
from optics.kernels.arrays import FloatArray, aligned, check_points, opaque, to_columns, to_rows
from optics.kernels.backend import Array3f64, Float64, Int32, UInt32, dr
from optics.kernels.freezing import frozen
from optics.layout import Layout, check_stows
from optics.mirror import PlaneMirror, reflect_over, unfold
from optics.mirror_outline import mirror_outline
from optics.ports.port import Port, port_from_spec
from optics.status import Region, Status
from rigs import Rig

StatusArray = NDArray[np.int32]

MISSED_MIRROR = (Status.MISSED_M1, Status.MISSED_M2)
LARGEST_MIRROR_COUNT = len(MISSED_MIRROR)


@dataclass(frozen=True, kw_only=True)
class Rays:
    """Rays behind the last surface they reached.

    Attributes
    ----------
    origin_m, direction : arrays, shape (n, 3)
        Camera frame; directions are unit vectors. Where the status is not OK, of the last surface passed.
    status : array, shape (n,)
        `Status` of each ray.
    """

    origin_m: FloatArray
    direction: FloatArray
    status: StatusArray

    def __getitem__(self, chosen: Any) -> Rays:
        """Some of the rays, by mask, indices or slice."""
        return Rays(origin_m=self.origin_m[chosen], direction=self.direction[chosen], status=self.status[chosen])

    @property
    def passed(self) -> NDArray[np.bool_]:
        """Which rays got through the whole train."""
        return np.asarray(self.status == Status.OK)

    def moved(self, pose: RigidTransform) -> Rays:
        """The same rays in another frame, in which the camera (or what else they are given in) has this pose."""
        return replace(self, origin_m=pose.apply(self.origin_m), direction=pose.rotation.apply(self.direction))

    @property
    def region(self) -> StatusArray:
        """`Region` of each ray; the back of a mirror is part of the direct view (M1) or the fold view (M2)."""
        return regions(self.status)


@dataclass(frozen=True, kw_only=True)
class Image:
    """Projected points.

    Attributes
    ----------
    pixels : array, shape (n, 2)
        (u, v); NaN where there is no such pixel (status INVALID_INPUT, INSIDE_HOUSING, NOT_CONVERGED,
        OUTSIDE_CAMERA_MODEL, and BACK_OF_MIRROR with one of these). Other failures keep the pixel at which the
        point would appear if nothing were in the way.
    status : array, shape (n,)
        `Status` of each point; OK means that the camera sees it.
    """

    pixels: FloatArray
    status: StatusArray


@dataclass(frozen=True, kw_only=True)
class OpticalTrain:
    """Camera, port and up to two mirrors (M1, then M2), all in the camera frame."""

    camera: Camera
    port: Port
    mirrors: Sequence[PlaneMirror] = ()

    def __post_init__(self) -> None:
        if len(self.mirrors) > LARGEST_MIRROR_COUNT:
            raise ValueError(f"expected at most {LARGEST_MIRROR_COUNT} mirrors, got {len(self.mirrors)}")

    @classmethod
    def from_rig(cls, rig: Rig, *, q1: float = 0.0, q2: float = 0.0, stowed: bool = False) -> OpticalTrain:
        """Train of a rig at joint values in radians; with the fold mirror stowed, that of the camera alone.

        Raises
        ------
        ValueError
            Outside the joint limits, and when a fold mirror that is fixed is to be stowed.
        """
        bare = cls.bare(rig)
        if stowed:
            check_stows(rig)
        if rig.gaze is None or stowed:
            return bare
        layout = Layout.from_rig(rig)
        layout.check_joints(q1, q2)
        poses = (layout.camera_from_m1, layout.camera_from_m2(q1, q2))
        mirrors = tuple(
            PlaneMirror.from_pose(pose, mirror_outline(plate))
            for pose, plate in zip(poses, (rig.gaze.fold_mirror, rig.gaze.gaze_mirror), strict=True)
        )
        return replace(bare, mirrors=mirrors)

    @classmethod
    def bare(cls, rig: Rig) -> OpticalTrain:
        """Camera and port of a rig, without its mirrors."""
        return cls(camera=camera_from_spec(rig.camera), port=port_from_spec(rig.port, rig.water))

    def without_mirrors(self) -> OpticalTrain:
        """Camera and port alone."""
        return replace(self, mirrors=())

    def unbounded(self) -> OpticalTrain:
        """The same train without the port's rim and the mirrors' edges."""
        mirrors = tuple(replace(mirror, outline=None) for mirror in self.mirrors)
        return replace(self, port=self.port.without_rim(), mirrors=mirrors)

    @property
    def kind(self) -> tuple[Any, ...]:
        """What the compiled kernels depend on; everything else is their input."""
        return (*self.camera.kind, type(self.port), tuple(mirror.outline_kind for mirror in self.mirrors))

    def parameters(self) -> dict[str, Any]:
        """Numbers of the train for the kernels."""
        return dict(self._parameters)

    @cached_property
    def _parameters(self) -> dict[str, Any]:
        return {
            "camera": self.camera.parameters(),
            "port": self.port.parameters(),
            "mirrors": [mirror.parameters() for mirror in self.mirrors],
            "size": [opaque(self.camera.width_px - 0.5), opaque(self.camera.height_px - 0.5)],
        }

    def trace(self, pixels: ArrayLike) -> Rays:
        """Follow pixels, shape (n, 2), through the port and over the mirrors into the water."""
        pixels = check_points("pixels", pixels, 2)
        if not len(pixels):
            return _no_rays()
        return self._traced(self.parameters(), to_columns(pixels))

    def trace_poses(self, pixels: ArrayLike, camera_from_m2: ArrayLike) -> Rays:
        """Follow pixels at many poses of M2 in one kernel.

        Parameters
        ----------
        pixels : array, shape (n, 2)
        camera_from_m2 : array, shape (k, 4, 4)
            Poses of M2 in place of the train's own (`Layout.camera_from_m2_at`); its outline stays.

        Returns
        -------
        Rays
            Pose by pose, arrays of shape (k * n, ...).
        """
        if len(self.mirrors) != LARGEST_MIRROR_COUNT:
            raise ValueError(f"expected a train of {LARGEST_MIRROR_COUNT} mirrors, got {len(self.mirrors)}")
        pixels, poses = check_points("pixels", pixels, 2), np.asarray(camera_from_m2, dtype=np.float64)
        if not len(pixels) * len(poses):
            return _no_rays()
        # Lanes are gathered into memory of Dr.Jit's own: a kernel is recorded for each alignment of NumPy's arrays.
        lane, count = dr.arange(UInt32, len(poses) * len(pixels)), dr.opaque(UInt32, len(pixels))
        pose, table = lane // count, Float64(aligned(poses[:, :3], np.float64))
        u, v = (dr.gather(Float64, column, lane - pose * count) for column in to_columns(pixels))
        x, y, normal, point = (
            Array3f64(*(dr.gather(Float64, table, pose * 12 + 4 * row + column) for row in range(3)))
            for column in range(4)
        )
        dr.eval(u, v, x, y, normal, point)
        parameters = self.parameters()
        m1, m2 = parameters["mirrors"]
        parameters["mirrors"] = [m1, replace(m2, point=point, x=x, y=y, normal=normal)]
        return self._traced(parameters, [u, v])

    def _traced(self, parameters: dict[str, Any], pixels: list[Any]) -> Rays:
        origin, direction, status = compiled_trace(*self.kind)(parameters, *pixels)
        return Rays(origin_m=to_rows(origin), direction=to_rows(direction), status=np.array(status))

    def transmittance(self, pixels: ArrayLike) -> FloatArray:
        """Fresnel transmittance of the port for pixels, shape (n, 2); 0 where the ray does not get out of it."""
        pixels = check_points("pixels", pixels, 2)
        if not len(pixels):
            return np.empty(0)
        passed = compiled_transmittance(*self.kind[:3])(self.parameters(), *to_columns(pixels))
        return np.array(passed)

    def project(self, points_m: ArrayLike) -> Image:
        """Find where points, shape (n, 3), camera frame, metres, appear through the whole train."""
        points_m = check_points("points_m", points_m, 3)
        if not len(points_m):
            return Image(pixels=np.empty((0, 2)), status=np.empty(0, dtype=np.int32))
        u, v, status = compiled_project(*self.kind)(self.parameters(), Array3f64(*to_columns(points_m)))
        return Image(pixels=to_rows((u, v)), status=np.array(status))


def _no_rays() -> Rays:
    # An empty batch never reaches Dr.Jit, whose frozen functions end the process when they meet an array of width 0.
    empty = np.empty((0, 3))
    return Rays(origin_m=empty, direction=empty.copy(), status=np.empty(0, dtype=np.int32))


def pixel_grid(camera: Camera, columns: int | None = None, rows: int | None = None) -> FloatArray:
    """Pixels that tile the image evenly, row by row, shape (rows * columns, 2); by default every pixel's centre."""
    columns, rows = columns or camera.width_px, rows or camera.height_px
    u = (np.arange(columns) + 0.5) * camera.width_px / columns - 0.5
    v = (np.arange(rows) + 0.5) * camera.height_px / rows - 0.5
    return np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)


def regions(status: StatusArray) -> StatusArray:
    """`Region` of rays that passed a train of two mirrors, from their status."""
    region = np.full(status.shape, Region.GAZE, dtype=np.int32)
    outside = (Status.MISSED_PORT, Status.TOTAL_REFLECTION, Status.OUTSIDE_CAMERA_MODEL, Status.INVALID_INPUT)
    region[np.isin(status, outside)] = Region.HOUSING
    region[status == Status.MISSED_M1] = Region.DIRECT
    region[(status == Status.MISSED_M2) | (status == Status.BACK_OF_MIRROR)] = Region.FOLD
    return region


@cache
def compiled_trace(
    camera: type[Camera], distorted: bool, port: type[Port], outlines: tuple[Any, ...]
) -> Callable[..., Any]:
    """Frozen kernel of `OpticalTrain.trace` for one kind of train."""

    @frozen()
    def trace(parameters: dict[str, Any], u: Any, v: Any) -> tuple[Any, Any, Any]:
        direction, valid = camera.direction(parameters["camera"], distorted, u, v)
        status = dr.select(dr.isfinite(u + v), Int32(Status.OK), Int32(Status.INVALID_INPUT))
        return follow(port, parameters, direction, _where_ok(status, ~valid, Status.OUTSIDE_CAMERA_MODEL))

    return trace


@cache
def compiled_transmittance(camera: type[Camera], distorted: bool, port: type[Port]) -> Callable[..., Any]:
    """Frozen kernel of `OpticalTrain.transmittance`; apart from the trace's, which it would slow down by a fifth."""

    @frozen()
    def transmittance(parameters: dict[str, Any], u: Any, v: Any) -> Any:
        direction, valid = camera.direction(parameters["camera"], distorted, u, v)
        # Multiplied by one per ray: without a port the transmittance would be one number for all.
        return port.trace(parameters["port"], direction).transmittance * dr.select(valid & dr.isfinite(u + v), 1.0, 0.0)

    return transmittance


@cache
def compiled_project(
    camera: type[Camera], distorted: bool, port: type[Port], outlines: tuple[Any, ...]
) -> Callable[..., Any]:
    """Frozen kernel of `OpticalTrain.project` for one kind of train."""

    @frozen()
    def project(parameters: dict[str, Any], points: Any) -> tuple[Any, Any, Any]:
        image = points
        for mirror in reversed(parameters["mirrors"]):
            image = unfold(mirror, image)
        direction, converged, in_water = port.project(parameters["port"], image)
        u, v, valid = camera.pixel(parameters["camera"], distorted, direction)
        finite = dr.isfinite(dr.sum(points))
        has_pixel = finite & in_water & converged & valid
        status = dr.select(finite, Int32(Status.OK), Int32(Status.INVALID_INPUT))
        if parameters["mirrors"]:
            last = parameters["mirrors"][-1]
            behind = dr.dot(points - last.point, last.normal) <= 0
            status = _where_ok(status, behind, Status.BACK_OF_MIRROR)
        status = _where_ok(status, ~in_water, Status.INSIDE_HOUSING)
        status = _where_ok(status, ~converged, Status.NOT_CONVERGED)
        status = _where_ok(status, ~valid, Status.OUTSIDE_CAMERA_MODEL)
        width, height = parameters["size"]
        outside = (u < -0.5) | (u > width) | (v < -0.5) | (v > height)
        origin, outgoing, status = follow(port, parameters, direction, status)
        status = _where_ok(status, dr.dot(points - origin, outgoing) <= 0, Status.BACK_OF_MIRROR)
        status = _where_ok(status, outside, Status.OUTSIDE_IMAGE)
        return dr.select(has_pixel, u, dr.nan), dr.select(has_pixel, v, dr.nan), status

    return project


def follow(port: type[Port], parameters: dict[str, Any], direction: Any, status: Any) -> tuple[Any, Any, Any]:
    """Kernel: rays from the pinhole through the port and over the mirrors.

    Returns the point and direction at the last surface passed, and the status.
    """
    exit_ = port.trace(parameters["port"], direction)
    status = _where_ok(status, ~exit_.transmitted, Status.TOTAL_REFLECTION)
    status = _where_ok(status, ~exit_.inside, Status.MISSED_PORT)
    point, outgoing = exit_.point, exit_.direction
    for hit, missed in zip(reflect_over(parameters["mirrors"], point, outgoing), MISSED_MIRROR, strict=False):
        status = _where_ok(status, hit.back, Status.BACK_OF_MIRROR)
        status = _where_ok(status, ~hit.front, missed)
        alive = status == Int32(Status.OK)
        point, outgoing = dr.select(alive, hit.point, point), dr.select(alive, hit.direction, outgoing)
    return point, outgoing, status


def _where_ok(status: Any, condition: Any, failure: Status) -> Any:
    return dr.select((status == Int32(Status.OK)) & condition, Int32(failure), status)
