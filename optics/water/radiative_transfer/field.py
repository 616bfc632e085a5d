"""The radiance field of one water, one sun and one sky."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.kernels.cache import load_or_make, result_key
from optics.water.inherent_optics import InherentOptics
from optics.water.radiative_transfer.column import WINDOW_STREAMS, Column, fourier, multiple_radiance, solve_columns
from optics.water.radiative_transfer.delta_scaling import DEGREES
from optics.water.radiative_transfer.grids import SHALLOWEST_M, azimuths_rad, cosines, depths_m
from optics.water.radiative_transfer.irradiance import irradiance_on_planes, irradiances
from optics.water.radiative_transfer.quadrature import window_cosines_air

DEEPEST_M = 40.0

RADIANCE_VERSION = 1
"""Raised when the solver or the tables give another field for the same water, sun and sky."""


@dataclass(frozen=True, kw_only=True)
class RadianceField:
    """Light of open water by wavelength w, depth z and direction (cosine m, azimuth p).

    Directions are those looked along: a positive cosine looks up. Azimuths are counted from the sun's, in which the
    light is even. Radiometric quantities are in the units of the sun and sky that were given.

    Attributes
    ----------
    wavelength_nm, n_water : arrays, shape (w,)
    sun_cosine : array, shape (w,)
        Of the refracted sun.
    sun_irradiance : array, shape (w,)
        On a plane normal to the refracted beam, just below the surface.
    attenuation, beam_attenuation : arrays, shape (w,)
        ``c = a + b``, and ``c* = a + b (1 - f)`` of light that counts as not scattered, 1/m.
    forward_fraction : array, shape (w,)
        Share f of the scattered light that is scattered by so little that it counts as not scattered.
    asymptotic_attenuation : array, shape (w,)
        Of all light very deep, 1/m.
    depth_m, cosine, azimuth_rad : arrays, shapes (z,), (m,), (p,)
        Where the tables below are, for linear interpolation.
    multiple : array, shape (w, z, m, p)
        Radiance but for the sun and the sky that were not scattered and the sun's light that was scattered once
        (closed form); what the surface reflects down again is in it, whatever its history.
    irradiance : array, shape (w, z, m, p)
        On a plane with this outward normal, of all light but the direct sun.
    downwelling, upwelling, scalar : arrays, shape (w, z)
        Irradiances with the sun.
    diffuse_attenuation : array, shape (w, z)
        Kd of the downwelling irradiance, 1/m.
    mean_cosine_down, mean_cosine_up : arrays, shape (w, z)
        Of the light from above and from below.
    """

    wavelength_nm: FloatArray
    n_water: FloatArray
    sun_cosine: FloatArray
    sun_irradiance: FloatArray
    attenuation: FloatArray
    beam_attenuation: FloatArray
    forward_fraction: FloatArray
    asymptotic_attenuation: FloatArray
    depth_m: FloatArray
    cosine: FloatArray
    azimuth_rad: FloatArray
    multiple: FloatArray
    irradiance: FloatArray
    downwelling: FloatArray
    upwelling: FloatArray
    scalar: FloatArray
    diffuse_attenuation: FloatArray
    mean_cosine_down: FloatArray
    mean_cosine_up: FloatArray


def radiance_field(
    optics: InherentOptics,
    *,
    sun_cosine_air: float,
    sun_irradiance: FloatArray,
    sky_radiance: Callable[[FloatArray], FloatArray],
    deepest_m: float = DEEPEST_M,
) -> RadianceField:
    """Light in homogeneous, infinitely deep water under a flat surface; from the cache when it can be.

    Parameters
    ----------
    optics : InherentOptics
    sun_cosine_air : float
        Cosine of the sun's zenith angle above the surface, above 0.
    sun_irradiance : array, shape (w,)
        On a plane normal to the sun, above the surface.
    sky_radiance : callable
        From cosines of the zenith angle, shape (k,), to the radiance of the sky, shape (w, k).
    deepest_m : float
        Last depth of the tables.

    Raises
    ------
    ValueError
        With every argument that is out of range.
    """
    sun = np.asarray(sun_irradiance, dtype=np.float64)
    sky = np.asarray(sky_radiance(window_cosines_air(WINDOW_STREAMS)), dtype=np.float64)
    _check(optics, sun_cosine_air, sun, sky, deepest_m)
    # Particles and molecules at the angles of the table: what all else of a phase function follows from.
    phase = optics.phase_function(optics.phase.angle_rad)
    numbers = (optics.wavelength_nm, optics.absorption, optics.scattering, optics.n_water, phase)
    key = result_key("radiance field", RADIANCE_VERSION, *numbers, float(sun_cosine_air), sun, sky, float(deepest_m))
    kept: RadianceField = load_or_make(
        "radiance field",
        key,
        lambda: _solved(optics, sun_cosine_air, sun, sky, deepest_m),
        pack=vars,
        unpack=lambda stored: RadianceField(**stored),
    )
    return kept


def _solved(
    optics: InherentOptics, sun_cosine_air: float, sun: FloatArray, sky: FloatArray, deepest_m: float
) -> RadianceField:
    """Solve and tabulate."""
    columns = solve_columns(optics, sun_cosine_air=sun_cosine_air, sun_irradiance=sun, sky_radiance=sky)
    return _tabulated(optics, columns, sun_cosine_air, deepest_m)


def _tabulated(optics: InherentOptics, columns: list[Column], sun_cosine_air: float, deepest_m: float) -> RadianceField:
    """Tables of what was solved, one column per wavelength."""
    depth, cosine, azimuth = depths_m(deepest_m), cosines(optics.n_water, sun_cosine_air), azimuths_rad()
    attenuation = np.array([column.scaled.attenuation for column in columns])
    layers = [irradiances(column.modes, column.scaled.attenuation * depth) for column in columns]
    planes = [irradiance_on_planes(column.modes, column.scaled.attenuation * depth, cosine) for column in columns]
    down, up = np.stack([e.downwelling for e in layers]), np.stack([e.upwelling for e in layers])
    scalar_down, scalar_up = np.stack([e.scalar_down for e in layers]), np.stack([e.scalar_up for e in layers])
    return RadianceField(
        wavelength_nm=optics.wavelength_nm,
        n_water=optics.n_water,
        sun_cosine=np.array([column.modes.sun_cosine for column in columns]),
        sun_irradiance=np.array([column.modes.sun_irradiance for column in columns]),
        attenuation=optics.beam_attenuation,
        beam_attenuation=attenuation,
        forward_fraction=np.array([column.scaled.forward_fraction for column in columns]),
        asymptotic_attenuation=attenuation * [column.modes.rate[0, :-1].min() for column in columns],
        depth_m=depth,
        cosine=cosine,
        azimuth_rad=azimuth,
        multiple=np.stack([multiple_radiance(column, depth, cosine, azimuth) for column in columns]),
        irradiance=np.tensordot(np.stack(planes), fourier(DEGREES, azimuth), axes=(1, 0)),
        downwelling=down,
        upwelling=up,
        scalar=scalar_down + scalar_up,
        diffuse_attenuation=attenuation[:, None] * np.stack([e.diffuse_attenuation for e in layers]),
        mean_cosine_down=down / scalar_down,
        mean_cosine_up=up / scalar_up,
    )


def _check(
    optics: InherentOptics, sun_cosine_air: float, sun_irradiance: FloatArray, sky: FloatArray, deepest_m: float
) -> None:
    """Raise a `ValueError` with everything that is wrong with the arguments of `radiance_field`."""
    count = len(optics.wavelength_nm)
    problems = []
    if not 0 < sun_cosine_air <= 1:
        problems.append(f"expected sun_cosine_air above 0 and at most 1, got {sun_cosine_air}")
    if not deepest_m > SHALLOWEST_M:
        problems.append(f"expected deepest_m above {SHALLOWEST_M}, got {deepest_m}")
    if sun_irradiance.shape != (count,) or not (sun_irradiance >= 0).all():
        problems.append(f"expected sun_irradiance of shape ({count},), none below 0, got {sun_irradiance}")
    if sky.shape != (count, WINDOW_STREAMS) or not (sky >= 0).all():
        problems.append(f"expected sky_radiance to give shape (w, k) with w = {count}, none below 0, got {sky}")
    if not (optics.absorption > 0).all():
        problems.append(f"expected absorption above 0 at every wavelength, got {optics.absorption}")
    if not (optics.scattering >= 0).all():
        problems.append(f"expected scattering of at least 0 at every wavelength, got {optics.scattering}")
    if problems:
        raise ValueError("\n".join(problems))
