"""A damped oscillation that noise keeps going."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm, solve_continuous_lyapunov

from tracking.estimation.sway import Sway

SWAYS = st.builds(
    Sway, deviation_deg=st.floats(0.1, 10), period_s=st.floats(1, 20), damping=st.floats(0.01, 0.9, exclude_max=True)
)


def motion(sway: Sway) -> np.ndarray:
    """A of x' = A x + noise, for displacement and rate."""
    frequency = 2 * math.pi / sway.period_s
    return np.array([[0.0, 1.0], [-(frequency**2), -2 * sway.damping * frequency]])


@given(SWAYS, st.floats(0.0, 10.0))
def test_it_swings_as_its_differential_equation_says(sway, seconds):
    np.testing.assert_allclose(sway.transition(seconds), expm(motion(sway) * seconds), atol=1e-9)


@given(SWAYS, st.floats(0.0, 10.0))
def test_its_noise_keeps_the_covariance_that_lyapunovs_equation_has(sway, seconds):
    """White noise of 4 z w³ s² on the rate alone: A C + C A' + Q = 0."""
    frequency, deviation = 2 * math.pi / sway.period_s, math.radians(sway.deviation_deg)
    noise = np.diag([0.0, 4 * sway.damping * frequency**3 * deviation**2])
    standing = solve_continuous_lyapunov(motion(sway), -noise)
    np.testing.assert_allclose(sway.covariance, standing, rtol=1e-6, atol=1e-12)
    transition = sway.transition(seconds)
    later = transition @ standing @ transition.T + sway.process_noise(seconds)
    np.testing.assert_allclose(later, standing, rtol=1e-6, atol=1e-12)
    # What is added grows from nothing, and is a covariance.
    assert np.linalg.eigvalsh(sway.process_noise(seconds)).min() >= -1e-12


@pytest.mark.parametrize("key", ["deviation_deg", "period_s", "damping"])
def test_it_says_what_it_cannot_be(key):
    with pytest.raises(ValueError, match=f"expected {key} above 0, got 0"):
        Sway(**{key: 0.0})
    with pytest.raises(ValueError, match="expected damping below 1, got 1"):
        Sway(damping=1.0)
