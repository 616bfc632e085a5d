"""Confidence intervals: published numbers, what they must cover, and how often they do."""

from __future__ import annotations

import numpy as np
import pytest

from dives.metrics.intervals import (
    Interval,
    difference_interval,
    ended_interval,
    fraction_interval,
    mean_interval,
    ratio_interval,
)


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


@pytest.mark.parametrize(("weeks", "left", "error"), [(6, 0.857, 0.0764), (10, 0.753, 0.0963), (23, 0.448, 0.1346)])
def test_what_was_not_watched_to_its_end_as_published(weeks, left, error):
    """Gehan 1965, Biometrika 52, 203-223, table 1: weeks of remission of 21 patients with 6-mercaptopurine.

    Share still in remission by product limits, such as 18 / 21 after 6 weeks, and its standard error by Greenwood's
    formula, such as 18 / 21 sqrt(3 / (21 * 18)); the interval is that of the logarithm of the share's logarithm.
    """
    ended, unended = [6, 6, 6, 7, 10, 13, 16, 22, 23], [6, 9, 10, 11, 17, 19, 20, 25, 32, 32, 34, 35]
    found = ended_interval(ended, unended, weeks)
    assert found.count == 21
    assert 1 - found.estimate == pytest.approx(left, abs=5e-4)
    # Var(ln(-ln S)) = Var(S) / (S ln S)^2.
    spread = 1.96 * error / abs(left * np.log(left))
    ends = [1 - left ** np.exp(each) for each in (-spread, spread)]
    assert (found.low, found.high) == pytest.approx(ends, abs=2e-3)


def test_all_or_none_of_what_began_has_ended():
    """Ten of ten that are watched long enough: Wilson's interval of these; one that is not is no evidence."""
    every = ended_interval([1.0] * 10, [0.5], 5.0)
    assert (every.estimate, every.low, every.count) == (1.0, fraction_interval(10, 10).low, 11)
    none = ended_interval([7.0], [6.0, 2.0], 5.0)
    assert (none.estimate, none.high, none.count) == (0.0, fraction_interval(0, 2).high, 3)
    assert ended_interval([], [], 5.0) == Interval(estimate=None, low=None, high=None, count=0)


def test_students_interval_as_published():
    """Student 1908, Biometrika 6, 1-25, section IX: additional hours of sleep, ten patients, two drugs.

    The second's mean is 2.33, its standard deviation with n - 1 is 2.002; t_9 at 97.5 % is 2.262.
    """
    found = mean_interval([1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4])
    assert found.estimate == pytest.approx(2.33, abs=5e-3)
    half = 2.262 * 2.002 / np.sqrt(10)
    assert (found.low, found.high) == pytest.approx((2.33 - half, 2.33 + half), abs=2e-3)


@pytest.mark.parametrize("count", [2, 4, 8])
def test_it_holds_the_mean_as_often_as_it_says(count):
    """2000 samples of a normal distribution: 95 % of the intervals, give or take 0.5 % (one standard deviation)."""
    samples = np.random.default_rng(count).normal(3.0, 2.0, (2000, count))
    held = [found.low <= 3.0 <= found.high for found in map(mean_interval, samples)]
    assert np.mean(held) == pytest.approx(0.95, abs=0.015)


def test_a_ratio_counts_long_ones_more():
    """Parts of 1, 2 and 3 of totals of 2, 4 and 6 lie on a line through zero: a half, and nothing is left to scatter.

    With parts 1, 0, 3 of 2, 4, 6: R = 1 / 3, residuals 1 / 3, -4 / 3, 1 over the mean total of 4, and t_2 is 4.303.
    """
    exact = ratio_interval([1.0, 2.0, 3.0], [2.0, 4.0, 6.0])
    assert (exact.estimate, exact.low, exact.high) == pytest.approx((0.5, 0.5, 0.5))
    found = ratio_interval([1.0, 0.0, 3.0], [2.0, 4.0, 6.0])
    half = 4.303 * np.std(np.array([1 / 3, -4 / 3, 1.0]) / 4, ddof=1) / np.sqrt(3)
    assert (found.estimate, found.low, found.high) == pytest.approx((1 / 3, 1 / 3 - half, 1 / 3 + half), abs=1e-4)


def test_nothing_has_no_ratio():
    assert ratio_interval([], []).estimate is None
    assert ratio_interval([0.0], [0.0]).count == 0


def test_equal_numbers_have_no_width():
    found = mean_interval([-1.9, -1.9, -1.9])
    assert (found.low, found.high) == pytest.approx((-1.9, -1.9), abs=1e-12)


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


@pytest.mark.parametrize(
    ("interval", "text"),
    [
        (Interval(estimate=None, low=None, high=None, count=0), "-"),
        (Interval(estimate=2.0, low=None, high=None, count=1), "2"),
        (Interval(estimate=0.98123, low=0.9716, high=0.98765, count=8), "0.981 (0.972 to 0.988)"),
    ],
)
def test_intervals_as_text(interval, text):
    assert str(interval) == text
