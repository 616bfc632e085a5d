"""Motion vectors: where the point that a pixel shows appears in another state, through the same port and mirrors.

A point moves with what it is fixed to (`scenes.truth.carriers`). It is projected by unfolding, as
`OpticalTrain.project` does, with the mirrors of its pixel's region, all pixels and regions in one float64 kernel.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from functools import cache, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.camera import Camera
from optics.kernels.arrays import opaque
from optics.kernels.backend import Array3f64, Float32, Float64, Int32, UInt32, dr
from optics.kernels.freezing import frozen
from optics.mirror import MirrorPlane, intersect
from optics.ports.interface import Exit, Port
from optics.status import Region
from optics.train import OpticalTrain, pixel_grid
from rigs import Rig
from scenes.stage.frame import FloatImage, Frame
from scenes.stage.state import State
from scenes.truth.carriers import Carrier, world_from_camera, world_from_carriers
from scenes.truth.virtual_view import aligned, passes, unfolded, vectors


class Seen(IntEnum):
    """What becomes of a pixel's point in the other state."""

    YES = 0
    """Seen there through the same region; without the other frame, nothing but a mirror's plate counts as hiding it."""
    LEFT_IMAGE = 1
    HIDDEN = 2
    """Something stands before it there: a mirror's plate, or what the other frame shows nearer on that path."""
    OTHER_REGION = 3
    """The pixel where the region's train would show it looks another way there: past a mirror, or at the housing."""
    NO_IMAGE = 4
    """The region's train has no pixel for it: behind the mirror, or beyond the camera model."""
    NO_POINT = 5
    """This pixel shows no point that could move: open water, the housing, or something over a further reflection."""


SAME_SURFACE = 1e-3
"""Relative difference of path lengths up to which the other frame shows the point itself. Between the four pixels
around it a surface bends by some 1e-5 of its distance; thinner gaps than this are not told apart."""

PLATE_SLACK_M = 1e-4
"""A plate this little before a point is the one it lies on: single precision at the scale of a world, with room."""


@dataclass(frozen=True, kw_only=True)
class Motion:
    """From one frame's pixels to another state; shape (height, width).

    Attributes
    ----------
    du_px, dv_px : float32
        From the pixel's centre to where its point appears in the other state, in pixels of the frame, right and down;
        nan for `NO_IMAGE` and `NO_POINT`. Where the point is hidden or outside, the vector points to where it would be.
    seen : uint8
        `Seen`.
    """

    du_px: FloatImage
    dv_px: FloatImage
    seen: NDArray[np.uint8]


def motion(
    frame: Frame,
    carrier: NDArray[np.uint8],
    rig: Rig,
    *,
    state: State,
    other_state: State,
    other_frame: Frame | None = None,
) -> Motion:
    """Motion of every pixel's point from `state`, in which `frame` was rendered, to another state.

    Parameters
    ----------
    frame : Frame
        One sample per pixel: vectors start at the pixels' centres.
    carrier : array, shape (height, width)
        `Carrier` of every pixel's point.
    rig : Rig
    state, other_state : State
        With the robot's pose.
    other_frame : Frame, optional
        The other state's frame, of the same size, to tell what is hidden there.
    """
    shape = frame.region.shape
    if carrier.shape != shape:
        raise ValueError(f"expected a carrier for each of {shape} pixels, got {carrier.shape}")
    if other_frame is not None and other_frame.region.shape != shape:
        raise ValueError(f"expected frames of one size, got {shape} and {other_frame.region.shape}")
    train = OpticalTrain.from_rig(rig, q1=other_state.q1, q2=other_state.q2)
    known, table = _carried(rig, state, other_state)
    rows, columns = shape
    scale = [columns / train.camera.width_px, rows / train.camera.height_px]
    u, v = _centres(rig, rows, columns)
    lanes = {
        "point": vectors(frame.point_m),
        "region": UInt32(aligned(frame.region, np.uint32)),
        "carrier": UInt32(aligned(np.where(known[carrier], carrier, 0), np.uint32)),
        "u": u,
        "v": v,
    }
    shown = None
    if other_frame is not None:
        shown = {
            "distance": Float32(aligned(other_frame.distance_m, np.float32)),
            "region": UInt32(aligned(other_frame.region, np.uint32)),
            "columns": dr.opaque(Int32, columns),
            "rows": dr.opaque(Int32, rows),
        }
    kernel = compiled_motion(*train.kind, shown is not None)
    du, dv, seen = kernel(
        train.parameters(), lanes, Float64(aligned(table, np.float64)), [opaque(s) for s in scale], shown
    )
    return Motion(
        du_px=np.array(du).reshape(shape),
        dv_px=np.array(dv).reshape(shape),
        seen=np.array(seen).astype(np.uint8).reshape(shape),
    )


