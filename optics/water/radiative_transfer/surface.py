"""The flat sea surface: refraction, Fresnel transmittance, internal reflection, as NumPy functions of cosines."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from optics.kernels.arrays import FloatArray


def critical_cosine(n_water: ArrayLike) -> FloatArray:
    """Cosine, in water, of the edge of Snell's window: light nearer to the horizontal is totally reflected."""
    return np.asarray(np.sqrt(1 - 1 / np.asarray(n_water, dtype=np.float64) ** 2))


def cosine_in_water(cosine_air: ArrayLike, n_water: ArrayLike) -> FloatArray:
    """Cosine to the vertical in water of light that has `cosine_air` above the surface (Snell)."""
    return np.asarray(np.sqrt(1 - (1 - np.square(cosine_air)) / np.square(n_water)))


def cosine_in_air(cosine_water: ArrayLike, n_water: ArrayLike) -> FloatArray:
    """Cosine to the vertical above the surface of light that has `cosine_water` below; 0 outside Snell's window."""
    return np.asarray(np.sqrt(np.maximum(1 - np.square(n_water) * (1 - np.square(cosine_water)), 0)))


def transmittance(cosine_air: ArrayLike, n_water: ArrayLike) -> FloatArray:
    """Unpolarised Fresnel transmittance (power) of the surface; the same downwards and upwards on one path.

    Radiance that goes down is multiplied by this and by the index squared. Born & Wolf, Principles of Optics,
    section 1.5.3.
    """
    air, n = np.asarray(cosine_air, dtype=np.float64), np.asarray(n_water, dtype=np.float64)
    water = cosine_in_water(air, n)
    s, p = air + n * water, n * air + water
    return np.asarray(2 * n * air * water * (1 / s**2 + 1 / p**2))


def internal_reflectance(cosine_water: ArrayLike, n_water: ArrayLike) -> FloatArray:
    """Share of light from below that the surface sends down again: 1 outside Snell's window, Fresnel's inside."""
    return 1 - transmittance(cosine_in_air(cosine_water, n_water), n_water)
