"""Forces of water on plates, beside their closed forms and limits."""

import numpy as np
import pytest
from scipy.integrate import quad

from cad.loads import plate


def test_normal_force_is_hoerners_form_of_the_free_streamline_formula():
    """Hoerner rounds 0.2218 and 0.2825 to 0.222 and 0.283: his formula agrees to a part in 500."""
    incidence = np.radians([5.0, 20.0, 45.0, 90.0])
    hoerner = 1 / (0.222 + 0.283 / np.sin(incidence))
    np.testing.assert_allclose(plate.normal_force_coefficient(incidence), hoerner, rtol=2e-3)


def test_force_acts_three_sixteenths_ahead_at_grazing_flow_and_in_the_middle_broadside_on():
    np.testing.assert_allclose(plate.centre_of_pressure([0.0, np.pi / 2]), [3 / 16, 0.0], atol=1e-16)


def test_turning_moment_is_the_integral_over_strips():
    chord, span, rate, density = 0.1, 0.08, 3.0, 1025.0

    def strip(y):
        return plate.BROADSIDE_COEFFICIENT * density / 2 * (rate * y) ** 2 * span * y

    half, _ = quad(strip, 0, chord / 2)
    assert plate.turning_moment(chord, span, rate, density) == pytest.approx(2 * half, rel=1e-12)


def test_moments_grow_as_they_must_with_size_and_speed():
    """Twice the chord: 16 times the turning moment, 4 times the flow's; twice the speed: 4 times both."""
    turning = plate.turning_moment(0.2, 0.1, 2.0, 1000.0)
    flow = plate.largest_flow_moment(0.2, 0.1, 1.0, 1000.0)
    assert turning == pytest.approx(16 * plate.turning_moment(0.1, 0.1, 2.0, 1000.0))
    assert turning == pytest.approx(4 * plate.turning_moment(0.2, 0.1, 1.0, 1000.0))
    assert flow == pytest.approx(4 * plate.largest_flow_moment(0.1, 0.1, 1.0, 1000.0))
    assert flow == pytest.approx(4 * plate.largest_flow_moment(0.2, 0.1, 0.5, 1000.0))


def test_flow_moment_is_never_below_that_of_separated_flow():
    incidence = np.linspace(0, np.pi / 2, 91)
    separated = plate.normal_force_coefficient(incidence) * plate.centre_of_pressure(incidence)
    assert plate.largest_flow_moment(1.0, 1.0, 1.0, 2.0) >= separated.max()
    assert separated.max() == pytest.approx(0.1485, abs=5e-5)


def test_added_mass_and_inertia_are_those_of_a_strip():
    """Newman 1977, table 4.3, flat plate of width 2a: m22 = pi rho a^2, m66 = pi rho a^4 / 8, per length."""
    assert plate.added_mass(2.0, 5.0, 1000.0) == pytest.approx(np.pi * 1000 * 5)
    assert plate.added_mass(5.0, 2.0, 1000.0) == plate.added_mass(2.0, 5.0, 1000.0)
    assert plate.added_inertia(2.0, 5.0, 1000.0) == pytest.approx(np.pi * 1000 / 8 * 5)
