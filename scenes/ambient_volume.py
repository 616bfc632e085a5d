"""What a world changes of the light around what moves in it: a grid of points, and six sides at each.

A robot or a target in a white basin is lit by the walls as well, and one under a ledge misses some of the sky. At each
point of a grid the irradiance of six planes, along both ways of the world's axes, is gathered, and open water's is
taken away. `scenes.ambient_cube` says how it is interpolated.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.backend import Float32, dr
from scenes.ambient import cached, gathered
from scenes.ambient_cube import ROW, SIDES
from scenes.geometry import GroupMesh
from scenes.light import Light
from scenes.packing import rows_of

FloatArray = NDArray[np.float64]

SPACING_M = 0.5
MOST_POINTS = 24
"""Along each axis of the grid."""

HIGHEST_M = -0.05
"""The grid stays below the surface."""


def ambient_volume(mesh: GroupMesh, light: Light) -> dict[str, Any]:
    """Grid over a lit mesh, as `scenes.ambient_cube` takes it; from the cache when it can be."""
    axes = _axes(mesh)
    shape = tuple(len(axis) for axis in axes)
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    origins = np.repeat(points, len(SIDES), axis=0)
    normals = np.tile(SIDES, (len(points), 1))

    def changes() -> FloatArray:
        return gathered(mesh, origins, normals, light) - gathered(None, origins, normals, light)

    values = cached(mesh, light, "volume", changes)
    numbers = {
        "corner": [axis[0] for axis in axes],
        "inverse_step": [1 / (axis[1] - axis[0]) for axis in axes],
        "count": shape,
    }
    opaque = {name: [dr.opaque(Float32, float(x)) for x in each] for name, each in numbers.items()}
    return {"values": rows_of(values, ROW), **opaque}


def _axes(mesh: GroupMesh) -> list[FloatArray]:
    used = mesh.vertices_m[np.unique(mesh.faces)]
    lowest, highest = used.min(axis=0), used.max(axis=0)
    highest[2] = min(highest[2] + SPACING_M, HIGHEST_M)
    counts = np.clip(np.ceil((highest - lowest) / SPACING_M).astype(int) + 1, 2, MOST_POINTS)
    return [np.linspace(a, b, n) for a, b, n in zip(lowest, highest, counts, strict=True)]
