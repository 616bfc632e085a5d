"""Light under a flat sea: sun and sky through the surface, and the radiance of open water in every direction.

The light field is a first model: downwelling light falls off with depth as exp(-Kd z) and keeps the direction of the
refracted sun; water scatters it once into the view. For that source the radiance `F` below solves the
radiative-transfer equation exactly, so the light scattered into a line of sight between two points is
``F(z0, w) - exp(-c r) F(z1, w)`` without any fitted coefficient. `docs/rendering.md` derives it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optics.backend import Float64
from optics.refraction import dielectric_transmittance
from optics.scattering import fournier_forand, fournier_forand_backscattered_fraction
from optics.water import absorption, diffuse_attenuation, scattering, water_index
from rigs import Water
from scenes.spectrum import camera_bands, sun_irradiance

FloatArray = NDArray[np.float64]

SMALLEST_SCATTERING_ANGLE = np.radians(1.0)
"""The phase function is held constant nearer to the forward direction: light scattered by less than this is not told
apart from light that was not scattered."""

PHASE_TABLE_SIZE = 721

DIFFUSE_SURFACE_TRANSMITTANCE = 0.934
"""Of an evenly bright sky through a flat surface into water of index 1.34 (Preisendorfer 1976, Hydrologic Optics)."""


@dataclass(frozen=True, kw_only=True)
class Sun:
    """Where the sun stands: elevation above the horizon, azimuth from the world's east towards north."""

    elevation_deg: float = 60.0
    azimuth_deg: float = 120.0

    def __post_init__(self) -> None:
        if not 0 < self.elevation_deg <= 90:
            raise ValueError(f"expected elevation_deg above 0 and at most 90, got {self.elevation_deg}")


@dataclass(frozen=True, kw_only=True)
class Light:
    """Light and water at the wavelengths of the bands; arrays of shape (w,).

    Attributes
    ----------
    n_water : float
        Index at 550 nm.
    towards_sun : array, shape (3,)
        Unit vector towards the refracted sun, world frame.
    beam_attenuation, diffuse_attenuation, scattering : arrays
        c, Kd and b, 1/m.
    sun_irradiance, sky_irradiance : arrays
        Downwelling irradiance just below the surface on a horizontal plane, W / (m^2 nm).
    upwelling_ratio : array
        Upwelling over downwelling irradiance.
    sky_radiance : array
        Radiance of the sky above the surface, W / (m^2 nm sr).
    phase : array, shape (PHASE_TABLE_SIZE,)
        Phase function at even steps of the scattering angle from 0 to pi, 1/sr.
    """

    n_water: float
    towards_sun: FloatArray
    beam_attenuation: FloatArray
    diffuse_attenuation: FloatArray
    scattering: FloatArray
    sun_irradiance: FloatArray
    sky_irradiance: FloatArray
    upwelling_ratio: FloatArray
    sky_radiance: FloatArray
    phase: FloatArray

    def white_radiance(self, depth_m: float) -> FloatArray:
        """Radiance of a white horizontal Lambertian surface at a depth, per channel: what exposure is set by."""
        irradiance = (self.sun_irradiance + self.sky_irradiance) * np.exp(-self.diffuse_attenuation * depth_m)
        return np.asarray(camera_bands().weight @ irradiance / np.pi)


def underwater_light(water: Water, sun: Sun) -> Light:
    """Light below a flat surface for a rig's water and a sun."""
    wavelength = camera_bands().wavelength_nm
    n_water = float(water_index(550.0, water.salinity_ppt, water.temperature_celsius))
    cosine_air = np.sin(np.radians(sun.elevation_deg))
    sine_water = np.cos(np.radians(sun.elevation_deg)) / n_water
    cosine_water = float(np.sqrt(1 - sine_water**2))
    azimuth = np.radians(sun.azimuth_deg)
    direct, sky = sun_irradiance(wavelength)
    absorbed, scattered = absorption(water.jerlov_type, wavelength), scattering(water.jerlov_type, wavelength)
    backscattering = scattered * fournier_forand_backscattered_fraction()
    return Light(
        n_water=n_water,
        towards_sun=np.array([sine_water * np.cos(azimuth), sine_water * np.sin(azimuth), cosine_water]),
        beam_attenuation=absorbed + scattered,
        diffuse_attenuation=diffuse_attenuation(water.jerlov_type, wavelength, cosine_water),
        scattering=scattered,
        sun_irradiance=direct * cosine_air * float(dielectric_transmittance(Float64(cosine_air), 1.0, n_water)[0]),
        sky_irradiance=sky * DIFFUSE_SURFACE_TRANSMITTANCE,
        # Kirk 1984, eq. 5: R = (0.975 - 0.629 mu0) bb / a.
        upwelling_ratio=(0.975 - 0.629 * cosine_water) * backscattering / absorbed,
        sky_radiance=sky / np.pi,
        phase=_phase_table(),
    )


def _phase_table() -> FloatArray:
    angles = np.linspace(0, np.pi, PHASE_TABLE_SIZE)
    return fournier_forand(np.maximum(angles, SMALLEST_SCATTERING_ANGLE))
