"""The sun: where it stands, and how much of its light the atmosphere lets through."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from datetime import datetime

import numpy as np
from numpy.typing import ArrayLike

from optics.kernels.arrays import FloatArray
from optics.kernels.tables import read_table
from scenes.light.spectrum import DATA

SUN_RADIUS_RAD = np.radians(16.0 / 60.0)
"""Half of the sun's mean angular diameter of 32 arc minutes (31.5 to 32.5 over the year)."""

STANDARD_AIR_MASS = 1.5
"""Air mass of the reference spectra of ASTM G173-03."""


@dataclass(frozen=True, kw_only=True)
class Sun:
    """Where the sun stands: elevation above the horizon, azimuth from the world's east towards north."""

    elevation_deg: float = 60.0
    azimuth_deg: float = 120.0

    def __post_init__(self) -> None:
        if not 0 < self.elevation_deg <= 90:
            raise ValueError(f"expected elevation_deg above 0 and at most 90, got {self.elevation_deg}")
        if not np.isfinite(self.azimuth_deg):
            raise ValueError(f"expected a finite azimuth_deg, got {self.azimuth_deg}")

    @property
    def cosine(self) -> float:
        """Cosine of the angle between zenith and sun, above the surface."""
        return float(np.sin(np.radians(self.elevation_deg)))

    @property
    def direction(self) -> FloatArray:
        """Unit vector towards the sun above the surface, world frame, shape (3,)."""
        return self.refracted(1.0)

    def refracted(self, n_water: float) -> FloatArray:
        """Unit vector towards the sun as it stands seen from below a flat surface, world frame, shape (3,)."""
        sine = np.cos(np.radians(self.elevation_deg)) / n_water
        azimuth = np.radians(self.azimuth_deg)
        return np.array([sine * np.cos(azimuth), sine * np.sin(azimuth), np.sqrt(1 - sine**2)])


def sun_at(time: datetime, *, latitude_deg: float, longitude_deg: float) -> Sun:
    """Sun at a time and a place, bent by the air as it is seen (NREL's algorithm, Reda & Andreas 2004, by pvlib).

    Parameters
    ----------
    time : datetime
        With its time zone.
    latitude_deg, longitude_deg : float
        North and east are positive.

    Raises
    ------
    ValueError
        For a time without a zone, a place that is not on Earth, or a sun below the horizon.
    ImportError
        When pvlib is not installed.
    """
    problems = []
    if time.tzinfo is None:
        problems.append(f"expected a time with its zone (as 2026-03-20T12:00:00+00:00), got {time.isoformat()}")
    if not -90 <= latitude_deg <= 90:
        problems.append(f"expected latitude_deg from -90 to 90, got {latitude_deg}")
    if not -180 <= longitude_deg <= 180:
        problems.append(f"expected longitude_deg from -180 to 180, got {longitude_deg}")
    if problems:
        raise ValueError("; ".join(problems))
    try:
        # Imported by name: an optional extra whose types are not known where it is not installed.
        solar_position = importlib.import_module("pvlib.solarposition")
        pandas = importlib.import_module("pandas")
    except ImportError as error:
        raise ImportError(
            "the sun by date and place needs pvlib: pip install 'mirrorgaze[sun]', or give its elevation and azimuth"
        ) from error
    position = solar_position.spa_python(pandas.DatetimeIndex([time]), latitude_deg, longitude_deg).iloc[0]
    elevation = float(position["apparent_elevation"])
    if elevation <= 0:
        raise ValueError(
            f"expected a time at which the sun is up, got {time.isoformat()}: "
            f"at {latitude_deg:g}, {longitude_deg:g} it stands at {elevation:.1f} degrees"
        )
    # Compass azimuths run from north over east.
    return Sun(elevation_deg=elevation, azimuth_deg=(90.0 - float(position["azimuth"])) % 360.0)


def air_mass(elevation_deg: ArrayLike) -> FloatArray:
    """Length of the sun's path through the air, in units of the path from the zenith (Kasten & Young 1989).

    Applied Optics 28, 4735, eq. 3; 38 at the horizon, and 0.9997 at the zenith by the fit's error.
    """
    elevation = np.asarray(elevation_deg, dtype=np.float64)
    return np.asarray(1 / (np.sin(np.radians(elevation)) + 0.50572 * (elevation + 6.07995) ** -1.6364))


def direct_irradiance(wavelength_nm: ArrayLike, elevation_deg: float) -> FloatArray:
    """Sunlight at sea level on a plane that faces the sun, W / (m^2 nm), shape of `wavelength_nm`.

    The extraterrestrial spectrum of ASTM G173-03, dimmed by Beer's law at each wavelength; the optical depth of the
    air is what that standard's direct beam at air mass 1.5 has lost. From 350 to 750 nm, held constant outside.
    """
    space, ground = extraterrestrial_and_standard(wavelength_nm)
    return np.asarray(space * (ground / space) ** (air_mass(elevation_deg) / STANDARD_AIR_MASS))


def extraterrestrial_and_standard(wavelength_nm: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Normal irradiance of the sun above the air, and below 1.5 air masses (ASTM G173-03), W / (m^2 nm)."""
    table = read_table(DATA / "astm_g173_350_750.csv")
    wavelength = np.asarray(wavelength_nm, dtype=np.float64)
    space = np.interp(wavelength, table["wavelength_nm"], table["etr"])
    return np.asarray(space), np.asarray(np.interp(wavelength, table["wavelength_nm"], table["direct_circumsolar"]))
