"""Water: index against its tables and two other formulas, Jerlov types at table points, Kd against another campaign."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optics.kernels.tables import read_table
from optics.water.water import (
    DATA,
    absorption,
    attenuation_types,
    diffuse_attenuation,
    filled_wavelengths_nm,
    molecular_scattering_of_types,
    scattering,
    tabulated_diffuse_attenuation,
    water_index,
)

LAST_DIGIT = 6e-7
"""The tables are given to six decimals."""

QUAN_FRY_UNCERTAINTY = 3e-5
"""Quan & Fry 1995, abstract."""

AIR_UNCERTAINTY = 5e-6
"""Quan & Fry do not say how warm their air was: its index falls by 4.8e-6 from 15 (Ciddor's) to 20 degrees Celsius."""

QUAN_FRY_TABLE = [
    # wavelength nm, ppt, celsius, index: Quan & Fry 1995 eq. 3 evaluated by the authors of the source table
    (400, 0, 10, 1.343923),
    (400, 35, 30, 1.348734),
    (450, 30, 20, 1.344916),
    (500, 35, 25, 1.342414),
    (550, 0, 20, 1.334338),
    (550, 35, 25, 1.340238),
    (600, 30, 10, 1.339003),
    (650, 35, 20, 1.337661),
]

PURE_WATER_AT_20 = [
    # wavelength nm, index of air (Ciddor 1996), IAPWS 1997 (absolute), Daimon & Masumura 2007 (absolute, 20.0 celsius)
    (400, 1.0002828, 1.343560, 1.343557),
    (450, 1.0002805, 1.339608, 1.339608),
    (500, 1.0002790, 1.336795, 1.336796),
    (550, 1.0002778, 1.334683, 1.334683),
    (600, 1.0002770, 1.333024, 1.333023),
    (650, 1.0002763, 1.331668, 1.331667),
]


@pytest.mark.parametrize(("wavelength", "salinity", "temperature", "expected"), QUAN_FRY_TABLE)
def test_index_is_the_tabulated_one(wavelength, salinity, temperature, expected):
    assert water_index(wavelength, salinity, temperature) == pytest.approx(expected, abs=LAST_DIGIT)


@pytest.mark.parametrize(("wavelength", "n_air", "iapws", "daimon"), PURE_WATER_AT_20)
def test_index_of_pure_water_agrees_with_two_other_sources(wavelength, n_air, iapws, daimon):
    """Quan & Fry is relative to air: times the index of air it is absolute, as the others are.

    The largest difference, at 400 nm, is 3.1e-5; from 450 to 650 nm it is 1.5e-5 to 2.6e-5.
    """
    absolute = float(water_index(wavelength, 0.0, 20.0)) * n_air
    assert absolute == pytest.approx(iapws, abs=QUAN_FRY_UNCERTAINTY + AIR_UNCERTAINTY)
    assert absolute == pytest.approx(daimon, abs=QUAN_FRY_UNCERTAINTY + AIR_UNCERTAINTY)


@given(wavelength=st.floats(401, 699), salinity=st.floats(0, 34), temperature=st.floats(0, 29))
def test_index_grows_with_salt_and_falls_with_wavelength_and_heat(wavelength, salinity, temperature):
    """Signs of the dispersion and of the density's effect, all over the formula's range."""
    here = water_index(wavelength, salinity, temperature)
    assert water_index(wavelength, salinity + 1, temperature) > here
    assert water_index(wavelength + 1, salinity, temperature) < here
    assert water_index(wavelength, salinity, temperature + 1) < here


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((399.0, 35, 20), "expected wavelength_nm between 400 and 700"),
        ((550.0, 36, 20), "expected salinity_ppt between 0 and 35, got 36"),
        ((550.0, 35, -2), "expected temperature_celsius between 0 and 30, got -2"),
        ((np.nan, 35, 20), "expected wavelength_nm between 400 and 700"),
    ],
)
def test_index_is_not_extrapolated(arguments, message):
    with pytest.raises(ValueError, match=message):
        water_index(*arguments)


WILLIAMSON_HOLLINS = [
    # type, wavelength nm, a, b in 1/m: rows of the authors' spreadsheet (figshare 20290782)
    ("IB", 400, 0.0448, 0.144),
    ("III", 410, 0.128, 0.321),
    ("1C", 415, 0.179, 0.468),
    ("5C", 420, 0.414, 1.30),
]


