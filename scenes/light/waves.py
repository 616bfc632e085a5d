"""Waves: the slopes of a wind-blown sea surface, and the sun seen through it from below.

The surface stays the plane z = 0; waves turn its normal. Waves longer than a hand's width are a sum of sinusoids that
travel; the ripples below that are known by their slopes' variance alone, and spread the sun's image into a glitter.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq

from optics.kernels.arrays import FloatArray
from optics.kernels.backend import Array3f32, Float32, dr
from optics.kernels.refraction import dielectric_transmittance, refract
from scenes.light.sky import Daylight
from scenes.light.sun import SUN_RADIUS_RAD

GRAVITY = 9.81

WAVE_COUNT = 24
SHORTEST_WAVE_M = 0.1
"""Shortest wave that is followed; of what is shorter only the slopes' variance is known."""

SLICK_WAVE_M = 0.3
"""Shortest wave on Cox and Munk's slicks ("about a foot")."""

LARGEST_WAVE_NUMBER = 370.0
"""Where gravity's waves end and capillary waves begin, 1/m (17 mm; Elfouhaily et al. 1997, eq. 24)."""

PEAK_WAVE_NUMBER = 0.877**2
"""Wave number of the spectrum's peak times U^2 / g of a fully grown sea (Pierson & Moskowitz 1964)."""

LIGHTEST_WIND_M_PER_S = 1.0
"""Cox and Munk's winds begin here; the slopes of weaker ones fall to a flat sea in proportion to the wind."""

STRONGEST_WIND_M_PER_S = 15.0
"""Cox and Munk's winds end at 14 m/s."""

SINE_OF_TURNS = (6.28316337, -41.3370745, 81.3388662, -70.9774613)
"""Odd polynomial of degree 7 for ``sin(2 pi t)``, |t| <= 1/4, whose largest error is least: 6e-7."""


@dataclass(frozen=True, kw_only=True)
class Wind:
    """Wind 12.5 m above the sea; azimuth of where it blows to, from the world's east towards north."""

    speed_m_per_s: float = 4.0
    azimuth_deg: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.speed_m_per_s <= STRONGEST_WIND_M_PER_S:
            raise ValueError(f"expected speed_m_per_s from 0 to {STRONGEST_WIND_M_PER_S:g}, got {self.speed_m_per_s}")
        if not np.isfinite(self.azimuth_deg):
            raise ValueError(f"expected a finite azimuth_deg, got {self.azimuth_deg}")

    @property
    def axes(self) -> FloatArray:
        """Horizontal unit vectors along and across the wind, rows of shape (2, 2)."""
        cosine, sine = np.cos(np.radians(self.azimuth_deg)), np.sin(np.radians(self.azimuth_deg))
        return np.array([[cosine, sine], [-sine, cosine]])


@dataclass(frozen=True, kw_only=True)
class Waves:
    """A sea surface as a sum of sinusoids, and what they leave out.

    Attributes
    ----------
    wave_number : array, shape (n, 2)
        Horizontal wave vectors, world frame, 1/m.
    slope : array, shape (n,)
        Amplitudes of the slope along each wave.
    phase : array, shape (n,)
        Phases at time zero, radians.
    ripple_variance : array, shape (2, 2)
        Covariance of the unresolved slopes, world frame.
    """

    wave_number: FloatArray
    slope: FloatArray
    phase: FloatArray
    ripple_variance: FloatArray

    @property
    def angular_frequency(self) -> FloatArray:
        """Of waves on deep water, ``omega^2 = g k``, rad/s."""
        return np.asarray(np.sqrt(GRAVITY * np.linalg.norm(self.wave_number, axis=1)))


def slope_variance(wind: Wind) -> FloatArray:
    """Variance of the sea's slopes along and across the wind, shape (2,).

    Cox & Munk 1954, J. Opt. Soc. Am. 44, 838, clean surface: ``0.00316 U`` and ``0.003 + 0.00192 U``; below 1 m/s in
    proportion to the wind, so that no wind is a flat sea.
    """
    measured = max(wind.speed_m_per_s, LIGHTEST_WIND_M_PER_S)
    fraction = min(wind.speed_m_per_s / LIGHTEST_WIND_M_PER_S, 1.0)
    return fraction * np.array([0.00316 * measured, 0.003 + 0.00192 * measured])


def peak_wave_number(wind: Wind) -> float:
    """Wave number of the peak of a fully grown sea, 1/m, where its waves begin (Pierson & Moskowitz 1964)."""
    return float(PEAK_WAVE_NUMBER * GRAVITY / max(wind.speed_m_per_s, LIGHTEST_WIND_M_PER_S) ** 2)


