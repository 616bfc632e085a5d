"""Lake Pend Oreille: the light that Tyler measured in 1957 beside the light that is computed.

J. E. Tyler 1958, Radiance distribution as a function of depth in the submarine environment, SIO Reference 58-25: a
deep, clear lake at 480 nm under a clear sky.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray
from optics.kernels.tables import read_table
from optics.water.inherent_optics import InherentOptics
from optics.water.pure_water import pure_scattering
from optics.water.radiative_transfer.column import (
    WINDOW_STREAMS,
    Column,
    multiple_radiance,
    once_radiance,
    sky_radiance,
    solve_columns,
)
from optics.water.radiative_transfer.irradiance import irradiances
from optics.water.scattering import petzold_phase
from optics.water.water import water_index

DATA = Path(__file__).parent.parent / "data" / "tyler1958_radiance.csv"

WAVELENGTH_NM = 480.0
ABSORPTION = 0.117
BEAM_ATTENUATION = 0.402
"""1/m, both measured."""

SUN_ZENITH_DEG = 33.4
TEMPERATURE_CELSIUS = 10.0
SKY_SHARE = 0.2
"""Share of the sky in the irradiance on the surface, which was not measured: that of a clear sky at 480 nm with the sun
so high; the sky is taken as evenly bright."""

HORIZONTAL = 1e-6


@dataclass(frozen=True, kw_only=True)
class ComparedRadiance:
    """Measured and computed radiance by depth, tilt from the zenith and azimuth from the sun.

    Attributes
    ----------
    depth_m, tilt_deg, azimuth_deg : arrays, shapes (z,), (t,), (p,)
    measured, computed : arrays, shape (z, t, p)
        In relative units: `computed` is scaled once, to the median of the trusted ones.
    suspect : array of bool, shape (z, t, p)
        What the report does not trust: near the sun.
    """

    depth_m: FloatArray
    tilt_deg: FloatArray
    azimuth_deg: FloatArray
    measured: FloatArray
    computed: FloatArray
    suspect: NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True)
class ComparedLayers:
    """Measured and computed properties of the light by depth; pairs of arrays of shape (z,), measured first.

    Measured ones are integrals over the tabulated directions, which blur the sun: see
    `docs/explanation/radiative_transfer.md`.

    Attributes
    ----------
    irradiance_ratio : pair
        Upwelling over downwelling irradiance.
    mean_cosine_down, mean_cosine_up : pairs
    diffuse_attenuation : pair
        Of the downwelling irradiance between a depth and the next, 1/m; one fewer.
    """

    depth_m: FloatArray
    irradiance_ratio: tuple[FloatArray, FloatArray]
    mean_cosine_down: tuple[FloatArray, FloatArray]
    mean_cosine_up: tuple[FloatArray, FloatArray]
    diffuse_attenuation: tuple[FloatArray, FloatArray]


def compared_radiance() -> ComparedRadiance:
    """Radiance that was measured and radiance that is computed, direction by direction."""
    table = read_table(DATA)
    depth, tilt, azimuth = (np.unique(table[name]) for name in ("depth_m", "tilt_deg", "azimuth_deg"))
    at = (
        np.searchsorted(depth, table["depth_m"]),
        np.searchsorted(tilt, table["tilt_deg"]),
        np.searchsorted(azimuth, table["azimuth_deg"]),
    )
    measured, suspect = np.empty((depth.size, tilt.size, azimuth.size)), np.zeros((depth.size, tilt.size, azimuth.size))
    measured[at], suspect[at] = table["radiance"], table["suspect"]
    computed = _radiance(_lake(), depth, np.cos(np.radians(tilt)), np.radians(azimuth))
    scale = np.median((measured / computed)[suspect == 0])
    return ComparedRadiance(
        depth_m=depth,
        tilt_deg=tilt,
        azimuth_deg=azimuth,
        measured=measured,
        computed=computed * scale,
        suspect=suspect > 0,
    )


def compared_layers() -> ComparedLayers:
    """Irradiance ratio, mean cosines and attenuation that were measured, and those that are computed."""
    radiance = compared_radiance()
    down, up, scalar_down, scalar_up = _integrals(radiance)
    lake = _lake()
    layers = irradiances(lake.modes, lake.scaled.attenuation * radiance.depth_m)
    return ComparedLayers(
        depth_m=radiance.depth_m,
        irradiance_ratio=(up / down, layers.upwelling / layers.downwelling),
        mean_cosine_down=(down / scalar_down, layers.downwelling / layers.scalar_down),
        mean_cosine_up=(up / scalar_up, layers.upwelling / layers.scalar_up),
        diffuse_attenuation=(_decay(down, radiance.depth_m), _decay(layers.downwelling, radiance.depth_m)),
    )


def _lake() -> Column:
    """The lake's water, solved."""
    scattering = BEAM_ATTENUATION - ABSORPTION
    wavelength = np.array([WAVELENGTH_NM])
    optics = InherentOptics(
        wavelength_nm=wavelength,
        absorption=np.array([ABSORPTION]),
        scattering=np.array([scattering]),
        molecular_fraction=pure_scattering(wavelength, 0.0, TEMPERATURE_CELSIUS) / scattering,
        phase=petzold_phase(),
        n_water=water_index(wavelength, 0.0, TEMPERATURE_CELSIUS),
    )
    return solve_columns(
        optics,
        sun_cosine_air=float(np.cos(np.radians(SUN_ZENITH_DEG))),
        sun_irradiance=np.ones(1),
        sky_radiance=_sky(np.zeros(WINDOW_STREAMS))[None],
    )[0]


def _sky(cosine: FloatArray) -> FloatArray:
    """Radiance of an even sky beside a sun of irradiance 1."""
    even = SKY_SHARE / (1 - SKY_SHARE) * np.cos(np.radians(SUN_ZENITH_DEG)) / np.pi
    return np.full_like(cosine, even)


def _radiance(lake: Column, depth_m: FloatArray, cosine: FloatArray, azimuth_rad: FloatArray) -> FloatArray:
    """Radiance without the sun's disc, shape (z, t, p)."""
    looked = np.where(np.abs(cosine) < HORIZONTAL, HORIZONTAL, cosine)
    scattered = multiple_radiance(lake, depth_m, looked, azimuth_rad) + once_radiance(
        lake, depth_m, looked, azimuth_rad
    )
    return scattered + sky_radiance(lake, _sky, depth_m, looked)[..., None]


def _integrals(radiance: ComparedRadiance) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Irradiance from above and below and scalar irradiance from above and below: trapezoidal rule over the table."""
    tilt = np.radians(radiance.tilt_deg)
    ring = 2 * np.trapezoid(radiance.measured, np.radians(radiance.azimuth_deg), axis=-1) * np.sin(tilt)
    above, below = radiance.tilt_deg <= 90, radiance.tilt_deg >= 90
    cosine = np.abs(np.cos(tilt))
    down, up, scalar_down, scalar_up = (
        np.asarray(np.trapezoid((ring * factor)[:, part], tilt[part], axis=-1))
        for factor in (cosine, np.ones_like(cosine))
        for part in (above, below)
    )
    return down, up, scalar_down, scalar_up


def _decay(irradiance: FloatArray, depth_m: FloatArray) -> FloatArray:
    """Mean decay between neighbouring depths, 1/m."""
    return np.asarray(-np.diff(np.log(irradiance)) / np.diff(depth_m))
