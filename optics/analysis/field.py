"""The camera's field behind port and M1: what all poses of the gaze mirror have in common.

The image is divided into `columns` x `rows` equal cells. A cell stands for the pixels in it: its ray is that of its
centre, its solid angle that of its four corners.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optics.analysis.fate import Fate, fate_of_role_table, fates_of_status
from optics.arrays import FloatArray, to_columns
from optics.backend import Array3f64, Bool, Float64
from optics.camera import Camera
from optics.layout import Layout
from optics.occlusion import Occluder, first_hit
from optics.port import NoPort, Port
from optics.train import OpticalTrain, pixel_grid

SKIN_M = 1e-4
"""Rays start and end this far from a surface along their way. Float32 at 1 m is good to 1e-7 m, so a ray that leaves
a mirror at up to 89.9 degrees from its normal does not hit that mirror's own plate."""


@dataclass(frozen=True, kw_only=True)
class FoldedField:
    """Rays behind M1, in the body frame, and what became of the others.

    Attributes
    ----------
    solid_angle_sr : array, shape (n,)
        Of every cell of the image in the water.
    fate : array, shape (n,)
        `Fate` of every cell up to M1; SEEN where the ray goes on from there.
    port_m : array, shape (k, 3)
        Points on the port's outer face at which the rays that go on began, in the order of the cells.
    origin_m, direction : arrays, shape (k, 3)
        Those rays behind M1: points on M1, unit vectors.
    cell : array, shape (k,)
        Their cells.
    blocked_at_m : array, shape (k,)
        Distance along such a ray at which a fixed part stops it; infinite where none does.
    blocked_by : array, shape (k,)
        `Fate` of a ray that is stopped there.
    """

    solid_angle_sr: FloatArray
    fate: NDArray[np.int32]
    port_m: FloatArray
    origin_m: FloatArray
    direction: FloatArray
    cell: NDArray[np.int64]
    blocked_at_m: FloatArray
    blocked_by: NDArray[np.uint32]


def pixel_solid_angles(camera: Camera, port: Port, columns: int | None = None, rows: int | None = None) -> FloatArray:
    """Solid angles of the cells of an image in the water, steradians, whether or not the port's rim hides them.

    Parameters
    ----------
    camera, port : Camera, Port
    columns, rows : int, optional
        Cells along each side; by default every pixel.

    Returns
    -------
    array, shape (rows * columns,)
        Row by row, as `optics.train.pixel_grid`. Zero where a corner has no direction in the water.

    Notes
    -----
    A cell is the quadrilateral of the directions of its corners, two spherical triangles (Van Oosterom & Strackee,
    IEEE Trans. Biomed. Eng. 30, 125, 1983). Flat mirrors keep solid angles.
    """
    columns, rows = columns or camera.width_px, rows or camera.height_px
    u = np.linspace(-0.5, camera.width_px - 0.5, columns + 1)
    v = np.linspace(-0.5, camera.height_px - 0.5, rows + 1)
    corners = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    rays = OpticalTrain(camera=camera, port=_without_rim(port)).trace(corners)
    directions = np.where((rays.status == 0)[:, np.newaxis], rays.direction, np.nan).reshape(rows + 1, columns + 1, 3)
    a, b, c, d = directions[:-1, :-1], directions[:-1, 1:], directions[1:, 1:], directions[1:, :-1]
    return np.nan_to_num(_triangle(a, b, c) + _triangle(a, c, d)).ravel()


def folded_field(train: OpticalTrain, layout: Layout, fixed: Occluder, columns: int, rows: int) -> FoldedField:
    """Trace the cells of the image over M1.

    Parameters
    ----------
    train : OpticalTrain
        Of the rig, at any pose: only its camera, port and first mirror are used.
    layout : Layout
    fixed : Occluder
        Parts that do not move, in the body frame.
    columns, rows : int
        Cells of the image.
    """
    pixels = pixel_grid(train.camera, columns, rows)
    behind_port = dataclasses.replace(train, mirrors=()).trace(pixels)
    behind_m1 = dataclasses.replace(train, mirrors=train.mirrors[:1]).trace(pixels)
    fate = fates_of_status(behind_m1.status)
    reached = np.flatnonzero(fate == Fate.SEEN)
    start, end = (layout.body_from_camera.apply(rays.origin_m[reached]) for rays in (behind_port, behind_m1))
    towards = layout.body_from_camera.rotation.apply(behind_port.direction[reached])
    distance, blocker = _blocked_by(fixed, start, towards, np.linalg.norm(end - start, axis=1))
    fate[reached] = np.where(np.isfinite(distance), blocker, fate[reached])
    going_on = np.isinf(distance)
    origin = end[going_on]
    direction = layout.body_from_camera.rotation.apply(behind_m1.direction[reached[going_on]])
    blocked_at, blocked_by = _blocked_by(fixed, origin, direction, np.full(len(origin), np.inf))
    return FoldedField(
        solid_angle_sr=pixel_solid_angles(train.camera, train.port, columns, rows),
        fate=fate,
        port_m=start[going_on],
        origin_m=origin,
        direction=direction,
        cell=reached[going_on],
        blocked_at_m=blocked_at,
        blocked_by=blocked_by,
    )


def _without_rim(port: Port) -> Port:
    return port if isinstance(port, NoPort) else dataclasses.replace(port, aperture_radius_m=None)  # type: ignore[type-var]


def _triangle(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Solid angle of a spherical triangle between unit vectors, shape (..., 3)."""
    volume = np.abs((a * np.cross(b, c)).sum(axis=-1))
    below = 1 + (a * b).sum(axis=-1) + (b * c).sum(axis=-1) + (c * a).sum(axis=-1)
    return np.asarray(2 * np.arctan2(volume, below))


def _blocked_by(
    fixed: Occluder, origin_m: FloatArray, direction: FloatArray, length_m: FloatArray
) -> tuple[FloatArray, NDArray[np.uint32]]:
    """Distance at which a fixed part stops rays between two surfaces, infinite where none does, and their fate."""
    if len(origin_m) == 0:
        return np.empty(0), np.empty(0, dtype=np.uint32)
    along = Array3f64(*to_columns(direction))
    start = Array3f64(*to_columns(origin_m)) + along * SKIN_M
    hit = first_hit(fixed.parameters(), start, along, Float64(length_m) - 2 * SKIN_M, Bool(True))
    distance = np.broadcast_to(np.array(hit.distance, dtype=np.float64), len(origin_m)) + SKIN_M
    role = np.broadcast_to(np.array(hit.role), len(origin_m))
    return distance, fate_of_role_table()[role]