def variance_per_octave(wind: Wind) -> float:
    """Variance of the slopes, along and across the wind together, in each octave of the waves that are followed.

    In the equilibrium range of Phillips (1958) every octave has the same. How much, Cox & Munk's slicks say: oil took
    away the waves shorter than 0.3 m and left ``0.008 + 0.00156 U``. That fit passes the whole of a clean sea in light
    winds; there an even share of the whole, from the peak to the shortest gravity waves, is less and is taken.
    """
    measured, peak = max(wind.speed_m_per_s, LIGHTEST_WIND_M_PER_S), peak_wave_number(wind)
    fraction = min(wind.speed_m_per_s / LIGHTEST_WIND_M_PER_S, 1.0)
    slick = (0.008 + 0.00156 * measured) / np.log2(2 * np.pi / SLICK_WAVE_M / peak)
    even_share = slope_variance(wind).sum() / np.log2(LARGEST_WAVE_NUMBER / peak)
    return float(min(fraction * slick, even_share))


def sea_waves(wind: Wind, seed: int = 0) -> Waves:
    """Draw a sea: the same wind and seed give the same waves.

    Every octave of wave numbers has the same slope variance, so the waves stand at even logarithmic steps, each with
    the same slope. Their directions are drawn within a half plane
    around the wind and then squeezed until the variances along and across it have Cox and Munk's ratio exactly.
    """
    along, across = slope_variance(wind)
    smallest, shortest = peak_wave_number(wind), 2 * np.pi / SHORTEST_WAVE_M
    resolved = variance_per_octave(wind) * np.log2(shortest / smallest)
    ripples = 1 - resolved / (along + across) if along > 0 else 0.0
    rng = np.random.default_rng(seed)
    steps = (np.arange(WAVE_COUNT) + rng.random(WAVE_COUNT)) / WAVE_COUNT
    wave_number = smallest * (shortest / smallest) ** steps
    # Stratified, in an order that does not follow the wave numbers.
    spread = np.pi * ((rng.permutation(WAVE_COUNT) + rng.random(WAVE_COUNT)) / WAVE_COUNT - 0.5)
    angle = _squeezed(spread, across / (along + across)) if along > 0 else spread
    phase = rng.uniform(0, 2 * np.pi, WAVE_COUNT)
    heading = np.column_stack([np.cos(angle), np.sin(angle)]) @ wind.axes
    return Waves(
        wave_number=wave_number[:, np.newaxis] * heading,
        slope=np.full(WAVE_COUNT, np.sqrt(2 * resolved / WAVE_COUNT)),
        phase=phase,
        ripple_variance=ripples * wind.axes.T @ np.diag([along, across]) @ wind.axes,
    )


def _squeezed(angle: FloatArray, across_share: float) -> FloatArray:
    """Angles moved towards or away from the wind until the mean of their squared sines is `across_share`."""

    def moved(factor: float) -> FloatArray:
        return np.asarray(np.arctan2(factor * np.sin(angle), np.cos(angle)))

    return moved(brentq(lambda factor: np.mean(np.sin(moved(factor)) ** 2) - across_share, 1e-6, 1e6, xtol=1e-14))


@dataclass(frozen=True, kw_only=True)
class WaveUniforms:
    """Waves as `surface_normal` takes them: turns per metre and slopes along x and y, each of shape (n, 2)."""

    turns_per_m: Any
    slope: Any

    @classmethod
    def of(cls, waves: Waves) -> WaveUniforms:
        """What of the waves stays as it is."""
        heading = waves.wave_number / np.linalg.norm(waves.wave_number, axis=1, keepdims=True)
        return cls(turns_per_m=waves.wave_number / (2 * np.pi), slope=waves.slope[:, np.newaxis] * heading)


def wave_turns(waves: Waves, time_s: FloatArray) -> FloatArray:
    """Phases of `surface_normal` at times, shape (n,), in turns: shape (n, waves)."""
    # A cosine a quarter of a turn behind is a sine.
    turns = (waves.phase - np.multiply.outer(time_s, waves.angular_frequency)) / (2 * np.pi) - 0.25
    return np.asarray(np.remainder(turns, 1))


def surface_normal(waves: WaveUniforms, phase_turns: list[Any], x: Any, y: Any) -> Any:
    """Kernel: unit normal of the sea surface, pointing up, at points of the plane z = 0; one sine per wave.

    The phases are those of `wave_turns`.
    """
    normal_x, normal_y = Float32(0), Float32(0)
    for (k_x, k_y), (s_x, s_y), turns in zip(waves.turns_per_m, waves.slope, phase_turns, strict=True):
        # The height is the sum of (slope / k) cos(k x - omega t + phase), the normal leans against its gradient.
        sine = cosine_of_turns(dr.fma(k_x, x, dr.fma(k_y, y, turns)))
        normal_x, normal_y = dr.fma(s_x, sine, normal_x), dr.fma(s_y, sine, normal_y)
    return dr.normalize(Array3f32(normal_x, normal_y, 1))


