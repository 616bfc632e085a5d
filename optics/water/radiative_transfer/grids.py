"""Depths and directions at which the radiance field is tabulated, for linear interpolation in each."""

from __future__ import annotations

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.water.radiative_transfer.surface import cosine_in_water, critical_cosine

DEPTH_COUNT = 32
SHALLOWEST_M = 0.05
AZIMUTH_DEG = (0, 4, 8, 12, 17, 23, 30, 38, 47, 57, 68, 80, 95, 110, 130, 155, 180)
WINDOW_DEG = (47.8, 47.4, 46.8, 45.5, 43, 40, 36, 32, 28, 24, 20, 16, 12.5, 9, 6, 3.5, 1.5, 0)
"""From the vertical: in steps that become small towards the zenith, where the cosine hardly changes, and towards the
edge of Snell's window, behind which the surface's reflectance falls steeply."""

OUTSIDE_SHARES = (0.01, 0.03, 0.06, 0.1, 0.16, 0.24, 0.34, 0.45, 0.56, 0.67, 0.77, 0.85, 0.91, 0.955, 0.985)
"""Cosines outside the window, as shares of that of its edge."""

SUN_OFFSETS_DEG = (-10, -6, -3, 0, 3, 6, 10)
"""From the refracted sun, around which light scattered by small angles more than once makes a second aureole."""

LOOKING_DOWN = (-1.0, -0.98, -0.92, -0.83, -0.73, -0.62, -0.51, -0.41, -0.31, -0.22, -0.15, -0.1, -0.06, -0.03, -0.01)
HORIZON = 1e-6
"""Cosine that stands for a horizontal line of sight, from either side."""


def depths_m(deepest_m: float) -> FloatArray:
    """The surface, then depths whose steps grow in proportion: shape (z,)."""
    return np.concatenate([[0.0], np.geomspace(SHALLOWEST_M, deepest_m, DEPTH_COUNT - 1)])


def cosines(n_water: FloatArray, sun_cosine_air: float) -> FloatArray:
    """Cosines of the directions looked along, ascending; dense at horizon, zenith, sun, and edge of Snell's window."""
    edges = critical_cosine(np.array([n_water.min(), n_water.max()]))
    outside = np.multiply(OUTSIDE_SHARES, edges[0])
    sun = np.degrees(np.arccos(cosine_in_water(sun_cosine_air, n_water.mean())))
    upwards = np.concatenate([WINDOW_DEG, np.maximum(sun + SUN_OFFSETS_DEG, 0)])
    window = np.cos(np.radians(upwards))
    return np.unique(np.concatenate([LOOKING_DOWN, [-HORIZON, HORIZON], outside, edges, window]))


def azimuths_rad() -> FloatArray:
    """Azimuths from the sun's, dense near it: shape (p,)."""
    return np.radians(AZIMUTH_DEG)
