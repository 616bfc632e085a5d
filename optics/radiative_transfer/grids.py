"""Depths and directions at which the radiance field is tabulated, for linear interpolation in each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from optics.radiative_transfer.surface import cosine_in_water, critical_cosine

FloatArray = NDArray[np.float64]

DEPTH_COUNT = 40
SHALLOWEST_M = 0.1
AZIMUTH_DEG = (0, 5, 10, 15, 20, 27, 35, 45, 60, 75, 90, 110, 130, 150, 180)
WINDOW_COSINES_AIR = (0.1, 0.2, 0.35, 0.5, 0.65, 0.75, 0.85, 0.92, 0.97, 1.0)
OUTSIDE_SHARES = (0.02, 0.05, 0.1, 0.17, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75, 0.85, 0.93)
LOOKING_DOWN = (-1.0, -0.9, -0.8, -0.7, -0.6, -0.5, -0.4, -0.3, -0.22, -0.15, -0.1, -0.06, -0.03)
HORIZON = 1e-6
"""Cosine that stands for a horizontal line of sight, from either side."""


def depths_m(deepest_m: float) -> FloatArray:
    """The surface, then depths whose steps grow in proportion: shape (z,)."""
    return np.concatenate([[0.0], np.geomspace(SHALLOWEST_M, deepest_m, DEPTH_COUNT - 1)])


def cosines(n_water: FloatArray) -> FloatArray:
    """Cosines of the directions looked along, ascending; dense at the horizon and just inside Snell's window."""
    edges = critical_cosine(np.array([n_water.min(), n_water.max()]))
    outside = np.multiply(OUTSIDE_SHARES, edges[0])
    window = cosine_in_water(np.array(WINDOW_COSINES_AIR), n_water.max())
    return np.unique(np.concatenate([LOOKING_DOWN, [-HORIZON, HORIZON], outside, edges, window]))


def azimuths_rad() -> FloatArray:
    """Azimuths from the sun's, dense near it: shape (p,)."""
    return np.radians(AZIMUTH_DEG)
