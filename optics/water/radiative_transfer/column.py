"""One wavelength's water solved, and its radiance in parts: unscattered sky, sun scattered once, everything else."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.water.inherent_optics import InherentOptics
from optics.water.pure_water import molecular_phase
from optics.water.radiative_transfer.delta_scaling import DEGREES, Scaled, delta_scaled
from optics.water.radiative_transfer.discrete_ordinates import Modes, solve
from optics.water.radiative_transfer.line_of_sight import many_times_scattered, once_scattered, scattering_angle
from optics.water.radiative_transfer.surface import cosine_in_air, internal_reflectance, transmittance

OUTSIDE_STREAMS = 24
WINDOW_STREAMS = 24
"""Per hemisphere, outside and inside Snell's window; `docs/explanation/radiative_transfer.md` shows the error by their
number."""

Phase = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, kw_only=True)
class Column:
    """Water of one wavelength with its modes of light; the azimuth of every direction is counted from the sun's.

    Attributes
    ----------
    scattering : float
        b, 1/m, with the forward peak.
    phase : callable
        Phase function of scattering angles of any shape, 1/sr, with the forward peak.
    scaled : Scaled
        The water without its forward peak, which `modes` are those of.
    """

    scattering: float
    phase: Phase
    scaled: Scaled
    modes: Modes


def solve_column(
    *,
    absorption: float,
    scattering: float,
    moments: FloatArray,
    phase: Phase,
    n_water: float,
    sun_cosine_air: float,
    sun_irradiance: float,
    sky_radiance: FloatArray,
    outside: int = OUTSIDE_STREAMS,
) -> Column:
    """Solve the radiative-transfer equation for one wavelength.

    Parameters
    ----------
    absorption, scattering : float
        a above 0 and b, 1/m.
    moments : array, shape (l + 1,)
        Legendre moments of the phase function, the first is 1; the last one is the share of the forward peak.
    phase : callable
        The phase function itself.
    sun_irradiance : float
        On a plane normal to the sun, above the surface.
    sky_radiance : array, shape (k,)
        Above the surface, at the cosines `quadrature.window_cosines_air` of k streams in Snell's window.
    outside : int
        Streams outside of it.
    """
    scaled = delta_scaled(absorption, scattering, moments)
    modes = solve(
        albedo=scaled.albedo,
        phase_moments=scaled.phase_moments,
        n_water=n_water,
        sun_cosine_air=sun_cosine_air,
        sun_irradiance=sun_irradiance,
        sky_radiance=sky_radiance,
        outside=outside,
    )
    return Column(scattering=scattering, phase=phase, scaled=scaled, modes=modes)


def solve_columns(
    optics: InherentOptics, *, sun_cosine_air: float, sun_irradiance: FloatArray, sky_radiance: FloatArray
) -> list[Column]:
    """Solve one column per wavelength; the sun's irradiance has shape (w,), the sky's radiance (w, WINDOW_STREAMS)."""
    moments = optics.moments(DEGREES + 1)
    return [
        solve_column(
            absorption=float(optics.absorption[position]),
            scattering=float(optics.scattering[position]),
            moments=moments[position],
            phase=_phase_function(optics, position),
            n_water=float(optics.n_water[position]),
            sun_cosine_air=sun_cosine_air,
            sun_irradiance=float(sun_irradiance[position]),
            sky_radiance=sky_radiance[position],
        )
        for position in range(len(moments))
    ]


def _phase_function(optics: InherentOptics, position: int) -> Phase:
    """Phase function of particles and molecules at one wavelength, of angles of any shape."""
    share = optics.molecular_fraction[position]
    return lambda angle: share * molecular_phase(angle) + (1 - share) * optics.phase(angle)


def multiple_radiance(column: Column, depth_m: FloatArray, cosine: FloatArray, azimuth_rad: FloatArray) -> FloatArray:
    """Radiance but for the unscattered sky and the sun's light scattered once on its way: shape (z, m, p)."""
    components = many_times_scattered(column.modes, column.scaled.attenuation * depth_m, cosine)
    often = np.tensordot(components, fourier(len(components), azimuth_rad), axes=(0, 0))
    return often + once_then_reflected(column, depth_m, cosine, azimuth_rad)


def fourier(orders: int, azimuth_rad: FloatArray) -> FloatArray:
    """Cosines of which an even function of the azimuth is composed: shape (m, p)."""
    return np.asarray(np.cos(np.outer(np.arange(orders), azimuth_rad)))


def once_radiance(column: Column, depth_m: FloatArray, cosine: FloatArray, azimuth_rad: FloatArray) -> FloatArray:
    """Radiance of the sun's light that was scattered once, on its way down: shape (z, m, p).

    With the phase function's forward peak, in water that has lost it (Nakajima & Tanaka 1988, J. Quant. Spectrosc.
    Radiat. Transfer 40, 51, their TMS).
    """
    return once_scattered(
        scattered=_scattered(column, cosine, azimuth_rad),
        sun_cosine=column.modes.sun_cosine,
        attenuation=column.scaled.attenuation,
        depth_m=depth_m,
        cosine=cosine,
    )


def sky_radiance(
    column: Column, sky: Callable[[FloatArray], FloatArray], depth_m: FloatArray, cosine: FloatArray
) -> FloatArray:
    """Radiance of the sky that was not scattered, from that above the surface by its zenith cosine: shape (z, m)."""
    n_water = column.modes.n_water
    upwards = np.maximum(cosine, 1e-9)
    air = cosine_in_air(upwards, n_water)
    below = transmittance(air, n_water) * n_water**2 * sky(air)
    slant = column.scaled.attenuation * depth_m[:, None] / upwards
    return np.where(cosine > 0, np.exp(-slant) * below, 0)


def once_then_reflected(column: Column, depth_m: FloatArray, cosine: FloatArray, azimuth_rad: FloatArray) -> FloatArray:
    """Radiance of the sun's light that was scattered once, upwards, and reflected down by the surface: (z, m, p)."""
    modes = column.modes
    upwards = np.where(cosine > 0, cosine, 1.0)
    at_surface = once_scattered(
        scattered=_scattered(column, -upwards, azimuth_rad),
        sun_cosine=modes.sun_cosine,
        attenuation=column.scaled.attenuation,
        depth_m=np.zeros(1),
        cosine=-upwards,
    )
    share = np.where(cosine > 0, internal_reflectance(upwards, modes.n_water), 0)
    dimmed = np.exp(-column.scaled.attenuation * depth_m[:, None] / upwards)
    return (share * dimmed)[..., None] * at_surface


def _scattered(column: Column, cosine: FloatArray, azimuth_rad: FloatArray) -> FloatArray:
    """Light per metre that the beam just below the surface sends into a direction: shape (m, p)."""
    angle = scattering_angle(cosine, azimuth_rad, column.modes.sun_cosine)
    return column.scattering * column.phase(angle) * column.modes.sun_irradiance
