"""The flat surface: its kernel's twin, energy, and reciprocity of the water below it."""

from __future__ import annotations

import numpy as np
import pytest

from optics.kernels.backend import Float64
from optics.kernels.refraction import dielectric_transmittance
from optics.water.radiative_transfer.discrete_ordinates import solve
from optics.water.radiative_transfer.line_of_sight import many_times_scattered
from optics.water.radiative_transfer.surface import (
    cosine_in_air,
    cosine_in_water,
    critical_cosine,
    internal_reflectance,
    transmittance,
)

N_WATER = 1.34
COSINES = np.linspace(0.01, 1, 50)


def test_transmittance_is_that_of_the_kernel():
    kernel = dielectric_transmittance(Float64(COSINES), 1.0, N_WATER)
    np.testing.assert_allclose(transmittance(COSINES, N_WATER), np.array(kernel), rtol=1e-12)


def test_transmittance_is_the_same_from_below():
    kernel = dielectric_transmittance(Float64(COSINES), N_WATER, 1.0)
    np.testing.assert_allclose(1 - internal_reflectance(COSINES, N_WATER), np.array(kernel), atol=1e-12)


def test_refraction_goes_there_and_back():
    water = cosine_in_water(COSINES, N_WATER)
    assert (water > critical_cosine(N_WATER)).all()
    np.testing.assert_allclose(cosine_in_air(water, N_WATER), COSINES, rtol=1e-10)


def test_beyond_the_edge_of_the_window_all_is_reflected():
    edge = critical_cosine(N_WATER)
    np.testing.assert_array_equal(internal_reflectance(np.array([0.0, 0.3, edge - 1e-9]), N_WATER), 1.0)
    assert internal_reflectance(1.0, N_WATER) == pytest.approx(((N_WATER - 1) / (N_WATER + 1)) ** 2)


def test_water_under_its_surface_is_reciprocal():
    """Sun and eye exchanged: the radiance per irradiance on the water is the same, Fourier component by component.

    Helmholtz reciprocity (Chandrasekhar 1960, section 13), here with the light that the surface reflects to and fro.
    """
    suns = cosine_in_water(np.array([0.3, 0.9]), N_WATER)
    seen = []
    for air, eye in ((0.3, suns[1]), (0.9, suns[0])):
        solution = solve(
            albedo=0.9,
            phase_moments=0.8 ** np.arange(24),
            n_water=N_WATER,
            sun_cosine_air=air,
            sun_irradiance=1.0,
            sky_radiance=np.zeros(16),
            outside=16,
        )
        radiance = many_times_scattered(solution, np.zeros(1), np.array([-eye]))[:, 0, 0]
        seen.append(radiance / (solution.sun_irradiance * solution.sun_cosine))
    # 16 + 16 streams; components of high order are small, and compared with the first.
    np.testing.assert_allclose(seen[0], seen[1], atol=1e-6 * seen[0][0])
