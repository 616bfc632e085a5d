"""Materials: port indices against the data sets' own nd and Abbe numbers, aluminium against a transfer-matrix code."""

from __future__ import annotations

import numpy as np
import pytest

from optics.kernels.backend import Float64
from optics.kernels.refraction import conductor_reflectance
from optics.water.materials import PORT_MATERIALS, aluminium_index, material_index
from optics.water.water import water_index

FRAUNHOFER_NM = {"d": 587.56, "F": 486.13, "C": 656.27}

FIFTH_DECIMAL = 6e-6
"""The data sets quote nd to five decimals."""

ROUNDED_DISPERSION = 1e-5
"""Their Abbe numbers were made from nF and nC of five decimals: 1e-5 of nF - nC, which is 0.1 %."""

ABBE_DECIMAL = 6e-3
"""A manufacturer quotes the Abbe number itself, to two decimals."""

PORT_INDICES = [
    # material, nd, Abbe number: as refractiveindex.info gives them beside the dispersion formulas
    ("pmma", 1.49060, 57.99),
    ("polycarbonate", 1.58476, 27.86),
    ("n-bk7", 1.51680, 64.12),
    ("borofloat33", 1.47149, 66.04),
    ("sapphire", 1.76817, 72.26),
    ("fused-silica", 1.45846, 67.82),
]


@pytest.mark.parametrize(("material", "nd", "abbe"), PORT_INDICES)
def test_index_and_dispersion_are_those_of_the_data_set(material, nd, abbe):
    d, f, c = (float(material_index(material, FRAUNHOFER_NM[line])) for line in "dFC")
    assert d == pytest.approx(nd, abs=FIFTH_DECIMAL)
    assert (d - 1) / (f - c) == pytest.approx(abbe, rel=ROUNDED_DISPERSION / (f - c))


def test_the_glass_is_what_its_maker_says():
    """SCHOTT's data sheet of N-BK7: nd = 1.51680, vd = 64.17."""
    d, f, c = (float(material_index("n-bk7", FRAUNHOFER_NM[line])) for line in "dFC")
    assert d == pytest.approx(1.51680, abs=FIFTH_DECIMAL)
    assert (d - 1) / (f - c) == pytest.approx(64.17, abs=ABBE_DECIMAL)


def test_every_material_of_a_rig_file_has_an_index_that_falls_with_wavelength():
    wavelength = np.arange(400, 1051, 10)
    for material in PORT_MATERIALS:
        assert (np.diff(material_index(material, wavelength)) < 0).all()


@pytest.mark.parametrize("wavelength", [399.0, 1051.0, np.nan])
def test_formulas_are_not_used_far_from_their_data(wavelength):
    with pytest.raises(ValueError, match="expected wavelength_nm between 400 and 1050"):
        material_index("pmma", wavelength)


FOURTH_DECIMAL = 6e-5
"""The reflectances are given to four decimals."""

N_AIR = 1.00028
"""Index of air, which makes Quan & Fry's index absolute as in the reference; it moves the reflectance by 2e-6."""

ALUMINIUM_IN_SEAWATER = [
    # wavelength nm, R at 0 degrees, R at 45 degrees (unpolarised): bare Al (McPeak) in seawater of 35 ppt at 20 degrees
    # Celsius, computed with tmm 0.2.0 (coherent transfer matrix)
    (400, 0.9028, 0.9001),
    (450, 0.8995, 0.8962),
    (500, 0.8955, 0.8918),
    (550, 0.8908, 0.8866),
    (600, 0.8844, 0.8798),
    (650, 0.8756, 0.8706),
    (700, 0.8639, 0.8584),
]

ALUMINIUM_IN_AIR = [(400, 0.9240, 0.9210), (550, 0.9157, 0.9118), (700, 0.8951, 0.8902)]
"""As above, in air."""


def reflectance(wavelength, n_medium):
    cosine = Float64([1.0, np.sqrt(0.5)])
    n, k = (float(part) for part in aluminium_index(wavelength))
    return np.array(conductor_reflectance(cosine, n, k, n_medium))


@pytest.mark.parametrize(("wavelength", "normal", "oblique"), ALUMINIUM_IN_SEAWATER)
def test_aluminium_reflects_in_water_as_a_transfer_matrix_code_says(wavelength, normal, oblique):
    n_water = float(water_index(wavelength, 35.0, 20.0)) * N_AIR
    np.testing.assert_allclose(reflectance(wavelength, n_water), [normal, oblique], rtol=0, atol=FOURTH_DECIMAL)


@pytest.mark.parametrize(("wavelength", "normal", "oblique"), ALUMINIUM_IN_AIR)
def test_aluminium_reflects_more_in_air(wavelength, normal, oblique):
    found = reflectance(wavelength, 1.0)
    np.testing.assert_allclose(found, [normal, oblique], rtol=0, atol=FOURTH_DECIMAL)
    assert (found > reflectance(wavelength, 1.34)).all()


@pytest.mark.parametrize("wavelength", [399.0, 701.0, np.nan])
def test_the_table_of_aluminium_is_not_extrapolated(wavelength):
    with pytest.raises(ValueError, match="expected wavelength_nm between 400 and 700"):
        aluminium_index(wavelength)