def _carried(rig: Rig, state: State, other_state: State) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Which carriers are known in both states, and rows of other-camera-from-world for points carried by each."""
    before, after = world_from_carriers(rig, state), world_from_carriers(rig, other_state)
    camera_from_world = world_from_camera(rig, other_state).inv()
    known = np.zeros(max(Carrier) + 1, dtype=bool)
    table = np.zeros((len(known), 12))
    for carrier in before.keys() & after.keys():
        known[carrier] = True
        moved = camera_from_world * after[carrier] * before[carrier].inv()
        table[carrier] = moved.as_matrix()[:3].ravel()
    return known, table.ravel()


@lru_cache(maxsize=4)
def _centres(rig: Rig, rows: int, columns: int) -> list[Any]:
    pixels = pixel_grid(OpticalTrain.from_rig(rig).camera, columns, rows)
    return [Float64(aligned(column, np.float64)) for column in pixels.T]


@cache
def compiled_motion(
    camera: type[Camera], distorted: bool, port: type[Port], outlines: tuple[Any, ...], with_frame: bool
) -> Callable[..., Any]:
    """Frozen kernel of `motion` for one kind of train, with or without the other frame."""

    @frozen()
    def moved(parameters: dict[str, Any], lanes: dict[str, Any], table: Any, scale: list[Any], shown: Any) -> Any:
        region = lanes["region"]
        world_point = Array3f64(lanes["point"])
        point = _carry(table, lanes["carrier"], world_point)
        has_point = (lanes["carrier"] != int(Carrier.NOTHING)) & dr.isfinite(dr.sum(world_point))
        has_point = has_point & (region != int(Region.HOUSING))
        image = unfolded(parameters["mirrors"], region, point)
        direction, converged, in_water = port.project(parameters["port"], image)
        u, v, valid = camera.pixel(parameters["camera"], distorted, direction)
        has_image = has_point & converged & in_water & valid & ~_behind(parameters["mirrors"], region, point)
        exit_ = port.trace(parameters["port"], direction)
        path = dr.norm(image - exit_.point)
        leaves = has_image & exit_.transmitted & exit_.inside
        passed, plate = _walk(parameters["mirrors"], exit_, region, path, leaves)
        hidden = plate
        if with_frame:
            at = ((u + 0.5) * scale[0] - 0.5, (v + 0.5) * scale[1] - 0.5)
            hidden = hidden | _hidden_in(shown, at, region, path, leaves)
        width, height = parameters["size"]
        seen = dr.select(hidden, UInt32(int(Seen.HIDDEN)), UInt32(int(Seen.YES)))
        looks_there = leaves & (passed + int(Region.DIRECT) == region)
        seen = dr.select(looks_there, seen, int(Seen.OTHER_REGION))
        outside = (u < -0.5) | (u > width) | (v < -0.5) | (v > height)
        seen = dr.select(outside, int(Seen.LEFT_IMAGE), seen)
        seen = dr.select(has_image, seen, int(Seen.NO_IMAGE))
        seen = dr.select(has_point, seen, int(Seen.NO_POINT))
        du, dv = (u - lanes["u"]) * scale[0], (v - lanes["v"]) * scale[1]
        return Float32(dr.select(has_image, du, dr.nan)), Float32(dr.select(has_image, dv, dr.nan)), seen

    return moved


def _carry(table: Any, carrier: Any, point: Any) -> Any:
    """Kernel: points moved with their carriers, into the other state's camera frame."""
    first = carrier * 12
    entry = [dr.gather(Float64, table, first + index) for index in range(12)]
    return Array3f64(
        *(
            entry[4 * row] * point.x + entry[4 * row + 1] * point.y + entry[4 * row + 2] * point.z + entry[4 * row + 3]
            for row in range(3)
        )
    )


