"""Light as the kernels take it: numbers that all rays of a frame share, and the tables that they look up.

The same class holds arrays on the host and Dr.Jit's numbers in a kernel.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from scenes.light.flicker import FlickerUniforms
from scenes.light.lamps import LampUniforms
from scenes.light.waves import SunUniforms, WaveUniforms


@dataclass(frozen=True, kw_only=True)
class LightUniforms:
    """Light and water for a robot at a depth; w wavelengths, 3 channels.

    Attributes
    ----------
    n_water
    reference_depth_m
        Depth of the robot.
    steps_per_log
        Steps of the tables over depth (`scenes.light.field_table`).
    table_decay : shape (3,)
        What the tables' values fall off with, 1/m.
    refracted_sun : shape (3,)
        Unit vector towards the sun in the water, world frame.
    sun_azimuth : shape (2,)
        Its horizontal part, of length one.
    weight : shape (w,)
        Of each wavelength in its channel.
    beam_attenuation, scattering, scattering_without_peak : shape (w,)
        Of the water, 1/m; the last without what counts as not scattered.
    channel_attenuation : shape (3,)
        Mean beam attenuation of a channel's light, 1/m.
    molecular_fraction : shape (w,)
        Share of molecules in the scattering.
    molecular_anisotropy
        Of their phase function.
    sun_irradiance, sun_attenuation, sun_scattering : shape (w,)
        Direct sun below the surface across its beam, its attenuation over depth, 1/m, and the former times scattering.
    ambient_up, ambient_fall : shape (3,)
        Irradiance of planes that face up by all but the direct sun, and its attenuation over depth, 1/m.
    ambient_fraction : shape (w,)
        Part of each wavelength in the light around, over its channel's.
    field_fraction, field_fraction_rise : shape (w,)
        The same of the radiance along level directions, and its change with the cosine to the vertical.
    field_decay, field_decay_rise, field_decay_fall : shape (3,)
        Attenuation of radiance over depth along level directions, and its changes with the cosine upwards and
        downwards, 1/m.
    colour_basis : shape (3, w)
        Spectra of red, green and blue.
    sky_irradiance : shape (w,)
        Of the sky, on a level plane above the surface.
    mirror_fit : shape (w, METAL_DEGREE + 1)
        Reflectance of the mirrors as a polynomial of the cosine.
    sun : SunUniforms, optional
        As it is seen through the surface; not seen without.
    waves, flicker, lamps
        None where there are none.
    """

    n_water: Any
    reference_depth_m: Any
    steps_per_log: Any
    table_decay: Any
    refracted_sun: Any
    sun_azimuth: Any
    weight: Any
    beam_attenuation: Any
    scattering: Any
    scattering_without_peak: Any
    channel_attenuation: Any
    molecular_fraction: Any
    molecular_anisotropy: Any
    sun_irradiance: Any
    sun_attenuation: Any
    sun_scattering: Any
    ambient_up: Any
    ambient_fall: Any
    ambient_fraction: Any
    field_fraction: Any
    field_fraction_rise: Any
    field_decay: Any
    field_decay_rise: Any
    field_decay_fall: Any
    colour_basis: Any
    sky_irradiance: Any
    mirror_fit: Any
    sun: SunUniforms | None = None
    waves: WaveUniforms | None = None
    flicker: FlickerUniforms | None = None
    lamps: LampUniforms | None = None


@dataclass(frozen=True, kw_only=True)
class LightTables:
    """What the kernels look up, as flat Dr.Jit arrays.

    Attributes
    ----------
    phase
        Phase function of the particles.
    field, ambient
        Radiance of open water, and irradiance in it, by depth and direction (`scenes.light.field_table`).
    sky
        Radiance of the sky over the cosine of the zenith angle.
    forward_cone
        Share of the scattered light that comes from what a line ends at (`scenes.light.forward_cone`).
    albedo
        Reflectance of the materials by wavelength.
    flicker : optional
        Modes over depth (`scenes.light.flicker`).
    field_layer, veiling_light : optional
        Of a frame: `field` at the robot's depth, and the veiling light (`scenes.kernels.veiling_light`).
    """

    phase: Any
    field: Any
    ambient: Any
    sky: Any
    forward_cone: Any
    albedo: Any
    flicker: Any = None
    field_layer: Any = None
    veiling_light: Any = None
