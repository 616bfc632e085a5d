"""Radiance and irradiance of open water as tables over depth and direction, for the kernels.

A table holds the three channels; how light divides among a channel's wavelengths is taken from the robot's depth.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.kernels.backend import Float32, UInt32, dr
from optics.kernels.packing import between, pairs_of
from optics.kernels.powers import decay
from scenes.light.uniforms import LightUniforms

DEPTHS, COSINES, AZIMUTHS = 64, 65, 25
"""Nodes: depths by the logarithm of ``1 + z / DEPTH_SCALE_M``, cosines and azimuths (0 to pi) evenly."""

DEPTH_SCALE_M = 0.5
ROW = 8
"""Three channels at a node, and at the next azimuth."""


def resampled(
    depth_m: FloatArray, cosine: FloatArray, azimuth_rad: FloatArray, values: FloatArray, deepest_m: float
) -> FloatArray:
    """Values on a grid (c, z, m, p), brought onto the table's nodes: shape (DEPTHS, COSINES, AZIMUTHS, c)."""
    nodes = (depths_m(deepest_m), np.linspace(-1, 1, COSINES), np.linspace(0, np.pi, AZIMUTHS))
    result = values
    for axis, (old, new) in enumerate(zip((depth_m, cosine, azimuth_rad), nodes, strict=True), start=1):
        cell = np.clip(np.searchsorted(old, new) - 1, 0, len(old) - 2)
        share = np.clip((new - old[cell]) / (old[cell + 1] - old[cell]), 0, 1)
        shape = [1] * result.ndim
        shape[axis] = len(new)
        share = share.reshape(shape)
        result = result.take(cell, axis) * (1 - share) + result.take(cell + 1, axis) * share
    return np.moveaxis(result, 0, -1)


def depths_m(deepest_m: float) -> FloatArray:
    """Depths of the table's nodes."""
    return np.asarray(DEPTH_SCALE_M * np.expm1(np.linspace(0, np.log1p(deepest_m / DEPTH_SCALE_M), DEPTHS)))


def field_table(nodes: FloatArray) -> Any:
    """Table of values at the nodes, as `looked_up` reads it."""
    return pairs_of(nodes, ROW)


def layer(light: LightUniforms, table: Any, depth: Any) -> Any:
    """Kernel: the table at one depth, as `looked_up_in_layer` reads it."""
    cell, share = _cell(_depth_position(light, depth), DEPTHS)
    size = COSINES * AZIMUTHS * ROW
    entry = dr.arange(UInt32, size)
    above, below = (dr.gather(Float32, table, (cell + step) * size + entry) for step in (0, 1))
    return dr.lerp(above, below, share)


def looked_up_in_layer(light: LightUniforms, table: Any, depth: Any, cosine: Any, azimuth: Any) -> list[Any]:
    """Kernel: the three channels at a direction, for the depth of a layer."""
    return _interpolated(light, table, depth, [_cosine_cell(cosine), _azimuth_cell(azimuth)])


def looked_up(light: LightUniforms, table: Any, depth: Any, cosine: Any, azimuth: Any) -> list[Any]:
    """Kernel: the three channels at a depth and a direction (cosine to the vertical, azimuth from the sun's)."""
    at_depth = _cell(_depth_position(light, depth), DEPTHS)
    return _interpolated(light, table, depth, [at_depth, _cosine_cell(cosine), _azimuth_cell(azimuth)])


def _interpolated(light: LightUniforms, table: Any, depth: Any, cells: list[tuple[Any, Any]]) -> list[Any]:
    """Linear interpolation; the exponential fall over depth, which the table is held without, is put back."""
    *others, (row, along) = cells
    strides = (COSINES * AZIMUTHS, AZIMUTHS)[-len(others) :]
    offsets, weights = [0], [Float32(1)]
    for (cell, share), stride in zip(others, strides, strict=True):
        row = row + cell * stride
        offsets = [each + step for each in offsets for step in (0, stride)]
        weights = [w * s for w in weights for s in (1 - share, share)]
    total = [Float32(0)] * 3
    for offset, weight in zip(offsets, weights, strict=True):
        values = between(table, row + offset, along, ROW)
        total = [dr.fma(values[k], weight, total[k]) for k in range(3)]
    fall = dr.maximum(depth, 0)
    return [t * decay(K * fall) for t, K in zip(total, light.table_decay, strict=True)]


def _depth_position(light: LightUniforms, depth: Any) -> Any:
    return dr.log(1 + dr.maximum(depth, 0) / DEPTH_SCALE_M) * light.steps_per_log


def _cosine_cell(cosine: Any) -> tuple[Any, Any]:
    return _cell((cosine + 1) * ((COSINES - 1) / 2), COSINES)


def _azimuth_cell(azimuth: Any) -> tuple[Any, Any]:
    return _cell(azimuth * ((AZIMUTHS - 1) / np.pi), AZIMUTHS)


def _cell(position: Any, count: int) -> tuple[Any, Any]:
    cell = UInt32(dr.clip(position, 0, count - 2))
    return cell, dr.minimum(position - Float32(cell), 1)


def azimuth_from(sun_azimuth: list[Any], direction: Any) -> Any:
    """Kernel: angle between the horizontal part of a direction and the sun's, 0 to pi; zero for the vertical."""
    along = direction.x * sun_azimuth[0] + direction.y * sun_azimuth[1]
    level = dr.sqrt(dr.square(direction.x) + dr.square(direction.y))
    return dr.safe_acos(dr.select(level > 1e-6, along / level, 1))
