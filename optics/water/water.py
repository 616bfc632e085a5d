"""Water: its refractive index, absorption, scattering and diffuse attenuation."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optics.kernels.tables import read_table
from rigs import JerlovType, WaterSource
from rigs.water import TYPES_OF_SOURCE, check_type_of_source

DATA = Path(__file__).parent / "data"

AttenuationSource = Literal["austin-petzold", "jerlov"]

ATTENUATION_FILES: dict[AttenuationSource, str] = {
    "austin-petzold": "austin_petzold1986_kd.csv",
    "jerlov": "jerlov1976_kd.csv",
}

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


def absorption(
    jerlov_type: JerlovType, wavelength_nm: ArrayLike, source: WaterSource = "williamson-hollins"
) -> NDArray[np.float64]:
    """Absorption coefficient of a Jerlov type, the water's own included, 1/m.

    Parameters
    ----------
    source : str
        ``williamson-hollins``: 2022, Applied Optics 61, 9951 (types IB to 5C), measured at 412 to 715 nm.
        ``solonenko-mobley``: 2015, Applied Optics 54, 5392 (all ten types), an inversion of Jerlov's Kd. Its table has
        no absorption of 5C from 600 nm and of 3C from 675 nm on (misprinted there): see `_filled`.

    Raises
    ------
    ValueError
        Outside 400 to 700 nm, or when the source has no such type.
    """
    return _jerlov_column("a", jerlov_type, wavelength_nm, source)


def scattering(
    jerlov_type: JerlovType, wavelength_nm: ArrayLike, source: WaterSource = "williamson-hollins"
) -> NDArray[np.float64]:
    """Scattering coefficient of a Jerlov type, the water's own included, 1/m; sources as for `absorption`."""
    return _jerlov_column("b", jerlov_type, wavelength_nm, source)


def molecular_scattering_of_types(wavelength_nm: ArrayLike) -> NDArray[np.float64]:
    """Molecular part of the Jerlov types' scattering coefficients, 1/m.

    Haltrin 1999, Applied Optics 38, 6826, eq. 5. Both sources build b of every type as this plus small and large
    particles, b = b_w + C_s x^1.7 + C_l x^0.3 with x = 400 nm / wavelength; for Solonenko & Mobley's types I and IA
    the tables give back its factor as 1.000 and 1.001 (`tests/optics/water/test_water.py`).
    """
    wavelength = np.asarray(wavelength_nm, dtype=np.float64)
    return np.asarray(0.005826 * (400 / wavelength) ** 4.322)


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


def tabulated_diffuse_attenuation(
    jerlov_type: JerlovType, wavelength_nm: ArrayLike, source: AttenuationSource
) -> NDArray[np.float64]:
    """Kd of a Jerlov type as a campaign tabulated it, 1/m, straight lines between its wavelengths.

    For comparison: nothing is computed from it.

    Parameters
    ----------
    source : str
        ``austin-petzold``: 1986, Optical Engineering 25, 471, table VI (I to 1C; I is pure sea water).
        ``jerlov``: 1976, Marine Optics, table XXVII (all ten; its type I lies below pure sea water at most
        wavelengths, which Austin & Petzold corrected).
    """
    wavelength = np.asarray(wavelength_nm, dtype=np.float64)
    check_range("wavelength_nm", wavelength, 400, 700)
    types = attenuation_types(source)
    if jerlov_type not in types:
        raise ValueError(f"expected a Jerlov type with Kd by {source} ({', '.join(types)}), got {jerlov_type!r}")
    table = read_table(DATA / ATTENUATION_FILES[source])
    return np.asarray(np.interp(wavelength, table["wavelength_nm"], table[f"Kd_{jerlov_type}"]))


def attenuation_types(source: AttenuationSource) -> tuple[str, ...]:
    """Jerlov types that a source tabulates Kd of, clearest first."""
    names = read_table(DATA / ATTENUATION_FILES[source])
    return tuple(name.removeprefix("Kd_") for name in names if name != "wavelength_nm")


def filled_wavelengths_nm(jerlov_type: JerlovType, source: WaterSource) -> NDArray[np.float64]:
    """Wavelengths from 400 nm on at which a source's table gives no absorption of a type, and `absorption` fills it."""
    if source != "solonenko-mobley":
        return np.array([])
    table = read_table(DATA / "solonenko_mobley2015_a.csv")
    return table["wavelength_nm"][np.isnan(table[f"a_{jerlov_type}"]) & (table["wavelength_nm"] >= 400)]


def _jerlov_column(
    letter: str, jerlov_type: JerlovType, wavelength_nm: ArrayLike, source: WaterSource
) -> NDArray[np.float64]:
    wavelength = np.asarray(wavelength_nm, dtype=np.float64)
    check_range("wavelength_nm", wavelength, 400, 700)
    if source not in TYPES_OF_SOURCE:
        raise ValueError(f"expected a source of Jerlov types ({', '.join(TYPES_OF_SOURCE)}), got {source!r}")
    check_type_of_source(jerlov_type, source)
    if source == "williamson-hollins":
        table = read_table(DATA / "williamson_hollins2022_iop_5nm.csv")
    else:
        table = read_table(DATA / f"solonenko_mobley2015_{letter}.csv")
    column = f"{letter}_{jerlov_type}"
    values = _filled(table, jerlov_type) if np.isnan(table[column]).any() else table[column]
    return np.asarray(np.interp(wavelength, table["wavelength_nm"], values))


def _filled(table: dict[str, NDArray[np.float64]], jerlov_type: str) -> NDArray[np.float64]:
    """Absorption of a type with gaps: between its neighbours, at the share of the way that it last stood at.

    3C lies between 1C and 7C, 5C between 3C and 7C. At 500 to 575 nm 5C stands at 0.33, 0.32, 0.31 and 0.30 of the
    way, so the last one is held; the neighbours differ there by 0.06 1/m at most.
    """
    below = {"3C": "1C", "5C": "3C"}[jerlov_type]
    clearer = _filled(table, below) if below in ("3C", "5C") else table[f"a_{below}"]
    values, murkier = table[f"a_{jerlov_type}"].copy(), table["a_7C"]
    gap = np.isnan(values)
    last = np.flatnonzero(~gap)[-1]
    share = (values[last] - clearer[last]) / (murkier[last] - clearer[last])
    values[gap] = (clearer + share * (murkier - clearer))[gap]
    return values


def check_range(name: str, value: ArrayLike, lowest: float, highest: float) -> None:
    """Raise a `ValueError` that says what was expected and what came; NaN is outside every range."""
    values = np.asarray(value, dtype=np.float64)
    if not ((values >= lowest) & (values <= highest)).all():
        came = repr(values.item()) if values.ndim == 0 else f"{values.min():g} to {values.max():g}"
        raise ValueError(f"expected {name} between {lowest:g} and {highest:g}, got {came}")