def cosine_of_turns(turns: Any) -> Any:
    """Kernel: ``cos(2 pi turns)`` to 1e-6, in a third of the time of Dr.Jit's cosine.

    The angle is folded to a quarter of a turn about zero, where an odd polynomial of degree 7 is the sine (least
    largest error).
    """
    folded = 0.25 - dr.abs(turns - dr.round(turns))
    square = dr.square(folded)
    first, third, fifth, seventh = SINE_OF_TURNS
    return folded * dr.fma(square, dr.fma(square, dr.fma(square, seventh, fifth), third), first)


@dataclass(frozen=True, kw_only=True)
class Glitter:
    """Ripples as Gaussian slopes: their inverse covariance (xx, twice xy, yy), and the density of slope zero."""

    precision: Any
    peak: Any


@dataclass(frozen=True, kw_only=True)
class SunUniforms:
    """The sun as it is seen through the surface.

    Attributes
    ----------
    direction : shape (3,)
        Towards it, above the surface.
    irradiance : shape (w,)
        Across its beam, above the surface.
    n_water
    glitter : Glitter, optional
        Without ripples (no wind) the sun is a disk, by another kernel.
    """

    direction: Any
    irradiance: Any
    n_water: Any
    glitter: Glitter | None = None

    @classmethod
    def of(cls, daylight: Daylight, waves: Waves, n_water: float) -> SunUniforms:
        """The sun of a day, through waves."""
        return cls(
            direction=daylight.sun.direction,
            irradiance=daylight.sun_irradiance,
            n_water=n_water,
            glitter=_glitter_of(waves, n_water) if waves.ripple_variance.any() else None,
        )


def _glitter_of(waves: Waves, n_water: float) -> Glitter:
    # The disk's own width: facets that see its edge lie r / (n - 1) off, and a disk has the variance r^2 / 4 per axis.
    disk_variance = (SUN_RADIUS_RAD / (2 * (n_water - 1))) ** 2
    precision = np.linalg.inv(waves.ripple_variance + disk_variance * np.eye(2))
    return Glitter(
        precision=np.array([precision[0, 0], 2 * precision[0, 1], precision[1, 1]]),
        peak=np.sqrt(np.linalg.det(precision)) / (2 * np.pi),
    )


def sun_seen(sun: SunUniforms, direction: Any, normal: Any) -> list[Any]:
    """Kernel: radiance of the sun, seen from below through the surface, at each wavelength.

    Parameters
    ----------
    sun : SunUniforms
    direction : unit vectors along which the eye looks, world frame, upwards
    normal : unit normals of the resolved waves, pointing up
    """
    glitter = sun.glitter
    factor = _disk(sun, direction, normal) if glitter is None else _glitter(sun, glitter, direction, normal)
    return [factor * irradiance for irradiance in sun.irradiance]


def _disk(sun: SunUniforms, direction: Any, normal: Any) -> Any:
    """Radiance over irradiance of the sun's disk: ``n^2 T / (solid angle)`` where the refracted view hits it."""
    n = sun.n_water
    outside, passed = refract(direction, normal, n)
    # A distance, not a cosine: in single precision those of such small angles are a few steps from one.
    half_chord2 = dr.squared_norm(outside - Array3f32(*sun.direction)) / 4
    disk = np.sin(SUN_RADIUS_RAD / 2) ** 2
    radiance = dr.square(n) * dielectric_transmittance(dr.dot(outside, normal), 1.0, n) / (4 * np.pi * disk)
    return dr.select(passed & (half_chord2 < disk), radiance, 0)


def _glitter(sun: SunUniforms, glitter: Glitter, direction: Any, normal: Any) -> Any:
    """Radiance over irradiance of the sun through facets of Gaussian slopes; `docs/explanation/light.md` derives it."""
    n, towards_sun = sun.n_water, Array3f32(*sun.direction)
    # Snell: n times the view minus the sun's direction is along the normal of the facet that joins them.
    joined = n * direction - towards_sun
    length = dr.norm(joined)
    facet = joined / length
    cosine_air, cosine_water = dr.dot(facet, towards_sun), dr.dot(facet, direction)
    valid = (facet.z > 0) & (cosine_air > 0) & (cosine_water > 0) & (direction.z > 0)
    slope_x = normal.x / normal.z - facet.x / facet.z
    slope_y = normal.y / normal.z - facet.y / facet.z
    first, mixed, second = glitter.precision
    exponent = first * dr.square(slope_x) + mixed * slope_x * slope_y + second * dr.square(slope_y)
    density = glitter.peak * dr.exp(-exponent / 2)
    transmittance = dielectric_transmittance(cosine_air, 1.0, n)
    # The Jacobian from views to facets is n^2 (w.n) / |n w - s|^2, from facets to slopes 1 / n_z^3.
    radiance = transmittance * density * cosine_air * cosine_water * dr.square(n)
    radiance = radiance / (dr.square(dr.square(facet.z)) * direction.z * dr.square(length))
    return dr.select(valid, radiance, 0)
