"""Radiance in any direction and at any depth: the source of the modes integrated along the line of sight."""

from __future__ import annotations

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.water.radiative_transfer.discrete_ordinates import Modes, parity
from optics.water.radiative_transfer.quadrature import harmonics
from optics.water.radiative_transfer.surface import internal_reflectance

RESONANCE = 1e-6
"""A line of sight along which the water dims light just as a mode decays, to this share, is tilted by as much: less
than 1e-4 degrees. Nearer, the difference of both would be lost to rounding."""


def many_times_scattered(modes: Modes, optical_depth: FloatArray, cosine: FloatArray) -> FloatArray:
    """Fourier components of the radiance that is neither sky or sun unscattered nor sun scattered only once.

    What the surface reflects down again is in it, but for sunlight that was scattered only once.

    Parameters
    ----------
    optical_depth : array, shape (z,)
    cosine : array, shape (p,)
        Of the direction looked along: what has a positive one is light from above. Not zero.

    Returns
    -------
    array, shape (m, z, p)
    """
    legendre = harmonics(len(modes.phase_moments), cosine)
    scattered = modes.albedo * modes.phase_moments[:, None] * legendre
    source = np.swapaxes(modes.moments, -1, -2) @ scattered
    result = np.empty((len(source), len(optical_depth), len(cosine)))
    up, down = cosine < 0, cosine > 0
    result[..., up] = _from_below(modes, optical_depth, cosine[up], source[..., up])
    turned = parity(len(legendre))[..., None] * scattered[..., down]
    mirrored = np.swapaxes(modes.moments, -1, -2) @ turned
    at_surface = _from_below(modes, np.zeros(1), -cosine[down], mirrored)
    reflected = internal_reflectance(cosine[down], modes.n_water) * at_surface
    dimmed = np.exp(-optical_depth[:, None] / cosine[down])
    result[..., down] = reflected * dimmed + _from_above(modes, optical_depth, cosine[down], source[..., down])
    return result


def _from_below(modes: Modes, optical_depth: FloatArray, cosine: FloatArray, source: FloatArray) -> FloatArray:
    """``int_tau^inf J(t) exp(-(t - tau) / |mu|) dt / |mu|`` of ``J = sum source_k exp(-rate_k t)``."""
    decay = np.exp(-modes.rate[:, None, :] * optical_depth[:, None])
    return np.asarray(decay @ (source / (1 - modes.rate[..., None] * cosine)))


def _from_above(modes: Modes, optical_depth: FloatArray, cosine: FloatArray, source: FloatArray) -> FloatArray:
    """``int_0^tau J(t) exp(-(tau - t) / mu) dt / mu`` of ``J = sum source_k exp(-rate_k t)``."""
    gap = 1 - modes.rate[..., None] * cosine
    resonant = (np.abs(gap) < RESONANCE).any(axis=1)
    along = np.where(resonant, cosine * (1 + 2 * RESONANCE), cosine)
    shared = source / (1 - modes.rate[..., None] * along[:, None, :])
    decay = np.exp(-modes.rate[:, None, :] * optical_depth[:, None])
    dimmed = np.exp(-optical_depth[:, None] / along[:, None, :])
    return np.asarray(decay @ shared - dimmed * shared.sum(axis=1)[:, None, :])


def _mean_decay(exponent: FloatArray) -> FloatArray:
    """``(1 - exp(-x)) / x``, which is 1 at zero."""
    safe = np.where(exponent > 0, exponent, 1.0)
    return np.where(exponent > 0, -np.expm1(-safe) / safe, 1.0)


def scattering_angle(cosine: FloatArray, azimuth_rad: FloatArray, sun_cosine: float) -> FloatArray:
    """Angle between directions looked along and that towards the refracted sun: shape (m, p)."""
    sines = np.sqrt(1 - cosine**2) * np.sqrt(1 - sun_cosine**2)
    return np.arccos(np.clip(cosine[:, None] * sun_cosine + np.outer(sines, np.cos(azimuth_rad)), -1, 1))


def once_scattered(
    *, scattered: FloatArray, sun_cosine: float, attenuation: float, depth_m: FloatArray, cosine: FloatArray
) -> FloatArray:
    """Sunlight scattered once, in open water: what a renderer adds in closed form.

    ``int J(z') exp(-c* s) ds`` along the line of sight, with ``J = scattered exp(-c* z / mu_s)``.

    Parameters
    ----------
    scattered : array, shape (p, ...)
        Scattering coefficient times phase function times the sun's irradiance just below the surface.
    depth_m : array, shape (z,)
    cosine : array, shape (p,)
        Of the direction looked along; not zero.

    Returns
    -------
    array, shape (z, p, ...)
    """
    beam = attenuation * depth_m[:, None] / sun_cosine
    slant = attenuation * depth_m[:, None] / cosine
    below = np.exp(-beam) / (attenuation * (1 - np.minimum(cosine, 0) / sun_cosine))
    length = np.where(cosine > 0, depth_m[:, None] / np.abs(cosine), 0)
    above = length * np.exp(-np.minimum(beam, np.abs(slant))) * _mean_decay(np.abs(slant - beam))
    factor = np.where(cosine < 0, below, above)
    return factor.reshape(*factor.shape, *(1,) * (scattered.ndim - 1)) * scattered
