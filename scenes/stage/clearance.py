"""How far a world keeps from a point: within that, no ray needs to be traced against it."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from optics.kernels.arrays import FloatArray
from scenes.worlds import World

SMALLEST_REACH_M = 0.05

NEAR = 0.1
"""Share of the clearance by which a point may be away from where the world was searched."""


class Clearance:
    """Bound on the distance from points to the faces of a world.

    No point of a triangle is farther from its nearest corner than its longest edge over the root of three (as in the
    middle of an equilateral one). Corners are kept by that reach, in classes that double.
    """

    def __init__(self, world: World):
        a, b, c = (world.vertices_m[column] for column in world.faces.T)
        longest = np.sqrt(np.max([((one - other) ** 2).sum(axis=1) for one, other in ((a, b), (b, c), (c, a))], axis=0))
        reach = np.full(len(world.vertices_m), -1.0)
        for column in world.faces.T:
            np.maximum.at(reach, column, longest / np.sqrt(3))
        size = np.ceil(np.log2(np.maximum(reach, SMALLEST_REACH_M) / SMALLEST_REACH_M)).astype(int)
        used = np.flatnonzero(reach >= 0)
        self._classes = [
            (SMALLEST_REACH_M * 2.0**each, world.vertices_m[used[size[used] == each]]) for each in np.unique(size[used])
        ]
        self._found: tuple[FloatArray, float] | None = None

    @cached_property
    def _trees(self) -> list[tuple[float, cKDTree]]:
        """Corners of each class by place."""
        return [(reach, cKDTree(corners)) for reach, corners in self._classes]

    def metres(self, points_m: FloatArray) -> FloatArray:
        """Radius of a ball about each point, shape (n, 3), that no face reaches into.

        Shape (n,); zero where none is known, inf without faces. Near where the world was last searched it is what was
        found there less the way from there: robots move little from frame to frame.
        """
        if self._found is not None:
            place, there = self._found
            away = np.linalg.norm(points_m - place, axis=1)
            if away.max() < NEAR * there:
                return np.asarray(there - away)
        clearance = self._searched(points_m)
        self._found = points_m[-1], float(clearance[-1])
        return clearance

    def _searched(self, points_m: FloatArray) -> FloatArray:
        nearest = np.full(len(points_m), np.inf)
        if self._found is None and len(points_m) == 1:
            # Robots that stay where they are need no tree, which takes longer to grow than a frame to render.
            for reach, corners in self._classes:
                nearest = np.minimum(nearest, np.sqrt(((corners - points_m) ** 2).sum(axis=1).min()) - reach)
            return np.asarray(np.maximum(nearest, 0.0))
        for reach, tree in self._trees:
            # What is farther than the nearest so far need not be found.
            distance, _ = tree.query(points_m, distance_upper_bound=nearest.max() + reach)
            nearest = np.minimum(nearest, distance - reach)
        return np.asarray(np.maximum(nearest, 0.0))
