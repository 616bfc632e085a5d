"""How far a world keeps from a point: within that, no ray needs to be traced against it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from scenes.worlds import World

SMALLEST_REACH_M = 0.05


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

    def metres(self, point_m: ArrayLike) -> float:
        """Radius of a ball about a point that no face reaches into; zero when none is known, inf without faces."""
        nearest = np.inf
        for reach, tree in self._classes:
            # What is farther than the nearest so far need not be found.
            nearest = min(nearest, float(tree.query(point_m, distance_upper_bound=nearest + reach)[0]) - reach)
        return max(nearest, 0.0)
