"""Kernels of light: what water, mirrors, the sea surface and lit surfaces do to the radiance along a ray.

Three wavelengths belong to each channel, in order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from optics.kernels.backend import Array3f32, Float32, UInt32, dr
from optics.kernels.packing import between
from optics.kernels.powers import decay
from optics.kernels.refraction import dielectric_transmittance, refract
from scenes.light.field_table import azimuth_from, looked_up, looked_up_in_layer
from scenes.light.forward_cone import gain_of_light, hidden_share
from scenes.light.light import METAL_DEGREE, PHASE_ROW, PHASE_TABLE_SIZE
from scenes.light.sky import sky_seen
from scenes.light.uniforms import LightTables, LightUniforms
from scenes.light.waves import sun_seen

SHORT_M = 0.5
"""Up to this length the light at the far end is that at the near end, falling off as it does at the robot's depth."""

LAYER_M = 0.5
"""So far above or below the robot the light of its own depth's layer counts."""

LONG_M = 300.0
"""Behind this much water nothing is seen: what is there needs no light."""

SMALL_ATTENUATION = 0.2
"""Up to this optical depth a difference of two exponentials is taken from its series (to 1e-7)."""

Spectrum = list[Any]
"""One Dr.Jit array for each wavelength of the bands."""


def channels(light: LightUniforms, spectrum: Spectrum) -> list[Any]:
    """Red, green and blue: sums of each channel's own wavelengths."""
    nodes = len(spectrum) // 3
    weighted = [w * s for w, s in zip(light.weight, spectrum, strict=True)]
    return [sum(weighted[k + 1 : k + nodes], weighted[k]) for k in range(0, len(spectrum), nodes)]


def phase(table: Any, cosine: Any) -> Any:
    """Particles' phase function at the cosine of the scattering angle, interpolated in its table."""
    position = dr.safe_acos(cosine) * ((PHASE_TABLE_SIZE - 1) / np.pi)
    cell = dr.minimum(UInt32(position), PHASE_TABLE_SIZE - 2)
    return between(table, cell, position - Float32(cell), PHASE_ROW)[0]


def molecular_phase(light: LightUniforms, cosine: Any) -> Any:
    """Phase function of water's molecules: 3 / (4 pi (3 + f)) (1 + f cos^2)."""
    f = light.molecular_anisotropy
    return 3 * (1 + f * dr.square(cosine)) / (4 * np.pi * (3 + f))


@dataclass(kw_only=True)
class Segment:
    """Part of a line of sight between two surfaces: Dr.Jit arrays.

    It is not frozen, as Dr.Jit writes into what a branch is given.

    Attributes
    ----------
    direction : Array3f32
        World frame, away from the eye.
    depth, length : Float32
        Depth of the near end, positive down; the length may be infinite.
    active : Bool
        Whether it is looked along at all.
    sunlit : Float32
        Share of it that the sun reaches past the world.
    end_radius : Float32
        Of the surface that it ends at, as a disc across it; zero for the world, which goes on around what is seen.
    leans : Bool
        Whether that surface is the fold mirror, which leans over the path.
    veiling_light : list of Float32
        Light by channel that robot and world add to what open water scatters into it; negative where they occlude.
    """

    direction: Any
    depth: Any
    length: Any
    active: Any
    sunlit: Any
    end_radius: Any
    leans: Any
    veiling_light: list[Any]


def scattered_in(
    light: LightUniforms, tables: LightTables, throughput: Spectrum, segment: Segment
) -> tuple[list[Any], Spectrum]:
    """Light scattered into a segment of the line of sight, by channel, and the throughput behind it.

    With ``F(z, w)`` the radiance of open water the first is ``throughput * (F(z, w) - exp(-c r) F(z - w_z r, w))``.
    F is the sun's light scattered once, in closed form, and all the rest, from its table.
    """
    azimuth = azimuth_from(light.sun_azimuth, segment.direction)
    near = _field_at_near_end(light, tables, segment, azimuth)
    hidden = hidden_share(tables.forward_cone, segment.length, segment.end_radius)

    def long(
        throughput: Spectrum, segment: Segment, azimuth: Any, near: list[Any], hidden: Any
    ) -> tuple[list[Any], Spectrum]:
        length, rise = segment.length, segment.direction.z
        far_depth = segment.depth - rise * length
        far = looked_up(light, tables.field, far_depth, rise, azimuth)
        # Behind much water what is at the far end has no weight; nor has it a depth.
        visible = length < LONG_M
        far = [dr.select(visible, f, 0) for f in far]
        passed, once = [], []
        for c, k in zip(light.beam_attenuation, light.sun_attenuation, strict=True):
            beam = decay(c * length)
            sun_near, sun_far = decay(k * segment.depth), decay(k * far_depth)
            once.append(_sun_on_way(c - k * rise, length, sun_near, beam * sun_far) * segment.sunlit)
            passed.append(beam)
        return _added(light, tables, throughput, segment, hidden, passed=passed, once=once, ends=(near, far))

    def short(
        throughput: Spectrum, segment: Segment, azimuth: Any, near: list[Any], hidden: Any
    ) -> tuple[list[Any], Spectrum]:
        length, rise = segment.length, segment.direction.z
        far = [n * (1 + g * length) for n, g in zip(near, _field_growth(light, rise), strict=True)]
        passed = [_short_exponential(c * length) for c in light.beam_attenuation]
        sun = [decay(k * segment.depth) for k in light.sun_attenuation]
        xs = [c - k * rise for c, k in zip(light.beam_attenuation, light.sun_attenuation, strict=True)]
        once = [s * length * segment.sunlit * _short_mean(x * length) for s, x in zip(sun, xs, strict=True)]
        return _added(light, tables, throughput, segment, hidden, passed=passed, once=once, ends=(near, far))

    away = segment.active & (segment.length > SHORT_M)
    added: tuple[list[Any], Spectrum] = dr.if_stmt((throughput, segment, azimuth, near, hidden), away, long, short)
    return added


