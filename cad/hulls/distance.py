"""How far points are from a hull's surface, and on which side of it: for cameras, mirrors and anchors alike.

Where a surface is closed the side is exact. Where it is not, a point is inside when the surface closes more than half
of what there is around it: the generalised winding number (A. Jacobson, L. Kavan and O. Sorkine-Hornung, "Robust
inside-outside segmentation using generalized winding numbers", ACM Trans. Graph. 32(4), 2013), with which holes,
inner walls and sheets that cross each other do no harm.
"""

from __future__ import annotations

from dataclasses import dataclass

import igl
import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray

from optics.kernels.arrays import FloatArray

INSIDE_TURNS = 0.5
"""Winding number from which on a point is inside."""


@dataclass(frozen=True, kw_only=True)
class NearestPoints:
    """What of a surface is nearest to each of some points.

    Attributes
    ----------
    distance_mm : array, shape (n,)
        From each point to the surface, negative inside.
    point_mm : array, shape (n, 3)
        Where the surface comes nearest.
    face : array, shape (n,)
        The triangle that this is on.
    """

    distance_mm: FloatArray
    point_mm: FloatArray
    face: NDArray[np.int64]


def nearest_points(surface: trimesh.Trimesh, points_mm: ArrayLike) -> NearestPoints:
    """Nearest points of a surface, with signed distances; a second for a thousand points and 300,000 triangles.

    Parameters
    ----------
    surface : Trimesh
        Millimetres. It need not be closed, but its triangles face alike: all outwards, or all inwards.
    points_mm : array, shape (n, 3)
        In the same frame.

    Raises
    ------
    ValueError
        For a surface without triangles.
    """
    points = np.ascontiguousarray(points_mm, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"expected points of shape (n, 3), got {points.shape}")
    vertices, faces = np.asarray(surface.vertices, dtype=np.float64), np.asarray(surface.faces, dtype=np.int64)
    if not len(faces):
        raise ValueError("expected a surface with triangles, got none")
    square, face, nearest = igl.point_mesh_squared_distance(points, vertices, faces)
    turns = igl.fast_winding_number(vertices, faces, points)
    side = np.where(np.abs(turns) > INSIDE_TURNS, -1.0, 1.0)
    return NearestPoints(distance_mm=side * np.sqrt(square), point_mm=nearest, face=face)