@pytest.mark.parametrize(("jerlov_type", "wavelength", "a", "b"), WILLIAMSON_HOLLINS)
def test_absorption_and_scattering_are_those_of_the_spreadsheet(jerlov_type, wavelength, a, b):
    assert absorption(jerlov_type, wavelength) == a
    assert scattering(jerlov_type, wavelength) == b


def test_between_the_rows_they_are_straight_lines():
    assert absorption("IB", 402.5) == pytest.approx((0.0448 + 0.0440) / 2, abs=1e-15)


@pytest.mark.parametrize("wavelength", [399.9, 700.1, np.nan])
def test_they_are_not_extrapolated(wavelength):
    for function in (absorption, scattering, diffuse_attenuation):
        with pytest.raises(ValueError, match="expected wavelength_nm between 400 and 700"):
            function("IB", wavelength)


@pytest.mark.parametrize("coefficient", [absorption, scattering])
def test_types_are_in_order_of_turbidity(coefficient):
    """IB is the clearest of the six and 5C the most turbid, at every wavelength up to where pure water takes over."""
    wavelength = np.arange(400, 600, 5)
    values = [coefficient(jerlov_type, wavelength) for jerlov_type in ("IB", "II", "III", "1C", "3C", "5C")]
    assert (np.diff(values, axis=0) > 0).all()


@given(sun=st.floats(0.66, 1.0), wavelength=st.floats(400, 700))
def test_attenuation_lies_between_absorption_and_its_bounds(sun, wavelength):
    """Kirk 1984: without scattering Kd is a / mu0; scattering adds, but less than all of it."""
    a, b = absorption("1C", wavelength), scattering("1C", wavelength)
    attenuation = diffuse_attenuation("1C", wavelength, sun)
    assert a / sun < attenuation < (a + b) / sun


def test_attenuation_for_a_zenith_sun_is_kirks_formula():
    """Kirk 1984, mu0 = 1: sqrt(a^2 + 0.235 a b); a = 0.0448, b = 0.144 at IB, 400 nm."""
    assert diffuse_attenuation("IB", 400.0) == pytest.approx(np.sqrt(0.0448**2 + 0.235 * 0.0448 * 0.144), rel=1e-12)


@pytest.mark.parametrize("cosine", [0.0, 0.5, 1.01, np.nan])
def test_the_suns_cosine_is_that_of_refracted_light(cosine):
    """At the horizon the refracted sun stands at arccos 0.66; a smaller cosine was taken in the air."""
    with pytest.raises(ValueError, match=r"expected sun_cosine between 0\.65 and 1"):
        diffuse_attenuation("IB", 500.0, cosine)


AUSTIN_PETZOLD = {
    # Austin & Petzold 1986, table VI: Kd in 1/m at 400, 450, 500, 550, 600, 650, 700 nm
    "IB": (0.0438, 0.0355, 0.0396, 0.0715, 0.2471, 0.3652, 0.6550),
    "II": (0.0878, 0.0714, 0.0627, 0.0863, 0.2595, 0.3837, 0.6623),
    "III": (0.1697, 0.1381, 0.1056, 0.1139, 0.2826, 0.4181, 0.6760),
    "1C": (0.2516, 0.2048, 0.1486, 0.1415, 0.3057, 0.4525, 0.6896),
}

SPREAD_OF_CAMPAIGNS = {"IB": 1.61, "II": 1.21, "III": 1.13, "1C": 1.06}
"""Largest factor between Kd from Williamson & Hollins' a and b (sun at 30 degrees) and Austin & Petzold's Kd: not an
error of either, but what "Jerlov type" is worth. As measured, rounded up; nothing is tuned to it."""


@pytest.mark.parametrize("jerlov_type", AUSTIN_PETZOLD)
def test_attenuation_is_that_of_another_campaign_within_the_known_spread(jerlov_type):
    wavelength = np.arange(400, 701, 50)
    cosine = np.sqrt(1 - (np.sin(np.radians(30)) / 1.34) ** 2)
    ratio = diffuse_attenuation(jerlov_type, wavelength, cosine) / AUSTIN_PETZOLD[jerlov_type]
    assert max(ratio.max(), 1 / ratio.min()) < SPREAD_OF_CAMPAIGNS[jerlov_type]


