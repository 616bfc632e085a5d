"""Phase functions: normalised, with the moments of closed forms and the numbers that were published of them."""

from __future__ import annotations

from decimal import Decimal, localcontext

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from optics.water.pure_water import molecular_moments, molecular_phase
from optics.water.scattering import (
    PETZOLD_INDEX,
    PETZOLD_SLOPE,
    PhaseFunction,
    coupled_index,
    fournier_forand,
    fournier_forand_backscattered_fraction,
    fournier_forand_phase,
    henyey_greenstein,
    henyey_greenstein_phase,
    petzold_phase,
    slope_of_backscattered_fraction,
)

TABLE = 3e-6
"""What log-log interpolation and the trapezoidal rule leave at steps of 0.24 % of the angle."""

MOBLEY_TABLE = [
    # B, slope, index: published pairs of eq. 7 and 8 of Mobley, Sundman & Boss 2002, to the digits given
    (0.001, 3.1977, 1.0405),
    (0.002, 3.2593, 1.0500),
    (0.005, 3.3656, 1.0664),
    (0.01, 3.4703, 1.0825),
    (0.0183, 3.5834, 1.1000),
    (0.02, 3.6021, 1.1028),
    (0.03, 3.6949, 1.1172),
    (0.05, 3.8324, 1.1384),
]


@pytest.mark.parametrize("g", [0.0, 0.5, 0.85, 0.924, 0.97])
def test_moments_of_henyey_greenstein_are_powers(g):
    """Henyey & Greenstein 1941: chi_l = g^l, the one phase function whose moments are in closed form."""
    np.testing.assert_allclose(henyey_greenstein_phase(g).moments(65), float(g) ** np.arange(65), atol=TABLE)


@pytest.mark.parametrize("g", [0.5, 0.85, 0.924, 0.97])
def test_henyey_greenstein_scatters_back_as_its_closed_form(g):
    """(1 - g) / 2g ((1 + g) / sqrt(1 + g^2) - 1); 0.016989 at g = 0.924."""
    expected = (1 - g) / (2 * g) * ((1 + g) / np.sqrt(1 + g**2) - 1)
    assert henyey_greenstein_phase(g).backscattered_fraction == pytest.approx(expected, abs=TABLE)
    if g == 0.924:
        assert expected == pytest.approx(0.016989435, rel=1e-7)


@pytest.mark.parametrize("fraction", [None, *(row[0] for row in MOBLEY_TABLE)])
def test_fournier_forand_is_normalised_as_it_is_written(fraction):
    """Before we normalise it: the formula integrates to 1, forward peak (a power law below 1e-8 rad) and all."""
    phase = fournier_forand_phase(fraction)
    slope = PETZOLD_SLOPE if fraction is None else slope_of_backscattered_fraction(fraction)
    index = PETZOLD_INDEX if fraction is None else coupled_index(slope)
    as_written = PhaseFunction(phase.angle_rad, fournier_forand(phase.angle_rad, index, slope))
    assert as_written.moments(1)[0] == pytest.approx(1, abs=TABLE)
    assert phase.moments(1)[0] == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize(("fraction", "slope", "index"), MOBLEY_TABLE)
def test_the_backscattered_fraction_picks_the_published_particle(fraction, slope, index):
    found = slope_of_backscattered_fraction(fraction)
    assert found == pytest.approx(slope, abs=6e-5)
    assert coupled_index(found) == pytest.approx(index, abs=6e-5)
    assert fournier_forand_phase(fraction).backscattered_fraction == pytest.approx(fraction, abs=TABLE)


def test_the_default_scatters_back_what_eq_7_says():
    """Mobley, Sundman & Boss 2002, eq. 7: 0.0183127 at index 1.10 and slope 3.5835."""
    expected = fournier_forand_backscattered_fraction()
    assert expected == pytest.approx(0.018312675784705856, rel=1e-12)
    assert fournier_forand_phase().backscattered_fraction == pytest.approx(expected, abs=TABLE)


@pytest.mark.parametrize("fraction", [0.0005, 0.06, np.nan])
def test_no_particle_is_made_up_beyond_the_published_ones(fraction):
    with pytest.raises(ValueError, match=r"expected backscattered_fraction from 0\.001 to 0\.05"):
        slope_of_backscattered_fraction(fraction)


@given(st.floats(0.02, 3.14))
@settings(max_examples=200)
def test_fournier_forand_is_smooth_where_its_formula_is_nought_by_nought(angle):
    """Neighbours 1e-6 rad apart differ by their slope, nothing else: delta = 1 is at 9.94 degrees for index 1.10."""
    three = np.log(fournier_forand(np.array([angle - 1e-6, angle, angle + 1e-6])))
    # Curvature of the logarithm is below 1e4 at 0.02 rad and above: 1e4 * 1e-12, and rounding left by e^2 >= 1e-6.
    assert abs(three[0] - 2 * three[1] + three[2]) < 2e-8


def test_at_delta_one_it_is_its_limit():
    """At delta = 1 exactly: [nu (nu - 1) / 2 - nu (nu + 1) / (2 sin^2)] / 4 pi, by Taylor's series of the formula."""
    sine2 = 3 * (PETZOLD_INDEX - 1) ** 2 / 4
    angle = 2 * np.arcsin(np.sqrt(sine2))
    nu = (3 - PETZOLD_SLOPE) / 2
    back = 1 / sine2
    backward = (1 - back**nu) / (16 * np.pi * (back - 1) * back**nu) * (3 * np.cos(angle) ** 2 - 1)
    expected = (nu * (nu - 1) / 2 - nu * (nu + 1) / (2 * sine2)) / (4 * np.pi) + backward
    assert fournier_forand(angle) == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize("e", [-9e-4, -1e-4, 3e-4, 9.9e-4, 1.1e-3])
