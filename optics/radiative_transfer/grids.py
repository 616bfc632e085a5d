"""Depths and directions at which the radiance field is tabulated, for linear interpolation in each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from optics.radiative_transfer.surface import critical_cosine

FloatArray = NDArray[np.float64]

DEPTH_COUNT = 32
SHALLOWEST_M = 0.05
AZIMUTH_DEG = (0, 4, 8, 12, 17, 23, 30, 38, 47, 57, 68, 80, 95, 110, 130, 155, 180)
WINDOW_DEG = (47.9, 47, 45.5, 43, 40, 36, 32, 28, 24, 20, 16, 12.5, 9, 6, 3.5, 1.5, 0)
"""From the vertical: in steps that become small towards the zenith, where the cosine hardly changes, and towards the
edge of Snell's window, behind which the surface's reflectance falls steeply."""

OUTSIDE_SHARES = (0.01, 0.03, 0.06, 0.1, 0.16, 0.24, 0.34, 0.45, 0.56, 0.67, 0.78, 0.9)
"""Cosines outside the window, as shares of that of its edge."""

LOOKING_DOWN = (-1.0, -0.98, -0.92, -0.83, -0.73, -0.62, -0.51, -0.41, -0.31, -0.22, -0.15, -0.1, -0.06, -0.03, -0.01)
HORIZON = 1e-6
"""Cosine that stands for a horizontal line of sight, from either side."""


def depths_m(deepest_m: float) -> FloatArray:
    """The surface, then depths whose steps grow in proportion: shape (z,)."""
    return np.concatenate([[0.0], np.geomspace(SHALLOWEST_M, deepest_m, DEPTH_COUNT - 1)])


def cosines(n_water: FloatArray) -> FloatArray:
    """Cosines of the directions looked along, ascending; dense at the horizon and just inside Snell's window."""
    edges = critical_cosine(np.array([n_water.min(), n_water.max()]))
    outside = np.multiply(OUTSIDE_SHARES, edges[0])
    window = np.cos(np.radians(WINDOW_DEG))
    return np.unique(np.concatenate([LOOKING_DOWN, [-HORIZON, HORIZON], outside, edges, window[window > edges[1]]]))


def azimuths_rad() -> FloatArray:
    """Azimuths from the sun's, dense near it: shape (p,)."""
    return np.radians(AZIMUTH_DEG)
