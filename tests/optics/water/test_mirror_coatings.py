"""Coated mirrors against closed forms: bare metal, a half wave that is absent, quarter waves, and one film by Airy."""

from __future__ import annotations

import numpy as np
import pytest

from optics.kernels.arrays import opaque
from optics.kernels.backend import Float64
from optics.kernels.refraction import conductor_reflectance
from optics.water.materials import aluminium_index
from optics.water.mirror_coatings import DESIGN_NM, FILMS, film_index, mirror_reflectance

N_WATER = 1.34
COSINE = np.array([1.0, 0.9, 0.7, 0.4])
WAVELENGTH_NM = np.array([430.0, 550.0, 640.0])
DESIGN = np.array([DESIGN_NM])
NORMAL = np.array([1.0])


def metal(wavelength_nm=DESIGN):
    n, k = aluminium_index(wavelength_nm)
    return n - 1j * k


def test_without_films_it_is_fresnel_s_formula_of_the_metal():
    """Another implementation: the kernel's formula for conductors (Born & Wolf, 14.2)."""
    found = mirror_reflectance("bare-aluminium", WAVELENGTH_NM, COSINE, N_WATER)
    for row, n, k in zip(found, *aluminium_index(WAVELENGTH_NM), strict=True):
        expected = np.array(conductor_reflectance(Float64(COSINE), opaque(n), opaque(k), opaque(N_WATER)))
        assert row == pytest.approx(expected, rel=1e-9)


def test_half_a_wave_is_absent_at_its_own_wavelength():
    bare, protected = (mirror_reflectance(name, DESIGN, NORMAL, N_WATER) for name in list(FILMS)[:2])
    assert protected == pytest.approx(bare, rel=1e-12)


@pytest.mark.parametrize("outside", [1.0, N_WATER])
def test_two_quarter_waves_change_the_admittance_by_their_ratio_squared(outside):
    """Macleod: a quarter wave of index N turns the admittance Y into N²/Y."""
    silica, titania = film_index("silica", DESIGN)[0], film_index("titania", DESIGN)[0]
    behind = titania**2 / (silica**2 / metal()[0])
    expected = abs((outside - behind) / (outside + behind)) ** 2
    found = mirror_reflectance("enhanced-aluminium", DESIGN, NORMAL, outside)[0, 0]
    # Titania's extinction at 550 nm, 1e-4, is in the film's phase and not in the quarter wave's rule.
    assert found == pytest.approx(expected, abs=2e-4)


def test_one_film_aslant_is_airy_s_sum():
    """Amplitudes of both interfaces by Fresnel, summed over all reflections within the film, for both polarisations."""
    wavelength, cosine = np.array([470.0]), 0.7
    film, behind = film_index("silica", wavelength)[0], metal(wavelength)[0]
    sine = N_WATER * np.sqrt(1 - cosine**2)
    inside, below = (np.sqrt(1 - (sine / index) ** 2) for index in (film, behind))
    length = 0.5 * DESIGN_NM / film_index("silica", DESIGN)[0]
    turn = np.exp(-4j * np.pi * film * length * inside / wavelength[0])
    shares = []
    for s in (True, False):
        media = [(N_WATER, cosine), (film, inside), (behind, below)]
        y = [n * c if s else n / c for n, c in media]
        first, second = (y[0] - y[1]) / (y[0] + y[1]), (y[1] - y[2]) / (y[1] + y[2])
        shares.append(abs((first + second * turn) / (1 + first * second * turn)) ** 2)
    found = mirror_reflectance("protected-aluminium", wavelength, np.array([cosine]), N_WATER)[0, 0]
    assert found == pytest.approx(np.mean(shares), rel=1e-12)


def test_films_raise_what_is_reflected_in_water():
    """Over green light: enhanced more than bare, protected within two hundredths of it, none above 1."""
    green = np.arange(500.0, 601.0, 10.0)
    bare, protected, enhanced = (mirror_reflectance(name, green, COSINE[:3], N_WATER).mean() for name in FILMS)
    assert abs(protected - bare) < 0.02
    assert bare + 0.02 < enhanced < 1
