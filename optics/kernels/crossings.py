"""Where segments go through triangles: whether surfaces cross each other, told exactly but for single precision.

Mitsuba is loaded by the first surface: modules that know this one serve hulls of all kinds, and few come from a file.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.kernels import backend
from optics.kernels.arrays import FloatArray

MISSED = -1


@dataclass(frozen=True, kw_only=True)
class CrossedSurface:
    """Triangles that segments are held against, in any unit; `centre` is what their corners are stored relative to."""

    scene: Any
    centre: FloatArray

    @classmethod
    def of(cls, vertices: FloatArray, faces: NDArray[np.integer[Any]]) -> CrossedSurface:
        """Surface of corners, shape (n, 3), and triangles, shape (m, 3)."""
        from optics.kernels.ray_scene import mesh_scene  # noqa: PLC0415

        centre = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
        return cls(scene=mesh_scene(vertices - centre, faces.astype(np.int32)), centre=centre)

    def first(self, start: FloatArray, end: FloatArray) -> NDArray[np.int64]:
        """Triangle that each segment hits first, from either side; `MISSED` where there is none.

        Parameters
        ----------
        start, end : array, shape (n, 3)
        """
        if not len(start):
            return np.empty(0, dtype=np.int64)
        way = end - start
        length = np.linalg.norm(way, axis=1)
        direction = way / np.where(length > 0, length, 1)[:, np.newaxis]
        rays = backend.mi.Ray3f(
            _columns(start - self.centre), backend.mi.Vector3f(_columns(direction)), _single(length), 0.0, []
        )
        found = self.scene.ray_intersect_preliminary(rays, coherent=False, active=True)
        return np.where(found.is_valid().numpy(), found.prim_index.numpy().astype(np.int64), MISSED)


def _columns(rows: FloatArray) -> Any:
    return backend.mi.Point3f(np.ascontiguousarray(rows.T, dtype=np.float32))


def _single(values: FloatArray) -> Any:
    return backend.mi.Float(np.ascontiguousarray(values, dtype=np.float32))
