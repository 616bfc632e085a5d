"""Kernels of the veiling light: light scattered into a line of sight by water that does not see what open water sees.

Robot and world occlude light from the water around them, and send other light. Along a line of sight both are the
integral of a source (`scenes.baking.source_volume`, `scenes.baking.robot_shadow_in_water`). A frame has it in a table,
by the place where lines begin, their direction in the body frame and their length: it is filled once for each state.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.kernels.backend import PCG32, Array3f32, ArrayXf32, Float32, UInt32, UInt64, dr
from optics.kernels.packing import between, row_of
from optics.kernels.powers import decay
from scenes.kernels.direction_grid import direction_cell, node_direction, nodes_around
from scenes.kernels.geometry import Geometry
from scenes.kernels.grid import GridTable, beside_grid_m, cell_in
from scenes.light.field_table import azimuth_from, looked_up_in_layer
from scenes.light.uniforms import LightUniforms
from scenes.stage.records import Pose

AZIMUTHS, ELEVATIONS = 48, 25
"""Nodes by direction: azimuths all around, elevations from pole to pole."""

SEGMENTS = 11
LENGTH_SCALE_M = 1.0
"""Segments of a line end evenly in ``r / (r + LENGTH_SCALE_M)``; the last never ends."""

FARTHEST_M = 60.0
"""Stands for the end of the last segment."""

ROW = 8
"""Three channels at the beginning of a segment, and at its end."""

SOURCE_AZIMUTHS, SOURCE_ELEVATIONS = 24, 25
SOURCE_ROW = 4


def lengths_m() -> FloatArray:
    """Ends of the segments, shape (SEGMENTS + 1,)."""
    share = np.arange(SEGMENTS) / SEGMENTS
    return np.append(LENGTH_SCALE_M * share / (1 - share), FARTHEST_M)


def veiling_light(table: Any, eye: Any, direction: Any, length: Any) -> list[Any]:
    """Kernel: light by channel that is added along a line of sight, between the nodes of the table.

    `eye` counts the places where lines begin, state by state; `direction` is in the body frame.
    """
    reach = length / (length + LENGTH_SCALE_M) * SEGMENTS
    segment = dr.minimum(UInt32(reach), SEGMENTS - 1)
    along = reach - Float32(segment)
    total = [Float32(0)] * 3
    for row, weight in nodes_around(direction, eye, AZIMUTHS, ELEVATIONS):
        values = between(table, row * SEGMENTS + segment, along, ROW)
        total = [dr.fma(v, weight, t) for v, t in zip(values[:3], total, strict=True)]
    return total


def veiling_light_table(
    light: LightUniforms,
    world_of: Callable[[Any], Pose],
    geometry: Geometry,
    field_layer: Any,
    *,
    eyes: int,
    states: int,
) -> Any:
    """Kernel: table of `veiling_light` for some states; `world_of` gives the body's poses by the state's number."""
    lane = dr.arange(UInt32, states * eyes * ELEVATIONS * AZIMUTHS * SEGMENTS)
    node, place = lane // SEGMENTS, lane // (SEGMENTS * AZIMUTHS * ELEVATIONS)
    direction = world_of(place // eyes).turn(node_direction(node, AZIMUTHS, ELEVATIONS))
    total = [Float32(0)] * ROW
    if geometry.source is not None:
        from_world = _veiling_light_of_world(light, world_of, geometry.source, geometry.eyes, eyes=eyes, states=states)
        for row, weight in nodes_around(direction, place, SOURCE_AZIMUTHS, SOURCE_ELEVATIONS):
            values = row_of(from_world, row * SEGMENTS + lane % SEGMENTS, ROW)
            total = [dr.fma(v, weight, t) for v, t in zip(values, total, strict=True)]
    if geometry.shadow_in_water is not None:
        from_sun = azimuth_from(light.sun_azimuth, direction)
        open_water = looked_up_in_layer(light, field_layer, light.reference_depth_m, direction.z, from_sun)
        hidden = row_of(geometry.shadow_in_water, lane % (eyes * ELEVATIONS * AZIMUTHS * SEGMENTS), ROW)
        channel = [*open_water, Float32(0)] * 2
        total = [t - f * h for t, f, h in zip(total, channel, hidden, strict=True)]
    return _table(total, lane)


def _veiling_light_of_world(
    light: LightUniforms, world_of: Callable[[Any], Pose], source: GridTable, begins: Any, *, eyes: int, states: int
) -> Any:
    """Kernel: table like `veiling_light_table`'s of what the world adds, by direction in the world frame.

    Its directions are those at which the source is known: only between the points of the grid it is interpolated.
    """
    lane = dr.arange(UInt32, states * eyes * SOURCE_ELEVATIONS * SOURCE_AZIMUTHS * SEGMENTS)
    segment, node = lane % SEGMENTS, lane // SEGMENTS
    place = node // (SOURCE_AZIMUTHS * SOURCE_ELEVATIONS)
    eye = world_of(place // eyes).move(dr.gather(Array3f32, begins, place % eyes))
    begin, end = (LENGTH_SCALE_M * Float32(k) / (SEGMENTS - Float32(k)) for k in (segment, segment + 1))
    path = dr.select(segment == SEGMENTS - 1, FARTHEST_M, end) - begin
    attenuation = light.channel_attenuation
    # Where the light of the segment comes from, on average.
    y = attenuation[1] * path
    middle = begin + path * dr.select(y > 0.01, dr.rcp(y) - decay(y) / (1 - decay(y)), 0.5)
    point = eye + node_direction(node, SOURCE_AZIMUTHS, SOURCE_ELEVATIONS) * middle
    cells, shares, _ = cell_in(source, point)
    found = [Float32(0)] * 3
    for corner in np.ndindex(2, 2, 2):
        weight, first = Float32(1), UInt32(0)
        for step, cell, share, nodes in zip(corner, cells, shares, source.count, strict=True):
            weight = weight * (share if step else 1 - share)
            first = first * UInt32(nodes) + UInt32(cell) + step
        row = first * (SOURCE_ELEVATIONS * SOURCE_AZIMUTHS) + node % (SOURCE_ELEVATIONS * SOURCE_AZIMUTHS)
        values = row_of(source.values, row, SOURCE_ROW)
        found = [dr.fma(v, weight, f) for v, f in zip(values[:3], found, strict=True)]
    # Beside its grid a world's light dies off as through the water.
    beside = beside_grid_m(source, point)
    added = [
        f * decay(c * (begin + beside)) * (1 - decay(c * path)) / c for f, c in zip(found, attenuation, strict=True)
    ]
    # Evaluated once, and not again in each of the sums.
    dr.eval(added)
    before = [dr.block_prefix_reduce(dr.ReduceOp.Add, each, SEGMENTS, exclusive=True) for each in added]
    after = [b + a for b, a in zip(before, added, strict=True)]
    return _table([*before, Float32(0), *after, Float32(0)], lane)


def _table(columns: list[Any], lane: Any) -> Any:
    """Kernel: columns as the rows of a table."""
    table = dr.empty(Float32, dr.width(lane) * len(columns))
    dr.scatter(table, ArrayXf32(columns), lane)
    return table


def sampled_veiling_light(  # noqa: PLR0917
    source: GridTable, light: LightUniforms, seed: Any, point: Any, direction: Any, length: Any
) -> list[Any]:
    """Kernel: estimate of the light that is added along a line, from one point that is drawn on it.

    For averages over many lines. The nodes around the point are drawn by their weights.
    """
    random = PCG32(initstate=UInt64(seed))
    attenuation = light.channel_attenuation
    reached = 1 - decay(attenuation[1] * length)
    distance = -dr.log(1 - random.next_float32() * reached) / attenuation[1]
    place = point + direction * distance
    beside = beside_grid_m(source, place)
    cells, shares, _ = cell_in(source, place)
    (column, across), (line, up) = direction_cell(direction, SOURCE_AZIMUTHS, SOURCE_ELEVATIONS)
    node = UInt32(0)
    for cell, share, count in zip(cells, shares, source.count, strict=True):
        node = node * UInt32(count) + UInt32(cell) + dr.select(random.next_float32() < share, UInt32(1), UInt32(0))
    line = line + dr.select(random.next_float32() < up, UInt32(1), UInt32(0))
    column = column + dr.select(random.next_float32() < across, UInt32(1), UInt32(0))
    row = (node * SOURCE_ELEVATIONS + line) * SOURCE_AZIMUTHS + column % SOURCE_AZIMUTHS
    values = row_of(source.values, row, SOURCE_ROW)
    return [
        v * decay((c - attenuation[1]) * distance + c * beside) * reached / attenuation[1]
        for v, c in zip(values[:3], attenuation, strict=True)
    ]
