"""What a pixel shows as its virtual camera sees it: z-depth, normal, and whether the region's train is all there was.

The virtual camera of a region is the real one reflected over the mirrors of that region: none (direct), M1 (fold), M1
and then M2 (gaze). Instead of moving the camera the point is unfolded, reflected over M2 and then over M1, into the
real camera's frame: the coordinates are the same.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from optics.kernels.arrays import opaque_vector
from optics.kernels.backend import Array3f32, Array3f64, Float32, Float64, UInt32, dr
from optics.kernels.freezing import frozen
from optics.mirror import MirrorPlane, unfold
from optics.status import Region
from optics.train import OpticalTrain, Rays, pixel_grid
from rigs import Rig
from scenes.stage.frame import FloatImage, Frame

SMALLEST_DEVIATION_M = 1e-4
"""A point less than this off the straight unfolded ray is on it: single precision at 500 m from the world's origin
leaves 3e-5 m."""

ON_THE_RAY = 0.1
"""At least this share of the pixels is taken to show what their region's train leads to; by it a frame's own deviation
is known, which is none at one sample a pixel, and that of the first sample from the centre at more."""

SAMPLED_PIXELS = 10_000
"""Number of pixels from which it is found well enough."""

SPREAD_OF_PITCH = 4.0
"""An offset in pixels is another angle at the image's edge than in its middle, by less than this."""

ALIGNMENT = 64
"""Bytes: as wide as the widest vector registers."""


@dataclass(frozen=True, kw_only=True)
class VirtualView:
    """Arrays of shape (height, width), with a last axis where said.

    Attributes
    ----------
    z_depth_m : float32
        Along the optical axis of the region's virtual camera, from its pinhole; inf where no point is seen.
    normal : float32, (..., 3)
        `Frame.normal` in the axes of the region's virtual camera (x right, y down, z forward).
    further_reflection : bool
        The point was seen over a reflection beyond those of the region: the sea surface from below, or a mirror in
        another order. The region's train does not lead to it.
    """

    z_depth_m: FloatImage
    normal: FloatImage
    further_reflection: NDArray[np.bool_]


@lru_cache(maxsize=4)
def exit_rays(rig: Rig, rows: int, columns: int) -> Rays:
    """Exact rays behind the port; they depend neither on the joints nor on the pose, so they are kept."""
    train = OpticalTrain.bare(rig)
    return train.trace(pixel_grid(train.camera, columns, rows))


def virtual_view(frame: Frame, rig: Rig, train: OpticalTrain, camera_from_world: RigidTransform) -> VirtualView:
    """Unfold every pixel's point and normal over the mirrors of its region.

    Parameters
    ----------
    frame : Frame
    rig : Rig
    train : OpticalTrain
        The rig's, at the joint values of the frame.
    camera_from_world : RigidTransform
        Pose of the world in the real camera's frame.
    """
    shape = frame.region.shape
    parameters = {
        "mirrors": [mirror.parameters() for mirror in train.mirrors],
        "camera_from_world": pose_rows(camera_from_world),
    }
    kernel = compiled_unfolding(tuple(mirror.outline_kind for mirror in train.mirrors))
    lanes = {
        "point": vectors(frame.point_m),
        "normal": vectors(frame.normal),
        "distance": Float32(aligned(frame.distance_m, np.float32)),
        "region": UInt32(aligned(frame.region, np.uint32)),
        **_exit_columns(rig, *shape),
    }
    z, normal, deviation = kernel(parameters, lanes)
    pitch = train.camera.width_px / shape[1] / train.camera.fx_px
    off = np.array(deviation).reshape(shape)
    return VirtualView(
        z_depth_m=np.array(z).reshape(shape),
        normal=np.stack([np.array(component) for component in normal], axis=-1).reshape(*shape, 3),
        further_reflection=_leaves_the_ray(off, frame.distance_m, pitch),
    )


