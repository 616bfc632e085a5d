"""Water: its refractive index, absorption, scattering and diffuse attenuation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optics.tables import read_table
from rigs.specification import JerlovType

DATA = Path(__file__).parent / "data"

LEAST_SUN_COSINE = 0.65
"""Cosine of the refracted sun on the horizon is 0.66: what is lower was not refracted."""


def water_index(wavelength_nm: ArrayLike, salinity_ppt: float, temperature_celsius: float) -> NDArray[np.float64]:
    """Refractive index of (sea)water relative to air at 1 atm.

    Quan & Fry 1995, Applied Optics 34, 3477: valid 400-700 nm, 0-35 ppt, 0-30 degrees Celsius, uncertainty 3e-5.

    Raises
    ------
    ValueError
        Outside the formula's range.
    """
    wavelength = np.asarray(wavelength_nm, dtype=np.float64)
    check_range("wavelength_nm", wavelength, 400, 700)
    check_range("salinity_ppt", salinity_ppt, 0, 35)
    check_range("temperature_celsius", temperature_celsius, 0, 30)
    s, t = salinity_ppt, temperature_celsius
    return np.asarray(
        1.31405
        + (1.779e-4 - 1.05e-6 * t + 1.6e-8 * t**2) * s
        - 2.02e-6 * t**2
        + (15.868 + 0.01155 * s - 0.00423 * t) / wavelength
        - 4382 / wavelength**2
        + 1.1455e6 / wavelength**3
    )


def absorption(jerlov_type: JerlovType, wavelength_nm: ArrayLike) -> NDArray[np.float64]:
    """Absorption coefficient, 1/m: Williamson & Hollins 2022, Applied Optics 61, 9951 (types IB to 5C)."""
    return _jerlov_column(f"a_{jerlov_type}", wavelength_nm)


def scattering(jerlov_type: JerlovType, wavelength_nm: ArrayLike) -> NDArray[np.float64]:
    """Scattering coefficient, 1/m: Williamson & Hollins 2022 (types IB to 5C)."""
    return _jerlov_column(f"b_{jerlov_type}", wavelength_nm)


def diffuse_attenuation(
    jerlov_type: JerlovType, wavelength_nm: ArrayLike, sun_cosine: float = 1.0
) -> NDArray[np.float64]:
    """Diffuse attenuation of downwelling irradiance, 1/m, from absorption and scattering.

    Kirk 1984, Limnology and Oceanography 29, 350: ``Kd = sqrt(a^2 + (0.425 mu0 - 0.190) a b) / mu0``, with mu0 the
    cosine of the refracted sun (in the water, not in the sky). It is consistent with the type's own a and b at every
    wavelength; the tabulated Kd of the Jerlov types come from other campaigns.
    """
    check_range("sun_cosine", sun_cosine, LEAST_SUN_COSINE, 1)
    a, b = absorption(jerlov_type, wavelength_nm), scattering(jerlov_type, wavelength_nm)
    return np.sqrt(a**2 + (0.425 * sun_cosine - 0.190) * a * b) / sun_cosine


def _jerlov_column(column: str, wavelength_nm: ArrayLike) -> NDArray[np.float64]:
    wavelength = np.asarray(wavelength_nm, dtype=np.float64)
    check_range("wavelength_nm", wavelength, 400, 700)
    table = read_table(DATA / "williamson_hollins2022_iop_5nm.csv")
    return np.asarray(np.interp(wavelength, table["wavelength_nm"], table[column]))


def check_range(name: str, value: ArrayLike, lowest: float, highest: float) -> None:
    """Raise a `ValueError` that says what was expected and what came; NaN is outside every range."""
    values = np.asarray(value, dtype=np.float64)
    if not ((values >= lowest) & (values <= highest)).all():
        raise ValueError(f"expected {name} between {lowest:g} and {highest:g}, got {value!r}")
