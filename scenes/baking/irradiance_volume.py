"""What a world changes of the light around what moves in it: a grid of points, and six sides at each.

A robot or a target in a white basin is lit by the walls as well, and one under a ledge misses some of the sky. At each
point of a grid the irradiance of six planes, along both ways of the world's axes, is gathered, and open water's is
taken away. `scenes.kernels.ambient_cube` says how it is interpolated.
"""

from __future__ import annotations

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.kernels.packing import rows_of
from scenes.baking.ambient import cached, gathered
from scenes.baking.light_quality import LightQuality
from scenes.kernels.ambient_cube import ROW, SIDES
from scenes.kernels.grid import GridTable, grid_axes, grid_points
from scenes.light.light import Light
from scenes.stage.group_mesh import GroupMesh

SPACING_M = 0.5
MOST_POINTS = 24
"""Along each axis of the grid."""


def irradiance_volume(
    mesh: GroupMesh, light: Light, quality: LightQuality, source: GridTable | None = None
) -> GridTable:
    """Grid over a lit mesh and its source volume for `scenes.kernels.ambient_cube`; from the cache when it can be."""
    axes = grid_axes(mesh, spacing_m=SPACING_M, most=MOST_POINTS)
    points = grid_points(axes)
    origins = np.repeat(points, len(SIDES), axis=0)
    normals = np.tile(SIDES, (len(points), 1))

    def changes() -> FloatArray:
        seen = gathered(mesh, origins, normals, light, quality, source)
        return seen - gathered(None, origins, normals, light, quality)

    values = cached(mesh, light, quality, "light in the water", changes)
    return GridTable.of(axes, rows_of(values, ROW))
