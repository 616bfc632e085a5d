"""Tables by direction: nodes at even azimuths all around and even elevations from pole to pole."""

from __future__ import annotations

from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.kernels.backend import Array3f32, Float32, UInt32, dr


def node_directions(azimuths: int, elevations: int) -> FloatArray:
    """Directions of the nodes of a table, shape (elevations * azimuths, 3)."""
    elevation = np.linspace(-np.pi / 2, np.pi / 2, elevations)[:, np.newaxis]
    azimuth = np.arange(azimuths) * (2 * np.pi / azimuths)
    level = np.cos(elevation)
    axes = np.broadcast_arrays(level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation))
    return np.stack(axes, axis=-1).reshape(-1, 3)


def direction_cell(direction: Any, azimuths: int, elevations: int) -> tuple[tuple[Any, Any], tuple[Any, Any]]:
    """Kernel: first node and share towards the next one, by azimuth and by elevation, of a unit vector."""
    around = dr.atan2(direction.y, direction.x) * (azimuths / (2 * np.pi))
    around = dr.select(around < 0, around + azimuths, around)
    rise = (dr.safe_asin(direction.z) / np.pi + 0.5) * (elevations - 1)
    column, line = dr.minimum(UInt32(around), azimuths - 1), dr.minimum(UInt32(rise), elevations - 2)
    return (column, around - Float32(column)), (line, rise - Float32(line))


def node_direction(node: Any, azimuths: int, elevations: int) -> Any:
    """Kernel: direction of a node of `node_directions`, which are repeated."""
    sine, cosine = dr.sincos(Float32(node % azimuths) * (2 * np.pi / azimuths))
    rise, level = dr.sincos(Float32(node // azimuths % elevations) * (np.pi / (elevations - 1)) - np.pi / 2)
    return Array3f32(level * cosine, level * sine, rise)


def nodes_around(direction: Any, place: Any, azimuths: int, elevations: int) -> list[tuple[Any, Any]]:
    """Kernel: the four nodes around directions, in the table of a place, and their weights."""
    (column, across), (line, up) = direction_cell(direction, azimuths, elevations)
    following = dr.select(column == azimuths - 1, 0, column + 1)
    return [
        ((place * elevations + line + step) * azimuths + beside, share * (up if step else 1 - up))
        for step in (0, 1)
        for beside, share in ((column, 1 - across), (following, across))
    ]
