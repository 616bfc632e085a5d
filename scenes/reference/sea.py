"""What the sea does to light, in the numbers that the reference renderer takes.

This is the one place that reads the fast renderer's `Light`; everything else in this package starts from `Sea`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from optics.kernels.arrays import FloatArray
from scenes.light.light import Light

Phase = Callable[[FloatArray], FloatArray]
"""Scattering angle, radians, to 1/sr; its integral over the sphere is 1."""


@dataclass(frozen=True, kw_only=True)
class Sea:
    """Water, sun and sky at a few wavelengths; arrays of shape (w,).

    Attributes
    ----------
    absorption, scattering : arrays
        a and b, 1/m.
    molecular_fraction : array
        Share of b that is the molecules'.
    phase : Phase
        Of the particles.
    n_water : array
    towards_sun : array, shape (3,)
        Unit vector towards the refracted sun, world frame.
    sun_irradiance : array
        On a plane normal to the refracted beam just below the surface, W / (m^2 nm).
    sky_radiance : callable
        Cosines of the zenith angle (k,) to radiance above the surface (w, k), W / (m^2 nm sr).
    """

    absorption: FloatArray
    scattering: FloatArray
    molecular_fraction: FloatArray
    phase: Phase
    n_water: FloatArray
    towards_sun: FloatArray
    sun_irradiance: FloatArray
    sky_radiance: Callable[[FloatArray], FloatArray]

    def at(self, columns: slice) -> Sea:
        """The same sea at some of its wavelengths."""
        return Sea(
            absorption=self.absorption[columns],
            scattering=self.scattering[columns],
            molecular_fraction=self.molecular_fraction[columns],
            phase=self.phase,
            n_water=self.n_water[columns],
            towards_sun=self.towards_sun,
            sun_irradiance=self.sun_irradiance[columns],
            sky_radiance=lambda cosine: self.sky_radiance(cosine)[columns],
        )


def sea_of(light: Light) -> Sea:
    """Sea of the fast renderer's light, at the wavelengths of its bands."""
    return Sea(
        absorption=light.optics.absorption,
        scattering=light.optics.scattering,
        molecular_fraction=light.optics.molecular_fraction,
        phase=light.optics.phase,
        n_water=light.optics.n_water,
        towards_sun=light.towards_sun,
        sun_irradiance=light.field.sun_irradiance,
        sky_radiance=light.daylight.sky_radiance,
    )
