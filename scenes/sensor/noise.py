"""Noise: of photons, of the read-out, and the fixed pattern; and the mean of what saturation leaves of it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from optics.kernels.backend import Float32, Philox4x32, dr

FloatImage = NDArray[np.float32]

FEWEST_NORMAL_E = 10.0
"""From this many electrons on a normal variable, bent to the Poisson distribution's skewness, stands for it. Its
distribution function then differs from the exact one, with 3 electrons of read noise, by less than 1e-3 everywhere."""

MOST_EVENTS = 64
"""More than ever come where fewer than `FEWEST_NORMAL_E` are expected."""

READ_NOISE_NODES = 7
"""Of the sum over the read noise."""

DROPPED_BITS, EVEN_STEP = 8, 2.0**-24
"""Of 32 even bits single precision holds 24."""

TAIL = 6.0
"""Standard deviations beyond which a normal variable is taken not to reach: once in 1e9 draws."""


def frame_key(seed: int, frame: int) -> int:
    """Key of one frame's noise, 64 bits: the same whatever was exposed before it."""
    return int(np.random.SeedSequence((seed, frame)).generate_state(1, np.uint64)[0])


def fixed_pattern(seed: int, shape: tuple[int, ...]) -> tuple[FloatImage, FloatImage]:
    """Standard normal planes of a sensor's response (PRNU) and of its dark signal (DSNU)."""
    rng = np.random.Generator(np.random.SFC64(seed))
    return rng.standard_normal(shape, dtype=np.float32), rng.standard_normal(shape, dtype=np.float32)


def noisy_signal(charge_e: Any, *, read_noise_e: Any, full_well_e: Any, key: Any, number: Any) -> Any:
    """Kernel: electrons read out of pixels that collect `charge_e` on average.

    Poisson, cut at the full well, plus read noise.

    Parameters
    ----------
    charge_e : Float32
        Mean of photo electrons and dark current, at least 0.
    read_noise_e, full_well_e : Float32
    key : UInt64
        Of the frame (`frame_key`).
    number : UInt32
        Of each pixel in its frame: what is drawn for one does not depend on which others are drawn.

    Returns
    -------
    Float32
    """
    even = Philox4x32(key, number).next_uint32x4()
    z, other = _two_normals(even.x, even.y)
    # One normal variable carries both noises: mean m, variance m + r^2 and third moment m - 4 c^3, which is m but for
    # a hundredth, come from m + s z + c (z^2 - 1) with c = m / (6 (m + r^2)) (Cornish and Fisher 1938).
    variance = charge_e + dr.square(read_noise_e)
    bend = charge_e / dr.maximum(6 * variance, 1e-30)
    spread = dr.safe_sqrt(variance - 2 * dr.square(bend))
    read_out = read_noise_e * z
    few = charge_e < FEWEST_NORMAL_E
    events = few_events(charge_e, Float32(even.z >> DROPPED_BITS) * EVEN_STEP, few)
    signal = dr.select(few, events + read_out, charge_e + spread * z + bend * (dr.square(z) - 1))
    # Near the full well the two noises part: the charge is cut, the read noise is not.
    deviation = dr.sqrt(charge_e)
    cut = dr.minimum(charge_e + deviation * other, full_well_e) + read_out
    return dr.select(charge_e + TAIL * deviation > full_well_e, cut, signal)


def _two_normals(first: Any, second: Any) -> tuple[Any, Any]:
    """Kernel: two independent standard normal numbers of two even 32-bit ones (Box and Muller 1958)."""
    radius = dr.sqrt(-2 * dr.log(Float32((first >> DROPPED_BITS) + 1) * EVEN_STEP))
    sine, cosine = dr.sincos(Float32(second >> DROPPED_BITS) * (2 * np.pi * EVEN_STEP))
    return radius * cosine, radius * sine


def few_events(mean: Any, even: Any, active: Any) -> Any:
    """Kernel: Poisson numbers of small means by inversion: as many as there are k with P(n <= k) <= u, u in [0, 1).

    Exact to float32 (2^-24 in probability).
    """

    def one_more(k: Any, probability: Any, cumulative: Any) -> tuple[Any, Any, Any]:
        k = k + 1
        probability = probability * mean / k
        return k, probability, cumulative + probability

    def goes_on(k: Any, probability: Any, cumulative: Any) -> Any:
        return active & (even >= cumulative) & (k < MOST_EVENTS)

    none = dr.exp(-mean)
    count, _, _ = dr.while_loop((dr.zeros(Float32, dr.width(mean)), none, none), goes_on, one_more)
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