def _added(
    light: LightUniforms,
    tables: LightTables,
    throughput: Spectrum,
    segment: Segment,
    hidden: Any,
    *,
    passed: Spectrum,
    once: Spectrum,
    ends: tuple[list[Any], list[Any]],
) -> tuple[list[Any], Spectrum]:
    """Light by channel, and throughput, from what is passed, the sun's path, and the field at both ends.

    The surface at the end sends what is scattered from its own cone as well (`scenes.light.forward_cone`).
    """
    near, far = ends
    cosine = dr.dot(Array3f32(*light.refracted_sun), segment.direction)
    particles, molecules = phase(tables.phase, cosine), molecular_phase(light, cosine)
    nodes = len(throughput) // 3
    rise = dr.maximum(segment.direction.z, 0)
    growth = _field_growth(light, segment.direction.z)
    added, left = [Float32(0)] * 3, []
    for k, t in enumerate(throughput):
        channel = k // nodes
        share = dr.fma(rise, light.field_fraction_rise[k], light.field_fraction[k])
        p = dr.lerp(particles, molecules, light.molecular_fraction[k])
        # Of open water's source (c - g) F, which lets F grow with g along the path, b F is scattered on straight. The
        # fold mirror hides the brighter light from above as well, and what a world adds is about as strong everywhere:
        # of both the whole share is missing.
        straight_on = light.scattering_without_peak[k] / (light.beam_attenuation[k] - growth[channel])
        behind = hidden * dr.select(segment.leans, 1, straight_on)
        more = (1 - behind) * dr.fma(-passed[k], far[channel], near[channel])
        more = share * dr.fma(1 - hidden, segment.veiling_light[channel], more)
        # What robot and world occlude is known between nodes only: it cannot be more than there is.
        new = dr.maximum(dr.fma(light.sun_scattering[k] * p, once[k], more), 0)
        added[channel] = dr.fma(light.weight[k] * t, new, added[channel])
        left.append(t * passed[k] * (1 + gain_of_light(light.scattering_without_peak[k], segment.length, hidden)))
    return added, left


def _field_growth(light: LightUniforms, rise: Any) -> list[Any]:
    """How fast the field at the robot's depth grows along a direction, by channel, 1/m."""
    up, down = dr.maximum(rise, 0), dr.minimum(rise, 0)
    decays = zip(light.field_decay, light.field_decay_rise, light.field_decay_fall, strict=True)
    return [(K + Ku * up + Kd * down) * rise for K, Ku, Kd in decays]


def _field_at_near_end(light: LightUniforms, tables: LightTables, segment: Segment, azimuth: Any) -> list[Any]:
    """Table of all depths where the segment begins far above or below the robot, else the layer of its depth."""

    def elsewhere(depth: Any, cosine: Any, azimuth: Any) -> list[Any]:
        return looked_up(light, tables.field, depth, cosine, azimuth)

    def beside_robot(depth: Any, cosine: Any, azimuth: Any) -> list[Any]:
        return looked_up_in_layer(light, tables.field_layer, depth, cosine, azimuth)

    away = dr.abs(segment.depth - light.reference_depth_m) > LAYER_M
    near: list[Any] = dr.if_stmt(
        (segment.depth, segment.direction.z, azimuth), segment.active & away, elsewhere, beside_robot
    )
    return near


