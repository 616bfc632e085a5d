"""Noise: of photons, of the read-out, and the fixed pattern; and the mean of what saturation leaves of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

FloatImage = NDArray[np.float32]

FEWEST_NORMAL_E = 10.0
"""From this many electrons on a normal variable, bent to the Poisson distribution's skewness, stands for it. Its
distribution function then differs from the exact one, with 3 electrons of read noise, by less than 1e-3 everywhere."""

MOST_EVENTS = 64
"""More than ever come where fewer than `FEWEST_NORMAL_E` are expected."""

READ_NOISE_NODES = 7
"""Of the sum over the read noise."""

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
        signal[few] = few_events(charge_e[few], rng) + np.float32(read_noise_e) * z[few]
    # Near the full well the two noises part: the charge is cut, the read noise is not.
    full = np.flatnonzero(charge_e + np.float32(TAIL) * np.sqrt(charge_e) > full_well_e)
    if full.size:
        mean = charge_e[full]
        charge = mean + np.sqrt(mean) * rng.standard_normal(full.size, dtype=np.float32)
        signal[full] = np.minimum(charge, full_well_e) + np.float32(read_noise_e) * z[full]
    return np.asarray(signal.reshape(shape))


def few_events(mean: FloatImage, rng: np.random.Generator) -> FloatImage:
    """Poisson numbers of small means by inversion: as many as there are k with P(n <= k) <= u, u even in [0, 1).

    Exact to float32 (2^-24 in probability), and for whole images three times as fast as NumPy's, which draws one at a
    time.
    """
    even = rng.random(mean.shape, dtype=np.float32)
    probability = np.exp(-mean)
    cumulative, count = probability.copy(), np.zeros_like(mean)
    for k in range(1, MOST_EVENTS):
        more = even >= cumulative
        if not more.any():
            break
        count += more
        probability *= mean
        probability *= np.float32(1 / k)
        cumulative += probability
    return count


def mean_signal(
    charge_e: FloatImage, *, read_noise_e: float, full_well_e: float, end_e: FloatImage | float
) -> FloatImage:
    """Mean of `noisy_signal` that is cut at the converter's end: E min(min(x, well) + r, end), electrons.

    Where the well never shows (infinite), both noises are one normal variable. Else the mean over the read noise r of
    E min(x, well, end - r) is a Gauss-Hermite sum; it converges fast, as x is much wider than r near a full well.
    """
    if not np.isfinite(full_well_e):
        return mean_below(charge_e, charge_e + np.float32(read_noise_e**2), end_e)
    nodes, weights = np.polynomial.hermite_e.hermegauss(READ_NOISE_NODES)
    means = [
        weight * mean_below(charge_e, charge_e, np.minimum(end_e - read_noise_e * node, full_well_e))
        for node, weight in zip(nodes, weights / weights.sum(), strict=True)
    ]
    return np.asarray(np.sum(means, axis=0), dtype=np.float32)


def mean_below(mean: FloatImage, variance: FloatImage, ceiling: FloatImage | float) -> FloatImage:
    """Mean of a normal variable that is cut at a ceiling.

    It is ceiling - sigma (a Phi(a) + phi(a)), with a = (ceiling - mean) / sigma.
    """
    near = np.flatnonzero(mean + TAIL * np.sqrt(variance) > ceiling)
    cut = np.array(mean, dtype=np.float32)
    if near.size:
        sigma = np.sqrt(np.maximum(variance.ravel()[near].astype(np.float64), 1e-12))
        limit = np.broadcast_to(ceiling, mean.shape).ravel()[near]
        a = (limit - mean.ravel()[near].astype(np.float64)) / sigma
        density = np.exp(-0.5 * a * a) / np.sqrt(2 * np.pi)
        cut.ravel()[near] = limit - sigma * (a * ndtr(a) + density)
    return cut
