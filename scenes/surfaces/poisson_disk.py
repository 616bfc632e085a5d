"""Places that keep their distance from each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from optics.kernels.arrays import FloatArray


def spaced(points_m: FloatArray, radius_m: FloatArray) -> NDArray[np.int64]:
    """Positions of the points that are kept when none may stand within another's disk, in the given order.

    Dart throwing (Cook 1986, "Stochastic sampling in computer graphics") over given candidates: a point is kept unless
    an earlier one that was kept is nearer than the sum of both radii.

    Parameters
    ----------
    points_m : array, shape (n, 3)
    radius_m : array, shape (n,)
    """
    pairs = cKDTree(points_m).query_pairs(2 * float(radius_m.max()), output_type="ndarray")
    first, second = np.sort(pairs, axis=1).T
    near = np.linalg.norm(points_m[first] - points_m[second], axis=1) < radius_m[first] + radius_m[second]
    first, second = first[near], second[near]
    kept = np.ones(len(points_m), dtype=bool)
    # In the order of the earlier of the two, whose own fate is then settled.
    for earlier, later in sorted(zip(first.tolist(), second.tolist(), strict=True)):
        if kept[earlier]:
            kept[later] = False
    return np.flatnonzero(kept)