def _leaves_the_ray(off_m: FloatImage, distance_m: FloatImage, pitch: float) -> NDArray[np.bool_]:
    """Which points are farther off their rays than the frame's own sampling explains; nan where there is no point."""
    # Open water lies at an infinite distance, the housing at none: neither has a point, nor an angle.
    with np.errstate(invalid="ignore", divide="ignore"):
        angle = off_m / distance_m
        some = angle.ravel()[:: 1 + angle.size // SAMPLED_PIXELS]
        known = some[np.isfinite(some)]
        typical = min(SPREAD_OF_PITCH * float(np.quantile(known, ON_THE_RAY)), pitch) if known.size else 0.0
        return np.asarray(off_m > SMALLEST_DEVIATION_M + typical * distance_m)


@lru_cache(maxsize=4)
def _exit_columns(rig: Rig, rows: int, columns: int) -> dict[str, Any]:
    rays = exit_rays(rig, rows, columns)
    return {
        "exit_point": Array3f64(*(Float64(aligned(column, np.float64)) for column in rays.origin_m.T)),
        "exit_direction": Array3f64(*(Float64(aligned(column, np.float64)) for column in rays.direction.T)),
    }


@cache
def compiled_unfolding(outlines: tuple[Any, ...]) -> Callable[..., Any]:
    """Frozen kernel of `virtual_view` for mirrors with these outlines."""

    @frozen()
    def unfolding(parameters: dict[str, Any], lanes: dict[str, Any]) -> tuple[Any, Any, Any]:
        mirrors, region = parameters["mirrors"], lanes["region"]
        image = unfolded(mirrors, region, placed(parameters["camera_from_world"], Array3f64(lanes["point"])))
        rows = parameters["camera_from_world"]["rows"]
        normal = Array3f64(lanes["normal"])
        normal = Array3f64(*(dr.dot(row, normal) for row in rows))
        for position, mirror in reversed(list(enumerate(mirrors))):
            reflected = normal - mirror.normal * (2 * dr.dot(normal, mirror.normal))
            normal = dr.select(passes(region, position), reflected, normal)
        distance = Float64(lanes["distance"])
        expected = lanes["exit_point"] + lanes["exit_direction"] * distance
        seen = dr.isfinite(distance) & dr.isfinite(dr.sum(image))
        off = dr.select(seen, dr.norm(image - expected), dr.nan)
        z = dr.select(seen, image.z, dr.inf)
        return Float32(z), Array3f32(normal), Float32(off)

    return unfolding


def passes(region: Any, position: int) -> Any:
    """Kernel: whether the train of a region goes over the mirror at a position (M1 is 0)."""
    return region >= int(Region.FOLD) + position


def unfolded(mirrors: list[MirrorPlane], region: Any, point: Any) -> Any:
    """Kernel: points of the camera frame, reflected over the mirrors of their region, the last one first."""
    for position, mirror in reversed(list(enumerate(mirrors))):
        point = dr.select(passes(region, position), unfold(mirror, point), point)
    return point


def placed(pose: dict[str, Any], point: Any) -> Any:
    """Kernel: points carried into the frame of a pose."""
    return Array3f64(*(dr.dot(row, point) for row in pose["rows"])) + pose["shift"]


def pose_rows(transform: RigidTransform) -> dict[str, Any]:
    """Pose for the kernels, in double precision."""
    matrix = transform.as_matrix()
    return {"rows": [opaque_vector(row) for row in matrix[:3, :3]], "shift": opaque_vector(matrix[:3, 3])}


def vectors(image: NDArray[np.float32]) -> Any:
    """An image of 3-vectors as a Dr.Jit array."""
    flat = image.reshape(-1, 3)
    return Array3f32(*(Float32(aligned(flat[:, axis], np.float32)) for axis in range(3)))


def aligned(values: NDArray[Any], dtype: type[np.generic]) -> NDArray[Any]:
    """Flat copy that begins at a multiple of 64 bytes.

    Dr.Jit takes NumPy's memory as it is, and records a frozen kernel again for every pattern of aligned and unaligned
    inputs that it meets.
    """
    size = values.size * np.dtype(dtype).itemsize
    room = np.empty(size + ALIGNMENT, dtype=np.uint8)
    start = -room.ctypes.data % ALIGNMENT
    copy = room[start : start + size].view(dtype)
    copy[:] = values.ravel()
    return copy
