"""Which points of a world the sun reaches: how high the world stands along the direction of the sun, on a grid.

World and sun stand still, so the first surface that sunlight hits is found once, for a grid of rays across the beam; a
point below it is in the shadow. Edges of shadows are as fine as the grid. In water they are no finer: light that is
scattered by a degree or two still counts with the sun, and blurs a shadow by some centimetres for each metre between
it and what throws it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray, aligned
from optics.kernels.backend import Array3f32, Float32, UInt32, dr, mi
from optics.kernels.cache import load_or_make, result_key
from optics.kernels.packing import opaque_numbers
from optics.kernels.powers import decay
from optics.workers.threads import woken_threads

CELLS = 2048
"""Along each side."""

COARSEST_CELL_M = 0.025
"""A world whose cells would be larger has its shadows traced."""

MARGIN_M = 0.05

SUN_MAP_VERSION = 1
"""Raised when the same mesh under the same sun has another map."""

KEPT_FROM_FACES = 100_000
"""Of a mesh with fewer faces a map is made as fast as one is read."""

LINE_POINTS = 6
LINE_M = 12.0
"""Points on a line of sight at which the sun is looked for, over this length at most."""

LARGEST_SLOPE = 4.0
"""Tangent of the angle between sun and normal up to which the bias follows a surface; what is steeper is hardly lit."""


@dataclass(frozen=True, kw_only=True)
class SunMap:
    """Heights of a world along the direction of the sun, world frame: Dr.Jit's numbers.

    Attributes
    ----------
    height : Float32
        At the nodes, metres; minus infinity where a ray hits nothing.
    u, v, towards_sun : list of Float32
        Unit vectors: two across the beam, along which the nodes lie, and the one against it.
    corner : list of Float32
        First node along u and v, metres.
    cell : Float32
        From node to node, metres.
    """

    height: Any
    u: list[Any]
    v: list[Any]
    towards_sun: list[Any]
    corner: list[Any]
    cell: Any

    def cells(self, point: Any) -> tuple[Any, Any]:
        """Kernel: where points lie across the beam, in cells from the first node."""
        along_u, along_v = (
            (dr.dot(Array3f32(*axis), point) - low) / self.cell
            for axis, low in zip((self.u, self.v), self.corner, strict=True)
        )
        return along_u, along_v


def sun_map(scene: Any, vertices_m: FloatArray, faces: NDArray[np.int32], towards_sun: FloatArray) -> SunMap | None:
    """Heights of a mesh, which is in a Mitsuba scene, along the sun's direction, as `reached_by_sun` takes them.

    From the cache when it can be, where the mesh is large.

    None for a world that is too large for fine cells.
    """
    u, v = _across(towards_sun)
    along, across = vertices_m @ towards_sun, np.stack([vertices_m @ u, vertices_m @ v], axis=-1)
    corner = across.min(axis=0) - MARGIN_M
    cell = float((across.max(axis=0) + MARGIN_M - corner).max()) / (CELLS - 1)
    if cell > COARSEST_CELL_M:
        return None
    top = float(along.max()) + MARGIN_M

    def looked_at() -> NDArray[np.float32]:
        return _heights(scene, (u, v, towards_sun), corner, cell, top)

    if len(faces) < KEPT_FROM_FACES:
        height = looked_at()
    else:
        key = result_key("sun map", SUN_MAP_VERSION, vertices_m, faces, towards_sun, CELLS, MARGIN_M)
        height = load_or_make(
            "sun map", key, looked_at, pack=lambda made: {"height": made}, unpack=lambda stored: stored["height"]
        )
    return SunMap(
        height=Float32(aligned(height, np.float32)),
        u=opaque_numbers(u),
        v=opaque_numbers(v),
        towards_sun=opaque_numbers(towards_sun),
        corner=opaque_numbers(corner),
        cell=dr.opaque(Float32, cell),
    )


def _heights(
    scene: Any, directions: tuple[FloatArray, FloatArray, FloatArray], corner: FloatArray, cell: float, top: float
) -> NDArray[np.float32]:
    """Heights at the nodes, row by row; directions are the two across the beam and the one against it."""
    node = dr.arange(UInt32, CELLS * CELLS)
    low_u, low_v, step, highest = opaque_numbers([*corner, cell, top])
    axes = [Array3f32(*opaque_numbers(axis)) for axis in directions]
    column, row = Float32(node % CELLS) * step + low_u, Float32(node // CELLS) * step + low_v
    ray = mi.Ray3f(axes[0] * column + axes[1] * row + axes[2] * highest, -axes[2])
    with woken_threads():
        found = scene.ray_intersect_preliminary(ray, coherent=True)
        return np.array(dr.select(found.is_valid(), highest - found.t, -np.inf), dtype=np.float32)


def reached_by_sun(grid: SunMap, point: Any, normal: Any) -> Any:
    """Kernel: share of the sun that reaches points with a normal (world frame), 0 to 1, between the nearest nodes."""
    x, y = grid.cells(point)
    sun = Array3f32(*grid.towards_sun)
    cosine = dr.dot(sun, normal)
    slope = dr.minimum(dr.safe_sqrt(1 - dr.square(cosine)) / dr.maximum(cosine, 1e-3), LARGEST_SLOPE)
    # Between nodes a surface rises by its slope times a cell.
    level = dr.dot(sun, point) + grid.cell * (1 + 1.5 * slope)
    column, row = (UInt32(dr.clip(position, 0, CELLS - 2)) for position in (x, y))
    share_x, share_y = dr.clip(x - Float32(column), 0, 1), dr.clip(y - Float32(row), 0, 1)
    first = row * CELLS + column
    lit = [
        dr.select(dr.gather(Float32, grid.height, first + step) <= level, Float32(1), Float32(0))
        for step in (0, 1, CELLS, CELLS + 1)
    ]
    return dr.lerp(dr.lerp(lit[0], lit[1], share_x), dr.lerp(lit[2], lit[3], share_x), share_y)


def sunlit_share(grid: SunMap, origin: Any, direction: Any, length: Any, attenuation: Any) -> Any:
    """Kernel: share of a line through the water that lies in the sun, 0 to 1; what is near counts more.

    Points in the middles of equal intervals count as the light that reaches the eye, ``exp(-attenuation s)``.
    """
    reach = dr.minimum(length, LINE_M)
    sun = Array3f32(*grid.towards_sun)
    lit, total = Float32(0), Float32(0)
    for interval in range(LINE_POINTS):
        s = reach * ((interval + 0.5) / LINE_POINTS)
        point = origin + direction * s
        column, row = (dr.round(position) for position in grid.cells(point))
        inside = (column >= 0) & (column < CELLS) & (row >= 0) & (row < CELLS)
        height = dr.gather(Float32, grid.height, UInt32(row) * CELLS + UInt32(column), inside)
        weight = decay(attenuation * s)
        lit = lit + dr.select(~inside | (height <= dr.dot(sun, point)), weight, 0)
        total = total + weight
    return lit / total


def _across(direction: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors across a direction."""
    helper = np.eye(3)[np.argmin(np.abs(direction))]
    u = np.cross(direction, helper)
    u = u / np.linalg.norm(u)
    return u, np.cross(direction, u)
