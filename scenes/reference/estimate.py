"""Means and standard errors of what `volpathmis` sees along rays."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.kernels.backend import UInt32, dr, mi

LANES_PER_LAUNCH = 2**19
"""Paths in one launch: bounds the memory to some 100 MB, and a launch to seconds, so that it can be interrupted."""

ROULETTE_DEPTH = 48
"""Events that every path lives through. Mitsuba's roulette counts in the density of a path that hits a lamp by chance,
but not in that of the lamp's own sampling, so what comes after it is up to a quarter of 1 - q too dark (q the chance to
live on, 0.95 at most); light scattered 48 times is a few parts in 10 000 of what a camera sees."""

RayMaker = Callable[[Any, Any], Any]
"""Pixels (`UInt32`) and a sampler to one Mitsuba ray for each."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """Mean of independent samples and the variance of that mean, shape (pixels, channels)."""

    mean: FloatArray
    variance: FloatArray


def integrator() -> Any:
    """Stock `volpathmis` that follows every path to its end."""
    return mi.load_dict({"type": "volpathmis", "max_depth": -1, "rr_depth": ROULETTE_DEPTH})


def launches(pixels: int, samples: int) -> list[int]:
    """Samples per pixel of each launch."""
    most = max(1, LANES_PER_LAUNCH // pixels)
    return [most] * (samples // most) + ([samples % most] if samples % most else [])


def estimate(
    scene: Any,
    rays: RayMaker,
    *,
    medium: Any = None,
    weight: FloatArray | None = None,
    pixels: int,
    samples: int,
    seed: tuple[int, ...],
    after_launch: Callable[[], None] = lambda: None,
) -> Estimate:
    """Average `samples` independent paths per pixel.

    Parameters
    ----------
    scene : mitsuba Scene
    rays : RayMaker
    medium : mitsuba Medium, optional
        What the rays start in; None for air.
    weight : array, shape (channels, 3), optional
        Of the scene's three wavelengths in each channel; by default each is its own channel.
    samples : int
        At least 2: the variance is that of the samples themselves.
    seed : tuple of int
        The same seed gives the same numbers on the same kind of machine.
    after_launch : callable
        Called after every launch.
    """
    if samples < 2:
        raise ValueError(f"expected at least 2 samples per pixel, to know their spread, got {samples}")
    weight = np.eye(3) if weight is None else weight
    total, squares = np.zeros((2, pixels, len(weight)))
    for sums, sums_of_squares in _sums(scene, rays, medium, weight, pixels, samples, seed):
        total = total + sums
        squares = squares + sums_of_squares
        after_launch()
    mean = total / samples
    variance = np.maximum(squares / samples - mean**2, 0) / (samples - 1)
    return Estimate(mean=mean, variance=variance)


def _sums(  # noqa: PLR0917
    scene: Any,
    rays: RayMaker,
    medium: Any,
    weight: FloatArray,
    pixels: int,
    samples: int,
    seed: tuple[int, ...],
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Sum and sum of squares over the samples of each launch."""
    tracer = integrator()
    for launch, count in enumerate(launches(pixels, samples)):
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(int(np.random.SeedSequence([*seed, launch]).generate_state(1)[0]), pixels * count)
        pixel = dr.arange(UInt32, pixels * count) // count
        radiance = tracer.sample(scene, sampler, rays(pixel, sampler), medium)[0]
        # Of three wavelengths at once: sums of blocks have what they add up computed, each on its own.
        dr.eval(radiance)
        channels = [sum(float(w) * radiance[node] for node, w in enumerate(row)) for row in weight]
        sums = [dr.block_sum(channel, count) for channel in channels]
        squares = [dr.block_sum(dr.square(channel), count) for channel in channels]
        dr.eval(sums, squares)
        yield _rows(sums), _rows(squares)


def _rows(columns: list[Any]) -> FloatArray:
    return np.stack([np.array(column, dtype=np.float64) for column in columns], axis=-1)
