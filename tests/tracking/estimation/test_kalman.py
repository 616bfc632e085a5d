"""The linear Kalman filter: closed forms, least squares, and whether its covariance is honest."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import solve_discrete_are
from scipy.stats import chi2

from tracking.estimation.kalman import Estimate, predict, update

ROUNDING = 1e-12
"""Relative: tens of steps of numbers near one."""

STEP_S = 0.1
RATE_MODEL = np.array([[1.0, STEP_S], [0.0, 1.0]])
POSITION = np.array([[1.0, 0.0]])


def rate_noise(density: float) -> np.ndarray:
    return density * np.array([[STEP_S**3 / 3, STEP_S**2 / 2], [STEP_S**2 / 2, STEP_S]])


@pytest.mark.parametrize(("process", "measurement"), [(1.0, 1.0), (36.0, 4.0), (0.01, 0.1), (100.0, 0.01), (0.3, 7.0)])
def test_the_gain_settles_where_the_scalar_riccati_equation_says(process, measurement):
    """A = H = 1: P = P r / (P + r) + q has the root P = (q + sqrt(q^2 + 4 q r)) / 2."""
    estimate = Estimate(mean=np.zeros(1), covariance=np.array([[measurement]]))
    gain = np.nan
    # Each step takes the distance to the root down by (r / (P + r))^2: by a third at q = r / 20, the slowest here.
    for _ in range(100):
        correction = update(predict(estimate, [[1.0]], [[process]]), [0.0], [[1.0]], [[measurement]])
        estimate, gain = correction.estimate, correction.gain[0, 0]
    settled = (process + np.sqrt(process**2 + 4 * process * measurement)) / 2
    assert gain == pytest.approx(settled / (settled + measurement), rel=ROUNDING)


def test_the_covariance_of_a_target_at_a_rate_settles_where_scipys_riccati_solver_says():
    """An independent implementation: the filter's equation is the regulator's of the transposed system."""
    process, noise = rate_noise(0.3), np.array([[0.04]])
    estimate = Estimate(mean=np.zeros(2), covariance=np.eye(2))
    for _ in range(500):
        predicted = predict(estimate, RATE_MODEL, process)
        estimate = update(predicted, [0.0], POSITION, noise).estimate
    expected = solve_discrete_are(RATE_MODEL.T, POSITION.T, process, noise)
    np.testing.assert_allclose(predicted.covariance, expected, rtol=1e-9)


def test_without_process_noise_it_is_batch_least_squares():
    """With Q = 0 the estimate is the weighted least-squares line through prior and all measurements."""
    rng = np.random.default_rng(3)
    first, prior, noise = np.array([1.0, -2.0]), np.diag([4.0, 9.0]), 0.25
    measured = rng.normal(size=20)
    estimate = Estimate(mean=first, covariance=prior)
    for value in measured:
        estimate = predict(estimate, RATE_MODEL, np.zeros((2, 2)))
        estimate = update(estimate, [value], POSITION, [[noise]]).estimate
    # In terms of the state at the end: rows of the prior, then of each measurement, in units of their deviations.
    back = np.linalg.inv(RATE_MODEL)
    rows, values = [np.diag(1 / np.sqrt(np.diag(prior))) @ np.linalg.matrix_power(back, 20)], [first / [2.0, 3.0]]
    for index, value in enumerate(measured):
        rows.append(POSITION @ np.linalg.matrix_power(back, 19 - index) / np.sqrt(noise))
        values.append([value / np.sqrt(noise)])
    design = np.vstack(rows)
    solution, *_ = np.linalg.lstsq(design, np.concatenate(values), rcond=None)
    np.testing.assert_allclose(estimate.mean, solution, rtol=1e-10)
    np.testing.assert_allclose(estimate.covariance, np.linalg.inv(design.T @ design), rtol=1e-10)


def test_its_covariance_is_honest():
    """Rationale: a covariance that is too small makes a filter deaf, one that is too large makes it nervous.

    Expected: with truth drawn from the model, the normalised errors squared (NEES) and innovations squared (NIS) of 400
    runs are chi-square distributed with 2 and 1 degrees of freedom each (Bar-Shalom, Li & Kirubarajan 2001, section
    5.4): their sums lie within the central 99.9 %, and do not when Q is ten times too large or small.
    """
    runs = 400
    honest = _consistency(runs, estimated=1.0)
    for value, freedom in zip(honest, (2 * runs, runs), strict=True):
        assert chi2.ppf(0.0005, freedom) < value < chi2.ppf(0.9995, freedom)
    for wrong in (10.0, 0.1):
        errors, innovations = _consistency(runs, estimated=wrong)
        assert not chi2.ppf(0.0005, 2 * runs) < errors < chi2.ppf(0.9995, 2 * runs)
        assert not chi2.ppf(0.0005, runs) < innovations < chi2.ppf(0.9995, runs)


def _consistency(runs: int, *, estimated: float) -> tuple[float, float]:
    """Sums of NEES and NIS over runs (columns of one filter) after 30 steps; Q is estimated to be a multiple."""
    rng = np.random.default_rng(11)
    process, noise = rate_noise(2.0), np.array([[0.01]])
    truth = rng.normal(size=(2, runs))
    estimate = Estimate(mean=np.zeros((2, runs)), covariance=np.eye(2))
    squared = np.nan
    for _ in range(30):
        truth = RATE_MODEL @ truth + rng.multivariate_normal([0.0, 0.0], process, size=runs).T
        measured = POSITION @ truth + rng.normal(scale=0.1, size=(1, runs))
        correction = update(predict(estimate, RATE_MODEL, estimated * process), measured, POSITION, noise)
        estimate, squared = correction.estimate, correction.innovation_squared
    off = truth - estimate.mean
    return float((off * np.linalg.solve(estimate.covariance, off)).sum()), squared


def test_columns_are_filters_of_their_own():
    rng = np.random.default_rng(5)
    measured = rng.normal(size=(10, 1, 3))
    together = Estimate(mean=np.zeros((2, 3)), covariance=np.eye(2))
    apart = [Estimate(mean=np.zeros(2), covariance=np.eye(2)) for _ in range(3)]
    for values in measured:
        correction = update(predict(together, RATE_MODEL, rate_noise(1.0)), values, POSITION, [[0.5]])
        each = [
            update(predict(one, RATE_MODEL, rate_noise(1.0)), values[:, column], POSITION, [[0.5]])
            for column, one in enumerate(apart)
        ]
        together, apart = correction.estimate, [one.estimate for one in each]
        assert correction.innovation_squared == pytest.approx(sum(one.innovation_squared for one in each))
    np.testing.assert_allclose(together.mean, np.column_stack([one.mean for one in apart]), rtol=ROUNDING)


@given(st.integers(0, 2**32 - 1), st.floats(1e-9, 1e3), st.floats(1e-9, 1e3))
def test_a_covariance_stays_one(seed, density, noise):
    """Symmetric and without negative eigenvalues beyond rounding, whatever the noise."""
    rng = np.random.default_rng(seed)
    estimate = Estimate(mean=np.zeros(2), covariance=np.eye(2))
    for value in rng.normal(size=20):
        estimate = update(predict(estimate, RATE_MODEL, rate_noise(density)), [value], POSITION, [[noise]]).estimate
        scale = np.abs(estimate.covariance).max()
        np.testing.assert_allclose(estimate.covariance, estimate.covariance.T, atol=ROUNDING * scale)
        assert np.linalg.eigvalsh(estimate.covariance).min() >= -ROUNDING * scale


def test_what_is_known_to_move_the_state_moves_it():
    moved = predict(Estimate(mean=np.array([1.0, 2.0]), covariance=np.eye(2)), np.eye(2), np.eye(2), [3.0, -1.0])
    np.testing.assert_array_equal(moved.mean, [4.0, 1.0])
    np.testing.assert_array_equal(moved.covariance, 2 * np.eye(2))
