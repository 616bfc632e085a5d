"""Noise: of photons, of the read-out, and the fixed pattern; and the mean of what saturation leaves of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

FloatImage = NDArray[np.float32]

FEWEST_NORMAL_E = 10.0
"""From this many electrons on a normal variable, bent to the Poisson distribution's skewness, stands for it. Its
distribution function then differs from the exact one, with 3 electrons of read noise, by less than 1e-3 everywhere."""

TAIL = 6.0
"""Standard deviations beyond which a normal variable is taken not to reach: once in 1e9 draws."""


def frame_generator(seed: int, frame: int) -> np.random.Generator:
    """Generator of one frame's noise: the same whatever was exposed before it."""
    return np.random.Generator(np.random.SFC64(np.random.SeedSequence((seed, frame))))


def fixed_pattern(seed: int, shape: tuple[int, ...]) -> tuple[FloatImage, FloatImage]:
    """Standard normal planes of a sensor's response (PRNU) and of its dark signal (DSNU)."""
    rng = np.random.Generator(np.random.SFC64(seed))
    return rng.standard_normal(shape, dtype=np.float32), rng.standard_normal(shape, dtype=np.float32)


def noisy_signal(
    charge_e: FloatImage, *, read_noise_e: float, full_well_e: float, rng: np.random.Generator
) -> FloatImage:
    """Electrons read out of pixels that collect `charge_e` on average: Poisson, cut at the full well, plus read noise.

    Parameters
    ----------
    charge_e : array
        Mean of photo electrons and dark current, at least 0.
    read_noise_e, full_well_e : float
    rng : numpy.random.Generator

    Returns
    -------
    array
        float32, of the same shape.
    """
    shape = charge_e.shape
    z = rng.standard_normal(shape, dtype=np.float32)
    # One normal variable carries both noises: mean m, variance m + r^2 and third moment m - 4 c^3, which is m but for
    # a hundredth, come from m + s z + c (z^2 - 1) with c = m / (6 (m + r^2)) (Cornish and Fisher 1938).
    variance = charge_e + np.float32(read_noise_e**2)
    bend = charge_e / np.maximum(6 * variance, np.float32(1e-30))
    spread = np.sqrt(variance - 2 * bend * bend, where=charge_e >= FEWEST_NORMAL_E, out=np.zeros_like(variance))
    signal = (charge_e + spread * z + bend * (z * z - 1)).ravel()
    charge_e, z = charge_e.ravel(), z.ravel()
    few = np.flatnonzero(charge_e < FEWEST_NORMAL_E)
    if few.size:
        signal[few] = rng.poisson(charge_e[few]) + np.float32(read_noise_e) * z[few]
    # Near the full well the two noises part: the charge is cut, the read noise is not.
    full = np.flatnonzero(charge_e > full_well_e - TAIL * full_well_e**0.5)
    if full.size:
        mean = charge_e[full]
        charge = mean + np.sqrt(mean) * rng.standard_normal(full.size, dtype=np.float32)
        signal[full] = np.minimum(charge, full_well_e) + np.float32(read_noise_e) * z[full]
    return np.asarray(signal.reshape(shape))


def mean_below(mean: FloatImage, variance: FloatImage, ceiling: float) -> tuple[FloatImage, FloatImage]:
    """Mean and variance of a normal variable that is cut at a ceiling.

    With a = (ceiling - mean) / sigma: mean - sigma (phi(a) - a (1 - Phi(a))), and the second moment alike.
    """
    near = np.flatnonzero(mean > ceiling - TAIL * np.sqrt(variance))
    cut_mean, cut_variance = np.array(mean, dtype=np.float32), np.array(variance, dtype=np.float32)
    if near.size:
        sigma = np.sqrt(np.maximum(variance.flat[near].astype(np.float64), 1e-12))
        a = (ceiling - mean.flat[near].astype(np.float64)) / sigma
        beyond, density = ndtr(-a), np.exp(-0.5 * a * a) / np.sqrt(2 * np.pi)
        # Moments of the part that is cut away, (x - ceiling)+.
        first = sigma * (density - a * beyond)
        second = sigma**2 * ((1 + a * a) * beyond - a * density)
        cut_mean.flat[near] = ceiling - sigma * a - first
        # Var(min(x, C)) = Var(x) - Var((x - C)+) - 2 Cov(min, (x - C)+), and the covariance is first * (C - E min).
        below = sigma * a + first
        cut_variance.flat[near] = np.maximum(sigma**2 - (second - first**2) - 2 * first * below, 0)
    return cut_mean, cut_variance
