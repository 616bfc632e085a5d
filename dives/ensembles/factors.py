"""What a metric of a full factorial ensemble depends on: its factors, and each two of them together.

An analysis of variance of a balanced design: the sums of squares of factors and interactions add up with the rest to
that of all dives, each is judged against the rest by Fisher's F, and each setting has its mean with an interval. What
three factors or more do together counts as rest, beside the seeds.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as fisher_f

from dives.ensembles.run import Outcome
from dives.metrics.intervals import Interval, mean_interval
from rigs.atomic_files import csv_text

METRICS = ("acquired", "visible_fraction", "found_fraction", "time_on_target_fraction", "gaze_error_held_rms_deg")
"""That a grid is analysed for: is the target found at all; then is it to be seen, found, held, and how well.

All but the first are reported for dives that acquired it alone."""

BETWEEN = " x "
"""Between the names of two factors, and between their levels."""


@dataclass(frozen=True, kw_only=True)
class Level:
    """One level of a factor, or of two: the mean over all dives that have it.

    Attributes
    ----------
    levels : tuple of str
        One for each factor of the effect.
    interval : Interval
    """

    levels: tuple[str, ...]
    interval: Interval


@dataclass(frozen=True, kw_only=True)
class Effect:
    """What a factor does to a metric, or what two do beyond what each does.

    Attributes
    ----------
    metric : str
    factors : tuple of str
        One, or two.
    share : float, optional
        Of the metric's sum of squares over all dives, 0 to 1; None where a setting has no number.
    probability : float, optional
        Of so large a share or a larger one by chance alone, by Fisher's F; None where nothing is left to compare with.
    levels : list of Level
    """

    metric: str
    factors: tuple[str, ...]
    share: float | None
    probability: float | None
    levels: list[Level]


def effects(outcomes: Sequence[Outcome], metric: str) -> list[Effect]:
    """Effects of all factors and of each two of them on a metric, the factors first.

    Parameters
    ----------
    outcomes : sequence of Outcome
        Of every combination of levels, as many dives of each.
    metric : str
        Of `dives.metrics.DEFINITIONS`; fractions, true and false count as numbers.
    """
    factors = _factors(outcomes)
    numbers = _numbers(outcomes, factors, metric)
    terms = [*((name,) for name in factors), *combinations(factors, 2)]
    squares = _squares(numbers, len(factors)) if np.isfinite(numbers).all() and numbers.size else None
    return [
        Effect(
            metric=metric,
            factors=term,
            share=None if squares is None else squares.share(axes),
            probability=None if squares is None else squares.probability(axes),
            levels=list(_levels(numbers, [factors[name] for name in term], axes)),
        )
        for term in terms
        for axes in [tuple(list(factors).index(name) for name in term)]
    ]


def effects_csv(found: Sequence[Effect]) -> str:
    """One line an effect: its share of the sum of squares and the probability of that by chance."""
    return csv_text(
        [("metric", "effect", "share", "probability")]
        + [(each.metric, BETWEEN.join(each.factors), each.share, each.probability) for each in found]
    )


def levels_csv(found: Sequence[Effect]) -> str:
    """One line a level of an effect: its mean and interval over all dives that have it."""
    return csv_text(
        [("metric", "effect", "level", "mean", "low", "high", "count")]
        + [
            (each.metric, BETWEEN.join(each.factors), BETWEEN.join(level.levels), *_plain(level.interval))
            for each in found
            for level in each.levels
        ]
    )


def effects_table(found: Sequence[Effect]) -> list[list[str]]:
    """Effects down, metrics across, the head first; what chance gives in less than one case of twenty has a star."""
    metrics = list(dict.fromkeys(each.metric for each in found))
    cells = {(each.factors, each.metric): _share_text(each) for each in found}
    terms = dict.fromkeys(each.factors for each in found)
    return [["share of what varies", *metrics]] + [
        [BETWEEN.join(term), *(cells[term, metric] for metric in metrics)] for term in terms
    ]


@dataclass(frozen=True, kw_only=True)
class _Squares:
    """Sums of squares by term, and what is left of the whole, with degrees of freedom."""

    terms: Mapping[tuple[int, ...], tuple[float, int]]
    whole: float
    left: float
    free: int

    def share(self, axes: tuple[int, ...]) -> float | None:
        return self.terms[axes][0] / self.whole if self.whole > 0 else None

    def probability(self, axes: tuple[int, ...]) -> float | None:
        squares, free = self.terms[axes]
        if self.free == 0 or self.left <= 1e-12 * self.whole:
            return None
        return float(fisher_f.sf(squares / free / (self.left / self.free), free, self.free))


def _squares(numbers: NDArray[np.float64], count: int) -> _Squares:
    """Analysis of variance of numbers by factors on the first axes, repetitions on the last."""
    mean = numbers.mean()
    terms: dict[tuple[int, ...], tuple[float, int]] = {}
    for size in (1, 2):
        for axes in combinations(range(count), size):
            others = tuple(axis for axis in range(numbers.ndim) if axis not in axes)
            effect = numbers.mean(axis=others, keepdims=True) - mean
            for axis in axes if size == 2 else ():
                effect = effect - (_marginal(numbers, axis) - mean)
            repeats = numbers.size // effect.size
            terms[axes] = float((effect**2).sum() * repeats), int(np.prod([numbers.shape[axis] - 1 for axis in axes]))
    whole = float(((numbers - mean) ** 2).sum())
    left = max(0.0, whole - sum(squares for squares, _ in terms.values()))
    return _Squares(
        terms=terms, whole=whole, left=left, free=numbers.size - 1 - sum(free for _, free in terms.values())
    )


def _marginal(numbers: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    others = tuple(each for each in range(numbers.ndim) if each != axis)
    return np.asarray(numbers.mean(axis=others, keepdims=True))


def _factors(outcomes: Sequence[Outcome]) -> dict[str, list[str]]:
    """Levels of each key that takes several, in their order."""
    keys = dict.fromkeys(key for outcome in outcomes for key in outcome.member.settings)
    levels = {key: list(dict.fromkeys(str(outcome.member.settings[key]) for outcome in outcomes)) for key in keys}
    return {key: found for key, found in levels.items() if len(found) > 1}


def _numbers(outcomes: Sequence[Outcome], factors: Mapping[str, list[str]], metric: str) -> NDArray[np.float64]:
    """A metric by the levels of each factor and by repetition; NaN where a dive failed or has no number."""
    by_cell: dict[tuple[str, ...], list[float]] = {cell: [] for cell in product(*factors.values())}
    for outcome in outcomes:
        number = None if outcome.metrics is None else outcome.metrics[metric]
        cell = tuple(str(outcome.member.settings[key]) for key in factors)
        by_cell[cell].append(np.nan if number is None else float(number))
    shape = [len(levels) for levels in factors.values()]
    return np.array(list(by_cell.values()), dtype=np.float64).reshape(*shape, -1)


def _levels(numbers: NDArray[np.float64], levels: Sequence[Sequence[str]], axes: tuple[int, ...]) -> Iterator[Level]:
    first = np.moveaxis(numbers, axes, range(len(axes)))
    for place in product(*(range(len(each)) for each in levels)):
        names = tuple(each[index] for each, index in zip(levels, place, strict=True))
        yield Level(levels=names, interval=mean_interval(first[place].ravel()))


def _plain(interval: Interval) -> tuple[Any, ...]:
    return interval.estimate, interval.low, interval.high, interval.count


def _share_text(effect: Effect) -> str:
    if effect.share is None:
        return "-"
    star = " *" if effect.probability is not None and effect.probability < 0.05 else ""
    return f"{100 * effect.share:.0f} %{star}"
