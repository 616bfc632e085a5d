"""Phase functions: how water scatters light by angle, 1/sr, normalised over the sphere."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

PETZOLD_INDEX = 1.10
PETZOLD_SLOPE = 3.5835
"""Particle index and Junge slope at which Fournier-Forand fits Petzold's average phase function (backscattered
fraction 0.0183; Mobley, Sundman & Boss 2002, Applied Optics 41, 1035)."""


def fournier_forand(
    angle: ArrayLike, index: float = PETZOLD_INDEX, slope: float = PETZOLD_SLOPE
) -> NDArray[np.float64]:
    """Fournier-Forand phase function, 1/sr (Fournier & Jonasz 1999, SPIE 3761, 62).

    Parameters
    ----------
    angle : array
        Scattering angle, radians, above zero: the function diverges in the forward direction.
    index : float
        Particle refractive index relative to water.
    slope : float
        Slope of the Junge size distribution, 3 to 5.
    """
    psi = np.asarray(angle, dtype=np.float64)
    nu = (3 - slope) / 2
    sine2 = np.sin(psi / 2) ** 2
    delta = 4 / (3 * (index - 1) ** 2) * sine2
    delta_back = 4 / (3 * (index - 1) ** 2)
    power, power_back = delta**nu, delta_back**nu
    forward = nu * (1 - delta) - (1 - power) + (delta * (1 - power) - nu * (1 - delta)) / sine2
    forward /= 4 * np.pi * (1 - delta) ** 2 * power
    backward = (1 - power_back) / (16 * np.pi * (delta_back - 1) * power_back) * (3 * np.cos(psi) ** 2 - 1)
    return np.asarray(forward + backward)


def fournier_forand_backscattered_fraction(index: float = PETZOLD_INDEX, slope: float = PETZOLD_SLOPE) -> float:
    """Fraction scattered by more than 90 degrees (Mobley, Sundman & Boss 2002, eq. 7)."""
    nu = (3 - slope) / 2
    delta = 2 / (3 * (index - 1) ** 2)
    return float(1 - (1 - delta ** (nu + 1) - 0.5 * (1 - delta**nu)) / ((1 - delta) * delta**nu))