def _behind(mirrors: list[MirrorPlane], region: Any, point: Any) -> Any:
    """Kernel: whether points lie behind the last mirror of their region."""
    behind = region < 0
    for position, mirror in enumerate(mirrors):
        last = region == int(Region.FOLD) + position
        behind = behind | (last & (dr.dot(point - mirror.point, mirror.normal) <= 0))
    return behind


def _walk(mirrors: list[MirrorPlane], exit_: Exit, region: Any, path: Any, active: Any) -> tuple[Any, Any]:
    """Kernel: how many mirrors rays pass, in order, before a path length, and whether a plate stops them on it.

    Nothing else is asked: hull, mount and world are the renderer's.
    """
    passed = dr.select(active, UInt32(0), UInt32(0))
    stopped = active & ~active
    going, left, origin, direction = active, path, exit_.point, exit_.direction
    for step in range(len(mirrors) + 1):
        nearest, passes_on, next_origin, next_direction = Float64(dr.inf), stopped & ~stopped, origin, direction
        for position, mirror in enumerate(mirrors):
            if position == step - 1:
                continue  # the one that the ray comes from
            hit = intersect(mirror, origin, direction)
            # A point that touches a mirror is seen over it if its region says so, and else is not hidden by it.
            over_it = passes(region, position) if position == step else stopped & ~stopped
            limit = dr.select(over_it, left + PLATE_SLACK_M, left - PLATE_SLACK_M)
            nearer = going & (hit.front | hit.back) & (hit.distance < dr.minimum(limit, nearest))
            nearest = dr.select(nearer, hit.distance, nearest)
            if position == step:
                passes_on = dr.select(nearer, hit.front, passes_on)
                next_origin = dr.select(nearer, hit.point, next_origin)
                next_direction = dr.select(nearer, hit.direction, next_direction)
            else:
                passes_on = passes_on & ~nearer
        stopped = stopped | (going & dr.isfinite(nearest) & ~passes_on)
        going = going & passes_on
        passed = dr.select(going, passed + 1, passed)
        left = dr.select(going, left - nearest, left)
        origin, direction = dr.select(going, next_origin, origin), dr.select(going, next_direction, direction)
    return passed, stopped


def _hidden_in(shown: dict[str, Any], at: tuple[Any, Any], region: Any, path: Any, active: Any) -> Any:
    """Kernel: whether another frame shows something nearer at a place (u, v) than a path length.

    The farthest of the four pixels around counts, so that a slanted surface does not hide itself; pixels of other
    regions tell nothing.
    """
    u, v = at
    farthest = Float32(0)
    for step_u in range(2):
        for step_v in range(2):
            column = dr.clip(Int32(dr.floor(u)) + step_u, 0, shown["columns"] - 1)
            row = dr.clip(Int32(dr.floor(v)) + step_v, 0, shown["rows"] - 1)
            index = UInt32(row * shown["columns"] + column)
            same = dr.gather(UInt32, shown["region"], index, active) == region
            distance = dr.gather(Float32, shown["distance"], index, active & same)
            farthest = dr.maximum(farthest, dr.select(same, distance, 0))
    return active & (farthest > 0) & (path > Float64(farthest) * (1 + SAME_SURFACE))