SOLONENKO_MOBLEY = [
    # type, wavelength nm, a, b in 1/m: tables 4 to 8 of the paper
    ("I", 400, 0.022, 0.0062),
    ("IB", 500, 0.0287, 0.0597),
    ("III", 550, 0.0646, 0.98),
    ("9C", 700, 0.651, 2.07),
]


@pytest.mark.parametrize(("jerlov_type", "wavelength", "a", "b"), SOLONENKO_MOBLEY)
def test_the_other_source_has_its_own_numbers(jerlov_type, wavelength, a, b):
    assert absorption(jerlov_type, wavelength, "solonenko-mobley") == a
    assert scattering(jerlov_type, wavelength, "solonenko-mobley") == b


def test_what_the_source_misprints_lies_between_the_neighbours():
    """5C from 600 nm and 3C from 675 nm on; 5C stands at 0.30 of the way from 3C to 7C where it ends (575 nm)."""
    assert filled_wavelengths_nm("5C", "solonenko-mobley").tolist() == [600, 625, 650, 675, 700]
    assert filled_wavelengths_nm("3C", "solonenko-mobley").tolist() == [675, 700]
    assert len(filled_wavelengths_nm("5C", "williamson-hollins")) == 0
    assert absorption("5C", 600, "solonenko-mobley") == pytest.approx(0.239 + 0.30 * (0.301 - 0.239), abs=1e-12)
    wavelength = np.array([600, 625, 650, 675, 700])
    clear, three, five, murky = (absorption(t, wavelength, "solonenko-mobley") for t in ("1C", "3C", "5C", "7C"))
    assert (clear < three).all()
    assert (three < five).all()
    assert (five < murky).all()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("7C", 500), "expected jerlov_type IB, II, III, 1C, 3C, 5C with source = \"williamson-hollins\", got '7C'"),
        (("9Z", 500, "solonenko-mobley"), "expected jerlov_type I, IA, .*, got '9Z'"),
        (("III", 500, "pure"), "expected a source of Jerlov types .*, got 'pure'"),
    ],
)
def test_a_type_that_a_source_lacks_is_said(arguments, words):
    for function in (absorption, scattering):
        with pytest.raises(ValueError, match=words):
            function(*arguments)


@pytest.mark.parametrize("jerlov_type", ["I", "IA"])
def test_the_types_scattering_contains_that_of_haltrins_water(jerlov_type):
    """Whether b includes water itself: solved for, it does, with Haltrin's coefficient, in the two clearest types.

    Least squares of b = k b_w + C_s x^1.7 + C_l x^0.3 (Haltrin 1999, eqs. 5-7), x = 400 nm / wavelength, over the
    source's table from 300 nm on; k comes out as 0.9999 and 1.0008. Tolerance: three standard errors of k for a table
    that is rounded to three digits, 0.5 % at worst and evenly spread.
    """
    table = read_table(DATA / "solonenko_mobley2015_b.csv")
    wavelength, b = table["wavelength_nm"], table[f"b_{jerlov_type}"]
    x = 400 / wavelength
    terms = np.stack([molecular_scattering_of_types(wavelength), x**1.7, x**0.3], axis=1) / b[:, np.newaxis]
    k = np.linalg.lstsq(terms, np.ones_like(b), rcond=None)[0][0]
    standard_error = 0.005 / np.sqrt(3) * np.sqrt(np.linalg.inv(terms.T @ terms)[0, 0])
    assert standard_error < 0.015
    assert k == pytest.approx(1, abs=3 * standard_error)


def test_tabulated_attenuation_is_its_table():
    """Austin & Petzold 1986, table VI; Jerlov 1976, table XXVII."""
    for jerlov_type, expected in AUSTIN_PETZOLD.items():
        found = tabulated_diffuse_attenuation(jerlov_type, np.arange(400, 701, 50), "austin-petzold")
        np.testing.assert_array_equal(found, expected)
    assert tabulated_diffuse_attenuation("9C", 475, "jerlov") == 1.23
    assert attenuation_types("austin-petzold") == ("I", "IA", "IB", "II", "III", "1C")
    assert attenuation_types("jerlov")[-1] == "9C"
    with pytest.raises(ValueError, match=r"with Kd by austin-petzold .*, got '3C'"):
        tabulated_diffuse_attenuation("3C", 500, "austin-petzold")
