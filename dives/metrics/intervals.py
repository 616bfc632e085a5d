"""How far a mean or a fraction may lie from what was counted: confidence intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import binomtest, bootstrap

CONFIDENCE = 0.95

RESAMPLES = 4999
"""Of a bootstrap: its ends move by about a hundredth of the interval from seed to seed."""


@dataclass(frozen=True, kw_only=True)
class Interval:
    """An estimate and where the truth lies with the confidence asked for.

    Attributes
    ----------
    estimate : float, optional
        None when nothing was counted.
    low, high : float, optional
        None when the interval cannot be told, as from a single number.
    count : int
        Numbers or trials it stands on.
    """

    estimate: float | None
    low: float | None
    high: float | None
    count: int


def mean_interval(values: ArrayLike, *, seed: int = 0, confidence: float = CONFIDENCE) -> Interval:
    """Mean of independent numbers, with the percentile interval of a bootstrap (Efron 1979).

    Parameters
    ----------
    values : array, shape (n,)
        What is not finite does not count.
    seed : int
        Of the bootstrap.
    confidence : float
    """
    numbers = np.asarray(values, dtype=np.float64)
    finite = numbers[np.isfinite(numbers)]
    if len(finite) == 0:
        return Interval(estimate=None, low=None, high=None, count=0)
    mean = float(finite.mean())
    if len(finite) == 1:
        return Interval(estimate=mean, low=None, high=None, count=1)
    found = bootstrap(
        (finite,),
        np.mean,
        n_resamples=RESAMPLES,
        confidence_level=confidence,
        method="percentile",
        rng=np.random.default_rng(seed),
    ).confidence_interval
    # Between resamples that are all the same, the quantiles' interpolation may round them past each other.
    low, high = sorted((float(found.low), float(found.high)))
    return Interval(estimate=mean, low=low, high=high, count=len(finite))


def fraction_interval(successes: int, trials: int, *, confidence: float = CONFIDENCE) -> Interval:
    """Fraction of independent trials, with the interval of Wilson (1927): it does not leave 0 to 1.

    Raises
    ------
    ValueError
        When there are more successes than trials, or fewer than none.
    """
    if not 0 <= successes <= trials:
        raise ValueError(f"expected between 0 and {trials} successes, got {successes}")
    if trials == 0:
        return Interval(estimate=None, low=None, high=None, count=0)
    found = binomtest(successes, trials).proportion_ci(confidence_level=confidence, method="wilson")
    return Interval(estimate=successes / trials, low=float(found.low), high=float(found.high), count=trials)


def difference_interval(
    values: Sequence[float | None], others: Sequence[float | None], *, seed: int = 0, confidence: float = CONFIDENCE
) -> Interval:
    """Mean of `others` minus `values`, pair by pair, with its interval.

    Dives of the same seed share waves, noise and sway, so that differences between pairs scatter less than the numbers.

    Parameters
    ----------
    values, others : sequences of float or None, length n
        In the same order. Pairs with None do not count.
    """
    pairs = np.array([(value, other) for value, other in zip(values, others, strict=True)], dtype=np.float64)
    return mean_interval(pairs[:, 1] - pairs[:, 0] if len(pairs) else [], seed=seed, confidence=confidence)
