"""Daylight above the surface: the direct sun, and the radiance of a clear, cloudy or overcast sky."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from optics.kernels.arrays import FloatArray
from optics.kernels.backend import Float32, UInt32, dr
from scenes.light.spectrum import sun_irradiance
from scenes.light.sun import STANDARD_AIR_MASS, Sun, air_mass, direct_irradiance, extraterrestrial_and_standard

CLEAR_GRADATION = (-1.0, -0.32)
CLEAR_INDICATRIX = (10.0, -3.0, 0.45)
"""a, b and c, d, e of sky type 12 of CIE S 011/E:2003 (ISO 15469): the CIE standard clear sky, clean air."""

AZIMUTH_COUNT = 180
COSINE_COUNT = 64
TABLE_SIZE = 1024


@dataclass(frozen=True, kw_only=True)
class Daylight:
    """Sun and sky above the surface at some wavelengths; `cloud` is the covered share of the sky, 0 to 1.

    The sky is the same in all azimuths, as the underwater light field takes it to be: a clear sky's brightness around
    the sun is spread over the ring of the same height.
    """

    wavelength_nm: FloatArray
    sun: Sun
    cloud: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.cloud <= 1:
            raise ValueError(f"expected cloud from 0 (clear) to 1 (overcast), got {self.cloud}")

    @cached_property
    def sun_irradiance(self) -> FloatArray:
        """Direct sun on a plane that faces it, W / (m^2 nm), shape (w,)."""
        clear = self._clear_sun * self.sun.cosine
        total = (clear + self._clear_sky) * cloud_transmittance(self.cloud)
        return np.asarray((total - self.sky_irradiance) / self.sun.cosine)

    @cached_property
    def sky_irradiance(self) -> FloatArray:
        """Light of the sky on a level plane, W / (m^2 nm), shape (w,)."""
        total = self._clear_sun * self.sun.cosine + self._clear_sky
        clear_share = self._clear_sky / total
        # Kasten & Czeplak 1980: the diffuse share grows with the square of the cloud cover, to all of it.
        share = clear_share + (1 - clear_share) * self.cloud**2
        return np.asarray(total * cloud_transmittance(self.cloud) * share)

    def sky_radiance(self, cos_zenith: ArrayLike) -> FloatArray:
        """Radiance of the sky, W / (m^2 nm sr), shape (w, k), at cosines of the zenith angle, shape (k,)."""
        return np.asarray(self.sky_irradiance[:, np.newaxis] * self.sky_shape(cos_zenith))

    def sky_shape(self, cos_zenith: ArrayLike) -> FloatArray:
        """Radiance per irradiance on a level plane, 1/sr, shape (k,); the same at all wavelengths."""
        cosine = np.asarray(cos_zenith, dtype=np.float64)
        clear = clear_sky(cosine, self.sun.elevation_deg)
        return np.asarray((1 - self.cloud) * clear + self.cloud * overcast_sky(cosine))

    @property
    def _clear_sun(self) -> FloatArray:
        return direct_irradiance(self.wavelength_nm, self.sun.elevation_deg)

    @property
    def _clear_sky(self) -> FloatArray:
        return clear_sky_irradiance(self.wavelength_nm, self.sun.elevation_deg)


def clear_sky_irradiance(wavelength_nm: ArrayLike, elevation_deg: float) -> FloatArray:
    """Light of a clear sky on a level plane at sea level, W / (m^2 nm).

    The sky shines by what the beam has lost: the share of that loss which reaches the ground is taken from ASTM
    G173-03 at its air mass of 1.5, wavelength by wavelength, and kept for all other elevations.
    """
    space, ground = extraterrestrial_and_standard(wavelength_nm)
    standard_sine = _sine_at_standard_air_mass()
    sky = sun_irradiance(np.asarray(wavelength_nm, dtype=np.float64))[1]
    share = sky / ((space - ground) * standard_sine)
    lost = space - direct_irradiance(wavelength_nm, elevation_deg)
    return np.asarray(share * lost * np.sin(np.radians(elevation_deg)))


def _sine_at_standard_air_mass() -> float:
    elevation = np.linspace(41.0, 42.5, 1501)
    return float(np.sin(np.radians(np.interp(-STANDARD_AIR_MASS, -air_mass(elevation), elevation))))


def cloud_transmittance(cloud: float) -> float:
    """Share of the clear day's light on a level plane under a cloud cover from 0 to 1 (Kasten & Czeplak 1980).

    Solar Energy 24, 177: ten years of Hamburg, ``1 - 0.75 N^3.4``; a quarter is left under a closed cover.
    """
    return float(1 - 0.75 * cloud**3.4)


def overcast_sky(cos_zenith: ArrayLike) -> FloatArray:
    """Radiance of the overcast sky per irradiance, 1/sr: three times as bright overhead as at the horizon.

    Moon & Spencer 1942: ``1 + 2 cos``, whose irradiance is ``7 pi / 3``.
    """
    return np.asarray((1 + 2 * np.asarray(cos_zenith, dtype=np.float64)) * 3 / (7 * np.pi))


def clear_sky(cos_zenith: ArrayLike, elevation_deg: float) -> FloatArray:
    """Radiance of the CIE standard clear sky per irradiance, averaged over azimuth, 1/sr, shape (k,)."""
    nodes, weights = np.polynomial.legendre.leggauss(COSINE_COUNT)
    nodes, weights = (nodes + 1) / 2, weights / 2
    irradiance = 2 * np.pi * weights @ (nodes * _azimuth_mean(nodes, elevation_deg))
    return np.asarray(_azimuth_mean(np.asarray(cos_zenith, dtype=np.float64), elevation_deg) / irradiance)


def _azimuth_mean(cos_zenith: FloatArray, elevation_deg: float) -> FloatArray:
    """Relative radiance of sky type 12 (CIE S 011/E:2003, eqs. 1-3), averaged over azimuth."""
    a, b = CLEAR_GRADATION
    c, d, e = CLEAR_INDICATRIX
    azimuth = np.pi * (np.arange(AZIMUTH_COUNT) + 0.5) / AZIMUTH_COUNT
    sun_sine, sun_cosine = np.cos(np.radians(elevation_deg)), np.sin(np.radians(elevation_deg))
    sine = np.sqrt(1 - cos_zenith**2)
    cosine = sun_cosine * cos_zenith[..., np.newaxis] + sun_sine * sine[..., np.newaxis] * np.cos(azimuth)
    distance = np.arccos(np.clip(cosine, -1, 1))
    indicatrix = 1 + c * (np.exp(d * distance) - np.exp(d * np.pi / 2)) + e * np.cos(distance) ** 2
    # The exponent is minus infinity at the horizon itself: the gradation is one there.
    gradation = 1 + a * np.exp(b / np.maximum(cos_zenith, 1e-6))
    return np.asarray(gradation * indicatrix.mean(axis=-1))


def sky_table(daylight: Daylight) -> Any:
    """Table of `sky_seen`: the sky's shape over the cosine of the zenith angle."""
    # Even steps of the square root of the cosine: the sky changes most near the horizon.
    return Float32(daylight.sky_shape(np.linspace(0, 1, TABLE_SIZE) ** 2).astype(np.float32))


def sky_seen(sky_irradiance: list[Any], table: Any, cos_zenith: Any) -> list[Any]:
    """Kernel: radiance of the sky above the surface at each wavelength, from its irradiance on a level plane."""
    position = dr.safe_sqrt(dr.clip(cos_zenith, 0, 1)) * (TABLE_SIZE - 1)
    cell = dr.minimum(UInt32(position), TABLE_SIZE - 2)
    low, high = (dr.gather(Float32, table, cell + step) for step in (0, 1))
    shape = dr.lerp(low, high, position - Float32(cell))
    return [shape * irradiance for irradiance in sky_irradiance]
