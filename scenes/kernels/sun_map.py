"""Which points of a world the sun reaches: how high the world stands along the direction of the sun, on a grid.

World and sun stand still, so the first surface that sunlight meets is found once, for a grid of rays across the beam; a
point below it is in the shadow. Edges of shadows are as fine as the grid. In water they are no finer: light that is
scattered by a degree or two still counts with the sun, and blurs a shadow by some centimetres for each metre between
it and what throws it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.kernels.backend import Array3f32, Float32, UInt32, dr, mi
from optics.kernels.powers import decay

CELLS = 2048
"""Along each side."""

COARSEST_CELL_M = 0.025
"""A world whose cells would be larger has its shadows traced."""

MARGIN_M = 0.05

WAY_POINTS = 6
WAY_M = 12.0
"""Points on a line of sight at which the sun is looked for, over this length at most."""

LARGEST_SLOPE = 4.0
"""Tangent of the angle between sun and normal up to which the bias follows a surface; what is steeper is hardly lit."""


def sun_map(scene: Any, vertices_m: FloatArray, towards_sun: FloatArray) -> dict[str, Any] | None:
    """Heights of a Mitsuba scene along the sun's direction, as `reached_by_sun` takes them.

    None for a world that is too large for fine cells.
    """
    u, v = _across(towards_sun)
    along, across = vertices_m @ towards_sun, np.stack([vertices_m @ u, vertices_m @ v], axis=-1)
    corner = across.min(axis=0) - MARGIN_M
    cell = float((across.max(axis=0) + MARGIN_M - corner).max()) / (CELLS - 1)
    if cell > COARSEST_CELL_M:
        return None
    top = float(along.max()) + MARGIN_M
    node = dr.arange(UInt32, CELLS * CELLS)
    column, row = Float32(node % CELLS) * cell + float(corner[0]), Float32(node // CELLS) * cell + float(corner[1])
    axes = [Array3f32(*(float(component) for component in axis)) for axis in (u, v, towards_sun)]
    ray = mi.Ray3f(axes[0] * column + axes[1] * row + axes[2] * top, -axes[2])
    found = scene.ray_intersect_preliminary(ray, coherent=True)
    height = dr.select(found.is_valid(), top - found.t, -np.inf)
    dr.eval(height)
    numbers = {"u": u, "v": v, "sun": towards_sun, "corner": corner, "cell": [cell]}
    opaque = {name: [dr.opaque(Float32, float(x)) for x in values] for name, values in numbers.items()}
    return {"height": height, **opaque}


def reached_by_sun(grid: dict[str, Any], point: Any, normal: Any) -> Any:
    """Kernel: share of the sun that reaches points with a normal (world frame), 0 to 1, between the nearest nodes."""
    cell = grid["cell"][0]
    x, y = (
        (dr.dot(Array3f32(*grid[name]), point) - low) / cell for name, low in zip("uv", grid["corner"], strict=True)
    )
    sun = Array3f32(*grid["sun"])
    cosine = dr.dot(sun, normal)
    slope = dr.minimum(dr.safe_sqrt(1 - dr.square(cosine)) / dr.maximum(cosine, 1e-3), LARGEST_SLOPE)
    # Between nodes a surface rises by its slope times a cell.
    level = dr.dot(sun, point) + cell * (1 + 1.5 * slope)
    column, row = (UInt32(dr.clip(position, 0, CELLS - 2)) for position in (x, y))
    share_x, share_y = dr.clip(x - Float32(column), 0, 1), dr.clip(y - Float32(row), 0, 1)
    first = row * CELLS + column
    lit = [
        dr.select(dr.gather(Float32, grid["height"], first + step) <= level, Float32(1), Float32(0))
        for step in (0, 1, CELLS, CELLS + 1)
    ]
    return dr.lerp(dr.lerp(lit[0], lit[1], share_x), dr.lerp(lit[2], lit[3], share_x), share_y)


def sunlit_way(grid: dict[str, Any], origin: Any, direction: Any, length: Any, attenuation: Any) -> Any:
    """Kernel: share of a way through the water that lies in the sun, 0 to 1; what is near counts more.

    Points in the middles of equal pieces count as the light that reaches the eye from there, ``exp(-attenuation s)``.
    """
    reach = dr.minimum(length, WAY_M)
    sun = Array3f32(*grid["sun"])
    lit, total = Float32(0), Float32(0)
    for piece in range(WAY_POINTS):
        s = reach * ((piece + 0.5) / WAY_POINTS)
        point = origin + direction * s
        column, row = (
            dr.round((dr.dot(Array3f32(*grid[name]), point) - low) / grid["cell"][0])
            for name, low in zip("uv", grid["corner"], strict=True)
        )
        inside = (column >= 0) & (column < CELLS) & (row >= 0) & (row < CELLS)
        height = dr.gather(Float32, grid["height"], UInt32(row) * CELLS + UInt32(column), inside)
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
