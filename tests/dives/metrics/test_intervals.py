"""Confidence intervals: published numbers, what they must cover, and how often they do."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from dives.metrics.intervals import difference_interval, fraction_interval, mean_interval


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [
        # Newcombe 1998, Statistics in Medicine 17, 857-872, table I, method 3 (Wilson), four digits.
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0000, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_wilsons_interval_as_published(successes, trials, low, high):
    found = fraction_interval(successes, trials)
    assert found.estimate == successes / trials
    assert (found.low, found.high) == pytest.approx((low, high), abs=5e-5)


def test_no_trials_have_no_fraction():
    found = fraction_interval(0, 0)
    assert (found.estimate, found.low, found.high, found.count) == (None, None, None, 0)


@pytest.mark.parametrize(("successes", "trials"), [(3, 2), (-1, 4)])
def test_impossible_counts_are_refused(successes, trials):
    with pytest.raises(ValueError, match=f"between 0 and {trials} successes, got {successes}"):
        fraction_interval(successes, trials)


@given(st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=12))
@example([-1.9, -1.9, -1.9])
def test_a_bootstrap_stays_within_its_numbers_and_holds_their_mean(values):
    found = mean_interval(values)
    assert found.estimate == pytest.approx(np.mean(values), rel=1e-12, abs=1e-9)
    slack = 1e-9 * max(1.0, *map(abs, values))  # means of equal numbers differ from them in the last digit
    assert min(values) - slack <= found.low <= found.high <= max(values) + slack


def test_a_bootstrap_is_as_wide_as_theory_says():
    """For many numbers it ends 1.96 standard errors from the mean; 4999 resamples tell an end to 2 % of the width."""
    values = np.random.default_rng(1).normal(3.0, 2.0, 400)
    error = values.std() / np.sqrt(400)
    found = mean_interval(values)
    assert found.low == pytest.approx(values.mean() - 1.96 * error, abs=0.15 * error)
    assert found.high == pytest.approx(values.mean() + 1.96 * error, abs=0.15 * error)


def test_the_same_seed_gives_the_same_interval():
    values = np.random.default_rng(0).normal(size=8)
    assert mean_interval(values, seed=3) == mean_interval(values, seed=3)
    assert mean_interval(values, seed=3) != mean_interval(values, seed=4)


def test_one_number_has_a_mean_and_no_interval():
    found = mean_interval([2.0, np.nan])
    assert (found.estimate, found.low, found.high, found.count) == (2.0, None, None, 1)
    assert mean_interval([]).estimate is None


def test_pairs_scatter_less_than_their_numbers():
    """Numbers that differ by 100 from seed to seed, and by 1 +- 0.1 within a pair."""
    rng = np.random.default_rng(0)
    first = rng.normal(0, 100, 12)
    second = first + rng.normal(1, 0.1, 12)
    found = difference_interval([*first, None, 3.0], [*second, 5.0, None])
    assert found.count == 12
    assert 0.8 < found.low < 1.0 < found.high < 1.2


def test_pairs_must_be_pairs():
    with pytest.raises(ValueError, match="zip"):
        difference_interval([1.0], [1.0, 2.0])