def test_beside_delta_one_it_is_the_formula_in_more_digits(e):
    """In 50 digits, where the division by (1 - delta)^2 costs nothing. Tolerance: what it costs in float64 at 1e-3."""
    with localcontext() as context:
        context.prec = 50
        sine2 = (1 - Decimal(e)) * 3 * (Decimal(PETZOLD_INDEX) - 1) ** 2 / 4
        nu, d = (3 - Decimal(PETZOLD_SLOPE)) / 2, 1 - Decimal(e)
        power = d**nu
        forward = nu * (1 - d) - (1 - power) + (d * (1 - power) - nu * (1 - d)) / sine2
        forward /= (1 - d) ** 2 * power
    back = 4 / (3 * (PETZOLD_INDEX - 1) ** 2)
    nu, angle = float(nu), 2 * np.arcsin(np.sqrt(float(sine2)))
    backward = (1 - back**nu) / (16 * np.pi * (back - 1) * back**nu) * (3 * np.cos(angle) ** 2 - 1)
    assert fournier_forand(angle) == pytest.approx(float(forward) / (4 * np.pi) + backward, rel=1e-9)


@pytest.mark.parametrize("order", [1, 2, 8, 32, 64])
def test_moments_of_fournier_forand_are_an_adaptive_integral(order):
    """An independent way: scipy's adaptive quadrature of the formula over the logarithm of the angle."""

    def integrand(logarithm):
        angle = np.exp(logarithm)
        legendre = np.polynomial.legendre.legval(np.cos(angle), [0] * order + [1])
        return 2 * np.pi * float(fournier_forand(angle)) * np.sin(angle) * angle * (1 - legendre)

    # 1 - P_l vanishes forward: nothing is lost below 1e-8 rad.
    integral, _ = quad(integrand, np.log(1e-8), np.log(np.pi), limit=400, epsabs=1e-9)
    assert fournier_forand_phase().moments(order + 1)[order] == pytest.approx(1 - integral, abs=1e-5)


def test_petzolds_average_has_its_published_numbers():
    """Mobley 1994 and Mobley et al. 2002: B = 0.0183, mean cosine 0.924, 1782.58 1/sr at 0.1 degrees.

    The source table's own note: integral 0.9999, 0.0522 of the light below 0.1 degrees.
    """
    phase = petzold_phase()
    assert phase.backscattered_fraction == pytest.approx(0.0183, abs=5e-5)
    assert phase.mean_cosine == pytest.approx(0.924, abs=5e-4)
    assert phase.fraction_within(np.radians(0.1)) == pytest.approx(0.0522, abs=5e-5)
    normalisation = phase(np.radians(0.1)) / 1.78258e3
    assert normalisation == pytest.approx(1 / 0.9999, abs=5e-5)
    # Every point of the table is met: its angles are among ours.
    np.testing.assert_allclose(phase(np.radians([1.0, 10.0, 90.0, 180.0])) / normalisation,
                               [72.2558, 1.16299, 4.33114e-3, 3.18218e-3], rtol=1e-6)  # fmt: skip
    assert phase(np.radians(0.01)) / phase(np.radians(0.1)) == pytest.approx(10**1.346, rel=1e-6)


@pytest.mark.parametrize("phase", [fournier_forand_phase(), petzold_phase(), henyey_greenstein_phase(0.924)])
def test_fractions_are_integrals(phase):
    angle = np.array([0.0, 1e-10, 1e-3, 0.18, 0.26, np.pi])
    fraction = phase.fraction_within(angle)
    assert fraction[0] == 0
    assert fraction[-1] == pytest.approx(1, abs=1e-9)
    assert (np.diff(fraction) > 0).all()
    # 0.18 to 0.26 rad lie within one cell of Petzold's table: nothing there has a kink.
    between, _ = quad(lambda t: 2 * np.pi * float(phase(t)) * np.sin(t), 0.18, 0.26, epsabs=1e-9, limit=400)
    assert fraction[4] - fraction[3] == pytest.approx(between, abs=TABLE)


def test_henyey_greenstein_keeps_its_digits_in_the_forward_direction():
    """p(0) = (1 + g) / (4 pi (1 - g)^2)."""
    assert henyey_greenstein(0.0, 0.924) == pytest.approx(1.924 / (4 * np.pi * 0.076**2), rel=1e-12)
    assert henyey_greenstein_phase(0.924)(0.0) == pytest.approx(1.924 / (4 * np.pi * 0.076**2), rel=1e-5)


def test_molecules_scatter_by_their_quadratic():
    """Normalised, symmetric, and chi_2 = 2 f / (5 (3 + f)); f = 0.9249 for a depolarisation of 0.039."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    phase = molecular_phase(np.arccos(nodes))
    legendre = np.polynomial.legendre.legvander(nodes, 5)
    np.testing.assert_allclose(2 * np.pi * (weights * phase) @ legendre, molecular_moments(6), atol=1e-14)
    assert molecular_moments(3)[2] == pytest.approx(2 * 0.92493 / (5 * 3.92493), rel=1e-5)
    assert molecular_moments(2).tolist() == [1, 0]
