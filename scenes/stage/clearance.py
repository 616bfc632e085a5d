"""How far a world keeps from a point: within that, no ray needs to be traced against it."""

from __future__ import annotations

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
        corners = world.vertices_m[world.faces]
        longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1).max(axis=1, initial=0)
        reach = np.zeros(len(world.vertices_m))
        np.maximum.at(reach, world.faces.ravel(), np.repeat(longest / np.sqrt(3), 3))
        size = np.ceil(np.log2(np.maximum(reach, SMALLEST_REACH_M) / SMALLEST_REACH_M)).astype(int)
        used = np.unique(world.faces)
        self._classes = [
            (SMALLEST_REACH_M * 2.0**each, cKDTree(world.vertices_m[used[size[used] == each]]))
            for each in np.unique(size[used])
        ]
        self._found: tuple[FloatArray, float] | None = None

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
        for reach, tree in self._classes:
            # What is farther than the nearest so far need not be found.
            distance, _ = tree.query(points_m, distance_upper_bound=nearest.max() + reach)
            nearest = np.minimum(nearest, distance - reach)
        return np.asarray(np.maximum(nearest, 0.0))