def _short_exponential(y: Any) -> Any:
    """exp(-y) for y up to 1, to 1e-3 there and 1e-8 at 0.1: the first terms of its series."""
    return dr.fma(-y, dr.fma(-y / 2, dr.fma(-y / 3, dr.fma(-y / 4, dr.fma(-y / 5, 1, 1), 1), 1), 1), 1)


def _short_mean(y: Any) -> Any:
    """(1 - exp(-y)) / y for |y| up to 1, to 2e-4 there: the first terms of its series."""
    return dr.fma(-y / 2, dr.fma(-y / 3, dr.fma(-y / 4, dr.fma(-y / 5, 1, 1), 1), 1), 1)


def _sun_on_way(x: Any, length: Any, near: Any, far: Any) -> Any:
    """Integral over a length of ``near exp(-x s)``, which ends at `far`; x may be zero or negative for a finite one."""
    y = x * length
    small = dr.abs(y) < SMALL_ATTENUATION
    return dr.select(small, near * length * _short_mean(y), (near - far) / dr.select(small, 1, x))


def volume_scattering(light: LightUniforms, phase_table: Any, angle: Any) -> Spectrum:
    """B p at a scattering angle, 1/(m sr): particles and molecules."""
    cosine = dr.cos(angle)
    particles, molecules = phase(phase_table, cosine), molecular_phase(light, cosine)
    return [
        b * dr.lerp(particles, molecules, m) for b, m in zip(light.scattering, light.molecular_fraction, strict=True)
    ]


def seen_through_surface(
    light: LightUniforms, sky_table: Any, throughput: Spectrum, direction: Any, normal: Any
) -> tuple[Spectrum, Spectrum, Any]:
    """Sky and sun seen through the sea surface, the throughput of what it reflects, and whether light passes.

    `direction` and `normal` point up. Radiance grows by n^2 on its path into the water (basic radiance is conserved);
    beyond the critical angle the transmittance is zero and the surface a perfect mirror. The sun is seen when there is
    one.
    """
    n = light.n_water
    passed = dielectric_transmittance(dr.dot(direction, normal), n, 1.0)
    outside, _ = refract(direction, normal, n)
    gain = passed * dr.square(n)
    # A facet that leans far may show what is below the horizon: more sea, as bright as the sky there.
    above = [gain * radiance for radiance in sky_seen(light.sky_irradiance, sky_table, outside.z)]
    if light.sun is not None:
        above = [a + s for a, s in zip(above, sun_seen(light.sun, direction, normal), strict=True)]
    seen = [dr.select(passed > 0, t * a, 0) for t, a in zip(throughput, above, strict=True)]
    return seen, [t * (1 - passed) for t in throughput], passed > 0


def mirror_throughput(light: LightUniforms, throughput: Spectrum, cosine: Any) -> Spectrum:
    """Throughput behind a bare aluminium mirror in water: polynomials in the cosine, fitted to Fresnel's formula."""
    result = []
    for t, coefficients in zip(throughput, light.mirror_fit, strict=True):
        value = coefficients[METAL_DEGREE]
        for coefficient in reversed(coefficients[:METAL_DEGREE]):
            value = dr.fma(value, cosine, coefficient)
        result.append(t * value)
    return result


def ambient_irradiance(light: LightUniforms, table: Any, normal: Any, depth: Any) -> list[Any]:
    """Irradiance of a plane in open water by all but the direct sun, by channel; `normal` in the world frame."""
    return looked_up(light, table, depth, normal.z, azimuth_from(light.sun_azimuth, normal))


@dataclass(frozen=True, kw_only=True)
class Illumination:
    """Light on a surface.

    Attributes
    ----------
    ambient : list
        Irradiance by channel of all that comes through the water, but for the direct sun.
    sun_cosine : Float32
        Cosine between normal and sun; zero in the shadow.
    flicker : list
        Factor on the sun by wavelength.
    lamps : list
        Irradiance of lamps by wavelength.
    """

    ambient: list[Any]
    sun_cosine: Any
    flicker: Spectrum
    lamps: Spectrum


def reflected_radiance(
    light: LightUniforms, throughput: Spectrum, *, albedo: Spectrum, depth: Any, illumination: Illumination
) -> list[Any]:
    """Radiance of a Lambertian surface, by channel."""
    nodes = len(throughput) // 3
    result = [Float32(0)] * 3
    for k, (t, a) in enumerate(zip(throughput, albedo, strict=True)):
        sun = (
            light.sun_irradiance[k]
            * decay(light.sun_attenuation[k] * depth)
            * illumination.sun_cosine
            * illumination.flicker[k]
        )
        irradiance = dr.fma(light.ambient_fraction[k], illumination.ambient[k // nodes], sun + illumination.lamps[k])
        result[k // nodes] = dr.fma(light.weight[k] * t * a * dr.inv_pi, irradiance, result[k // nodes])
    return result
