"""Kernels of light: what water scatters into a line of sight, and what a lit surface sends back."""

from __future__ import annotations

from typing import Any

import numpy as np

from optics.backend import Float32, UInt32, dr
from optics.refraction import conductor_reflectance, dielectric_transmittance
from scenes.light import PHASE_TABLE_SIZE, Light
from scenes.materials import albedo_table
from scenes.spectrum import camera_bands
from scenes.tracing import opaque32, vector32

Spectrum = list[Any]
"""One Dr.Jit array for each wavelength of the bands."""


def light_parameters(light: Light, metal: tuple[Any, Any]) -> dict[str, Any]:
    """Numbers of light, water and mirror metal (n, k at the bands' wavelengths) for the kernels."""
    sine_to_irradiance = light.towards_sun[2]
    downwelling = light.sun_irradiance + light.sky_irradiance
    spectra = {
        "c": light.beam_attenuation,
        "K": light.diffuse_attenuation,
        # Scalar irradiance of light along the refracted sun, times b: the source of scattered light at the surface.
        "source": light.scattering * downwelling / sine_to_irradiance,
        "sun": light.sun_irradiance / sine_to_irradiance,
        "sky": light.sky_irradiance,
        "upwelling": light.upwelling_ratio * downwelling,
        "sky_radiance": light.sky_radiance,
        "metal_n": metal[0],
        "metal_k": metal[1],
    }
    return {
        **{name: [opaque32(value) for value in values] for name, values in spectra.items()},
        "n_water": opaque32(light.n_water),
        "towards_sun": vector32(light.towards_sun),
        "phase": Float32(light.phase.astype(np.float32)),
        "albedo": Float32(albedo_table().astype(np.float32).ravel()),
        "weight": [[opaque32(value) for value in row] for row in camera_bands().weight],
    }


def phase(light: dict[str, Any], direction: Any) -> Any:
    """Phase function for sunlight scattered against `direction` (from the eye), interpolated in its table."""
    angle = dr.safe_acos(dr.dot(light["towards_sun"], direction))
    position = angle * ((PHASE_TABLE_SIZE - 1) / np.pi)
    cell = dr.minimum(UInt32(position), PHASE_TABLE_SIZE - 2)
    fraction = position - Float32(cell)
    low, high = dr.gather(Float32, light["phase"], cell), dr.gather(Float32, light["phase"], cell + 1)
    return dr.lerp(low, high, fraction)


def scattered_in(
    light: dict[str, Any], throughput: Spectrum, direction: Any, depth: Any, length: Any
) -> tuple[Spectrum, Spectrum]:
    """Light scattered into a segment of the line of sight, and the throughput behind it.

    `depth` is the eye's (positive down), `length` may be infinite. With ``F(z, w)`` the radiance of open water the
    first is ``throughput * (F(z, w) - exp(-c r) F(z - w_z r, w))``, where both exponentials of depth are one factor.
    """
    scattering_phase = phase(light, direction)
    added, left = [], []
    for t, c, K, source in zip(throughput, light["c"], light["K"], light["source"], strict=True):
        net = c - K * direction.z
        open_water = source * scattering_phase * dr.exp(-K * depth) / net
        added.append(t * open_water * (1 - dr.exp(-net * length)))
        left.append(t * dr.exp(-c * length))
    return added, left


def surface_light(light: dict[str, Any], throughput: Spectrum, direction: Any) -> tuple[Spectrum, Spectrum, Any]:
    """Sky seen through the flat sea surface from below, the throughput of what it reflects, and whether light passes.

    Radiance grows by n^2 on its way into the water (basic radiance is conserved); beyond the critical angle the
    transmittance is zero and the surface is a perfect mirror.
    """
    passed = dielectric_transmittance(dr.abs(direction.z), light["n_water"], 1.0)
    gain = passed * dr.square(light["n_water"])
    sky = [t * gain * radiance for t, radiance in zip(throughput, light["sky_radiance"], strict=True)]
    return sky, [t * (1 - passed) for t in throughput], passed > 0


def mirror_throughput(light: dict[str, Any], throughput: Spectrum, cosine: Any) -> Spectrum:
    """Throughput behind a bare aluminium mirror in water."""
    return [
        t * conductor_reflectance(cosine, n, k, light["n_water"])
        for t, n, k in zip(throughput, light["metal_n"], light["metal_k"], strict=True)
    ]


def lit_surface(
    light: dict[str, Any], throughput: Spectrum, *, normal: Any, depth: Any, material: Any, in_sun: Any
) -> Spectrum:
    """Radiance of a Lambertian surface: sun where it is not shadowed, sky from above, upwelling light from below."""
    count = len(throughput)
    sun_cosine = dr.select(in_sun, dr.maximum(dr.dot(normal, light["towards_sun"]), 0), 0)
    above, below = (1 + normal.z) / 2, (1 - normal.z) / 2
    radiance = []
    for position, t in enumerate(throughput):
        albedo = dr.gather(Float32, light["albedo"], material * count + position)
        irradiance = (
            light["sun"][position] * sun_cosine + light["sky"][position] * above + light["upwelling"][position] * below
        )
        fall = dr.exp(-light["K"][position] * depth)
        radiance.append(t * albedo * irradiance * fall * dr.inv_pi)
    return radiance
