"""Pure sea water: what water and its salt absorb and scatter by themselves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optics.kernels.tables import read_table
from optics.water.water import check_range, water_index

DATA = Path(__file__).parent / "data"

DEPOLARISATION = 0.039
"""Depolarisation ratio of water (Farinato & Rowell 1976), the choice of Zhang, Hu & He 2009."""

BOLTZMANN_J_PER_K = 1.380649e-23
AVOGADRO_PER_MOL = 6.02214076e23
WATER_KG_PER_MOL = 0.018


def pure_absorption(wavelength_nm: ArrayLike, salinity_ppt: float, temperature_celsius: float) -> NDArray[np.float64]:
    """Absorption coefficient of pure sea water, 1/m.

    WOPP v3 (Roettgers 2016): ``a(T, S) = a + (T - 20) psi_T + S psi_S``, with the table's values at 20 degrees
    Celsius; below 430 nm its uncertainty is of the order of its temperature term.
    """
    wavelength = np.asarray(wavelength_nm, dtype=np.float64)
    check_range("wavelength_nm", wavelength, 400, 700)
    check_range("salinity_ppt", salinity_ppt, 0, 35)
    check_range("temperature_celsius", temperature_celsius, 0, 30)
    table = read_table(DATA / "aw_wopp_v3_400_700.csv")
    at_20, by_salt, by_heat = (
        np.interp(wavelength, table["wavelength_nm"], table[name])
        for name in ("a_per_m", "PsiS_per_m_PSU", "PsiT_per_m_C")
    )
    return np.asarray(at_20 + (temperature_celsius - 20) * by_heat + salinity_ppt * by_salt)


def pure_scattering(wavelength_nm: ArrayLike, salinity_ppt: float, temperature_celsius: float) -> NDArray[np.float64]:
    """Scattering coefficient of pure sea water, 1/m: fluctuations of density and of the salt's concentration.

    Zhang, Hu & He 2009, Optics Express 17, 5698. Its refractive index is Quan & Fry's, made absolute by the index of
    air (Ciddor 1996).
    """
    wavelength = np.asarray(wavelength_nm, dtype=np.float64)
    index = water_index(wavelength, salinity_ppt, temperature_celsius)
    s, t = salinity_ppt, temperature_celsius
    wavenumber = 1e6 / wavelength**2  # squared, per square micrometre
    air = 1 + (5792105 / (238.0185 - wavenumber) + 167917 / (57.362 - wavenumber)) * 1e-8
    n = index * air
    dn_ds = (1.779e-4 - 1.05e-6 * t + 1.6e-8 * t**2 + 0.01155 / wavelength) * air
    density_derivative = (n**2 - 1) * (1 + 2 / 3 * (n**2 + 2) * (n / 3 - 1 / (3 * n)) ** 2)
    length = wavelength * 1e-9
    by_density = np.pi**2 / 2 * BOLTZMANN_J_PER_K * (t + 273.15) * _compressibility(s, t) * density_derivative**2
    fluctuation = s * WATER_KG_PER_MOL * dn_ds**2 / (_density(s, t) * -_activity_slope(s, t) * AVOGADRO_PER_MOL)
    by_salt = 2 * np.pi**2 * n**2 * fluctuation
    delta = DEPOLARISATION
    at_90 = (by_density + by_salt) / length**4 * (6 + 6 * delta) / (6 - 7 * delta)
    return np.asarray(8 * np.pi / 3 * at_90 * (2 + delta) / (1 + delta))


def molecular_phase(angle_rad: ArrayLike) -> NDArray[np.float64]:
    """Phase function of the water's molecules, 1/sr: ``3 (1 + f cos^2) / (4 pi (3 + f))``, f = (1 - d) / (1 + d)."""
    f = (1 - DEPOLARISATION) / (1 + DEPOLARISATION)
    return np.asarray(3 / (4 * np.pi * (3 + f)) * (1 + f * np.cos(np.asarray(angle_rad, dtype=np.float64)) ** 2))


def molecular_moments(count: int) -> NDArray[np.float64]:
    """First Legendre moments of `molecular_phase`, shape (count,): 1, 0, 2 f / (5 (3 + f)), and zeros."""
    f = (1 - DEPOLARISATION) / (1 + DEPOLARISATION)
    return np.array([1.0, 0.0, 2 * f / (5 * (3 + f))] + [0.0] * max(0, count - 3))[:count]


def _compressibility(s: float, t: float) -> float:
    """Isothermal compressibility at one atmosphere, 1/Pa (Millero 1980, as Zhang et al. 2009 use it)."""
    pure = 19652.21 + 148.4206 * t - 2.327105 * t**2 + 1.360477e-2 * t**3 - 5.155288e-5 * t**4
    linear = 54.6746 - 0.603459 * t + 1.09987e-2 * t**2 - 6.167e-5 * t**3
    power = 7.944e-2 + 1.6483e-2 * t - 5.3009e-4 * t**2
    return float(1e-5 / (pure + linear * s + power * s**1.5))


def _density(s: float, t: float) -> float:
    """Density, kg/m^3 (Millero & Poisson 1981), as in `cad.loads.seawater`, which this room may not use."""
    pure = (
        999.842594 + 6.793952e-2 * t - 9.095290e-3 * t**2 + 1.001685e-4 * t**3 - 1.120083e-6 * t**4 + 6.536332e-9 * t**5
    )
    linear = 8.24493e-1 - 4.0899e-3 * t + 7.6438e-5 * t**2 - 8.2467e-7 * t**3 + 5.3875e-9 * t**4
    return float(pure + linear * s + (-5.72466e-3 + 1.0227e-4 * t - 1.6546e-6 * t**2) * s**1.5 + 4.8314e-4 * s**2)


def _activity_slope(s: float, t: float) -> float:
    """Derivative of the logarithm of the water's activity by salinity, 1/ppt (Zhang, Hu & He 2009)."""
    linear = -5.58651e-4 + 2.40452e-7 * t - 3.12165e-9 * t**2 + 2.40808e-11 * t**3
    root = 1.79613e-5 - 9.9422e-8 * t + 2.08919e-9 * t**2 - 1.39872e-11 * t**3
    square = -2.31065e-6 - 1.37674e-9 * t - 1.93316e-11 * t**2
    return float(linear + 1.5 * root * s**0.5 + 2 * square * s)
