"""The camera's field behind port and M1: what all poses of the gaze mirror have in common.

The image is divided into `columns` x `rows` equal cells. A cell stands for the pixels in it: its ray is that of its
centre, its solid angle that of its four corners.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from optics.camera import Camera
from optics.coverage.outcome import Outcome, outcomes_at_parts, outcomes_of_status
from optics.kernels.arrays import FloatArray, to_columns
from optics.kernels.backend import Array3f64, Bool, Float64
from optics.layout import Layout
from optics.occlusion import Occluder, first_hit
from optics.ports.port import Port
from optics.train import OpticalTrain, Rays, pixel_grid

SKIN_M = 1e-4
"""Rays start and end this far from a surface along their path. Float32 at 1 m is good to 1e-7 m, so a ray that leaves
a mirror at up to 89.9 degrees from its normal does not hit that mirror's own plate."""


@dataclass(frozen=True, kw_only=True)
class FoldedField:
    """Rays of the image's cells as far as they are the same at all poses, in the body frame.

    Attributes
    ----------
    solid_angle_sr : array, shape (n,)
        Of every cell of the image in the water.
    outcome : array, shape (n,)
        `Outcome` of every cell by port and M1 alone: SEEN where M1 sends its ray on, MISSED_M1 for the direct view.
    cell : array, shape (k,)
        Cells whose rays leave the port; the arrays below follow their order.
    folded : array, shape (k,)
        Whether the ray hits M1's face; else it belongs to the direct view.
    port_m, port_direction : arrays, shape (k, 3)
        Points on the port's outer face, unit vectors.
    length_m : array, shape (k,)
        From there to M1; infinite in the direct view.
    origin_m, direction : arrays, shape (k, 3)
        Rays behind M1: points on M1, unit vectors. Those at the port in the direct view.
    before : Stops
        What of the fixed parts stops the rays between port and M1, or in the direct view anywhere.
    behind : Stops
        What of the fixed parts stops the rays behind M1, were there no M2.
    """

    solid_angle_sr: FloatArray
    outcome: NDArray[np.int32]
    cell: NDArray[np.int64]
    folded: NDArray[np.bool_]
    port_m: FloatArray
    port_direction: FloatArray
    length_m: FloatArray
    origin_m: FloatArray
    direction: FloatArray
    before: Stops
    behind: Stops


@dataclass(frozen=True)
class Stops:
    """Where rays are stopped, metres along them (infinite: nowhere), and the `Outcome` of those that are, (k,)."""

    distance_m: FloatArray
    outcome: NDArray[np.uint32]


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
    rays = OpticalTrain(camera=camera, port=port).unbounded().trace(corners)
    directions = np.where(rays.passed[:, np.newaxis], rays.direction, np.nan).reshape(rows + 1, columns + 1, 3)
    a, b, c, d = directions[:-1, :-1], directions[:-1, 1:], directions[1:, 1:], directions[1:, :-1]
    return np.nan_to_num(_triangle(a, b, c) + _triangle(a, c, d)).ravel()


def pixels_per_degree(camera: Camera, port: Port, columns: int | None = None, rows: int | None = None) -> FloatArray:
    """Resolution in the water of the cells of an image: the root of the pixels per solid angle, along a degree.

    Flat mirrors keep it. Shape (rows * columns,); zero where a cell has no direction in the water.
    """
    columns, rows = columns or camera.width_px, rows or camera.height_px
    solid_angle = pixel_solid_angles(camera, port, columns, rows)
    pixels = camera.width_px / columns * camera.height_px / rows
    per_steradian = np.divide(pixels, solid_angle, out=np.zeros_like(solid_angle), where=solid_angle > 0)
    return np.asarray(np.sqrt(per_steradian) * np.pi / 180)


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
    at_port, at_m1 = train.without_mirrors().trace(pixels), replace(train, mirrors=train.mirrors[:1]).trace(pixels)
    outcome = outcomes_of_status(at_m1.status)
    cell = np.flatnonzero(at_port.passed)
    at_port, at_m1 = (rays[cell].moved(layout.body_from_camera) for rays in (at_port, at_m1))
    folded = outcome[cell] == Outcome.SEEN
    length = np.where(folded, np.linalg.norm(at_m1.origin_m - at_port.origin_m, axis=1), np.inf)
    before = _stops(fixed, at_port, length)
    back = outcome[cell] == Outcome.BACK_OF_MIRROR
    before.distance_m[back], before.outcome[back] = 0.0, Outcome.BACK_OF_MIRROR
    return FoldedField(
        solid_angle_sr=pixel_solid_angles(train.camera, train.port, columns, rows),
        outcome=outcome,
        cell=cell,
        folded=folded,
        port_m=at_port.origin_m,
        port_direction=at_port.direction,
        length_m=length,
        origin_m=at_m1.origin_m,
        direction=at_m1.direction,
        before=before,
        behind=_stops(fixed, at_m1, np.full(len(cell), np.inf)),
    )


def _triangle(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Solid angle of a spherical triangle between unit vectors, shape (..., 3)."""
    volume = np.abs((a * np.cross(b, c)).sum(axis=-1))
    below = 1 + (a * b).sum(axis=-1) + (b * c).sum(axis=-1) + (c * a).sum(axis=-1)
    return np.asarray(2 * np.arctan2(volume, below))


def _stops(fixed: Occluder, rays: Rays, length_m: FloatArray) -> Stops:
    """What of the fixed parts stops rays between two surfaces."""
    if len(length_m) == 0:
        return Stops(np.empty(0), np.empty(0, dtype=np.uint32))
    along = Array3f64(*to_columns(rays.direction))
    start = Array3f64(*to_columns(rays.origin_m)) + along * SKIN_M
    hit = first_hit(fixed.parameters(), start, along, Float64(length_m) - 2 * SKIN_M, Bool(True))
    distance = np.broadcast_to(np.array(hit.distance, dtype=np.float64), len(length_m)) + SKIN_M
    part = np.broadcast_to(np.array(hit.part), len(length_m))
    stopped = np.isfinite(distance)
    return Stops(distance, np.where(stopped, outcomes_at_parts(fixed.parts)[part], Outcome.SEEN).astype(np.uint32))
