"""Pure sea water against its tables, Pope & Fry's cavity, and what salt and heat are known to do."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cad.loads.seawater import water_density
from optics.water import pure_water
from optics.water.pure_water import pure_absorption, pure_scattering
from rigs import Water

ZHANG = [
    # nm, 1/m at 0 and at 35 ppt, 20 degrees Celsius: Zhang, Hu & He 2009 as coded by hygeos/smartg
    (400, 0.00503863, 0.00659178),
    (450, 0.00304988, 0.00397972),
    (500, 0.00195751, 0.00254734),
    (550, 0.00131499, 0.00170680),
    (600, 0.000916363, 0.00118661),
    (650, 0.000658189, 0.000850529),
    (700, 0.000484935, 0.000625497),
]

PITARCH_35 = {400: 0.0065918, 500: 0.0025473, 600: 0.0011866, 700: 0.0006255}
"""Another code of the same formula, 35 PSU and 20 degrees Celsius (NASA HyperCP), to the digits given."""

POPE_FRY = {450: 0.00922, 500: 0.0204, 550: 0.0565, 600: 0.2224, 650: 0.340}
"""1/m at 22 degrees Celsius: Pope & Fry 1997, Applied Optics 36, 8710."""

TWO_MEASUREMENTS = {450: 0.13, 500: 0.02, 550: 0.03, 600: 0.07, 650: 0.01}
"""Relative difference of WOPP v3 from Pope & Fry, as seen, rounded up. At 600 nm the spectrum is steepest; in the blue
water is so clear that the two disagree by more than either's deviation (at 410 nm WOPP is 0.55 of Pope & Fry)."""


@pytest.mark.parametrize(("wavelength", "fresh", "sea"), ZHANG)
def test_scattering_is_zhangs(wavelength, fresh, sea):
    """Tolerance: the table's six digits, and our constants of 2019 for its of 1998 (Boltzmann's moved by 2e-6)."""
    assert pure_scattering(wavelength, 0, 20) == pytest.approx(fresh, rel=1e-5)
    assert pure_scattering(wavelength, 35, 20) == pytest.approx(sea, rel=1e-5)


@pytest.mark.parametrize("wavelength", PITARCH_35)
def test_scattering_is_that_of_another_code(wavelength):
    assert pure_scattering(wavelength, 35, 20) == pytest.approx(PITARCH_35[wavelength], rel=1e-4)


def test_absorption_is_wopps_at_its_own_temperature():
    """WOPP v3, 20 degrees Celsius, no salt: 0.00222, 0.02073, 0.0581, 0.23525, 0.34, 0.6126 at 400 (50|100) 700 nm."""
    found = pure_absorption([400, 500, 550, 600, 650, 700], 0, 20)
    np.testing.assert_allclose(found, [0.00222, 0.02073, 0.0581, 0.23525, 0.34, 0.6126], rtol=1e-12)


def test_salt_and_heat_change_absorption_as_wopp_says():
    """Its coefficients at 600 nm: -4.33e-5 per ppt and 7.59e-4 per degree, in 1/m."""
    assert pure_absorption(600, 35, 20) - pure_absorption(600, 0, 20) == pytest.approx(35 * -4.33e-5, rel=2e-3)
    assert pure_absorption(600, 0, 30) - pure_absorption(600, 0, 20) == pytest.approx(10 * 7.59e-4, rel=1e-9)


SEA_WATER_35 = {520: 0.042265, 530: 0.045021, 550: 0.058544, 620: 0.27843, 650: 0.3421}
"""WOPP at 35 PSU and 20 degrees Celsius as NASA HyperCP tabulates it (another smoothing of the same data), 1/m."""


@pytest.mark.parametrize("wavelength", SEA_WATER_35)
def test_absorption_of_sea_water_is_that_of_another_table(wavelength):
    """Salt adds 1.0 to 1.2 % at 520 and 620 nm; the two tables differ by up to 0.6 %."""
    assert pure_absorption(wavelength, 35, 20) == pytest.approx(SEA_WATER_35[wavelength], rel=0.007)


@pytest.mark.parametrize("wavelength", POPE_FRY)
def test_absorption_is_near_that_of_pope_and_fry(wavelength):
    """Another measurement, at its own temperature."""
    expected = POPE_FRY[wavelength]
    assert pure_absorption(wavelength, 0, 22) == pytest.approx(expected, rel=TWO_MEASUREMENTS[wavelength])


@given(wavelength=st.floats(400, 700), salinity=st.floats(0, 35), heat=st.floats(0, 30))
def test_salt_scatters_and_nothing_is_negative(wavelength, salinity, heat):
    assert pure_scattering(wavelength, salinity, heat) >= pure_scattering(wavelength, 0, heat) > 0
    assert pure_absorption(wavelength, salinity, heat) > 0


def rounded(lowest, highest):
    """A rig file refuses numbers next to zero."""
    return st.floats(lowest, highest).map(lambda number: round(number, 9))


@given(salinity=rounded(0, 35), heat=rounded(0, 30))
def test_the_density_is_the_one_that_weighs_the_robot(salinity, heat):
    expected = water_density(Water(salinity_ppt=salinity, temperature_celsius=heat))
    assert pure_water._density(salinity, heat) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("function", [pure_absorption, pure_scattering])
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((399.0, 0, 20), "expected wavelength_nm between 400 and 700, got 399"),
        (([500, 701], 0, 20), "expected wavelength_nm between 400 and 700, got 500 to 701"),
        ((500, 36, 20), "expected salinity_ppt between 0 and 35, got 36"),
        ((500, 35, 31), "expected temperature_celsius between 0 and 30, got 31"),
    ],
)
def test_nothing_is_extrapolated(function, arguments, words):
    with pytest.raises(ValueError, match=words):
        function(*arguments)
