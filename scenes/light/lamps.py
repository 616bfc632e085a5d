"""Vehicle lamps: their light on surfaces, and what the water scatters of it into the view.

Points and directions are in the body frame, where lamps stand still. The kernels give single scattering;
`docs/explanation/light.md` says what that leaves out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from optics.kernels.arrays import FloatArray, unit
from optics.kernels.backend import Array3f32, Float32, dr
from optics.kernels.powers import power_of_two
from optics.kernels.tables import read_table
from rigs.lamps import Lamp
from scenes.light.spectrum import DATA

LUMENS_PER_WATT = 683.002
"""Luminous efficacy of the spectral luminous efficiency V (BIPM, SI brochure, 9th edition: K_cd = 683)."""

SECOND_RADIATION_CONSTANT = 1.438776877e-2
"""h c / k, m K (CODATA 2018)."""

VISIBLE_NM = np.arange(350.0, 751.0)
"""Where a lamp's power is counted."""

LED_BLUE_NM = (455.0, 22.0)
LED_PHOSPHOR_NM = (560.0, 125.0)
"""Peak and full width at half maximum of an InGaN chip and of YAG:Ce phosphor: nominal, of common white LEDs."""

NODE_COUNT = 8
"""Gauss nodes along a line of sight; see `lamp_backscatter` for the error."""

BEAM_EDGE = 1e-3
"""Of the intensity on the axis: beyond it backscatter is left out, so that the nodes fall into the beam."""

SMALLEST_DISTANCE_M = 2e-3
"""Nearest that a line of sight may pass a lamp: a lamp's own face is some millimetres across."""


def lamp_spectrum(lamp: Lamp, wavelength_nm: ArrayLike) -> FloatArray:
    """Radiant flux of a lamp per wavelength, W / nm, shape of `wavelength_nm`."""
    wavelength = np.asarray(wavelength_nm, dtype=np.float64)
    shape = _led(lamp.colour_temperature_k) if lamp.spectrum == "led" else _planck(lamp.colour_temperature_k)
    if lamp.radiant_flux_w is not None:
        return np.asarray(shape(wavelength) * (lamp.radiant_flux_w / shape(VISIBLE_NM).sum()))
    assert lamp.luminous_flux_lm is not None  # the rig file has one of the two
    lumens = LUMENS_PER_WATT * (shape(VISIBLE_NM) * _colour_matching()[:, 1]).sum()
    return np.asarray(shape(wavelength) * (lamp.luminous_flux_lm / lumens))


def _led(temperature_k: float) -> Callable[[FloatArray], FloatArray]:
    """White LED: two Gaussians, mixed until their correlated colour temperature is the one asked for."""

    def mixed(blue: float) -> Callable[[FloatArray], FloatArray]:
        return lambda wavelength: blue * _gaussian(wavelength, LED_BLUE_NM) + _gaussian(wavelength, LED_PHOSPHOR_NM)

    # More blue is a higher temperature; McCamy's formula is good below some 12 500 K.
    return mixed(brentq(lambda blue: colour_temperature(mixed(blue)(VISIBLE_NM)) - temperature_k, 0.0, 4.0))


def _gaussian(wavelength_nm: FloatArray, peak_and_width: tuple[float, float]) -> FloatArray:
    peak, width = peak_and_width
    return np.asarray(np.exp(-4 * np.log(2) * ((wavelength_nm - peak) / width) ** 2))


def _planck(temperature_k: float) -> Callable[[FloatArray], FloatArray]:
    def radiated(wavelength_nm: FloatArray) -> FloatArray:
        exponent = SECOND_RADIATION_CONSTANT / (wavelength_nm * 1e-9 * temperature_k)
        return np.asarray((wavelength_nm / 560.0) ** -5 / np.expm1(exponent))

    return radiated


def colour_temperature(spectrum: FloatArray) -> float:
    """Correlated colour temperature, K, of a spectrum at `VISIBLE_NM` (McCamy 1992, Color Res. Appl. 17, 142)."""
    x, y, z = spectrum @ _colour_matching()
    n = (x / (x + y + z) - 0.3320) / (0.1858 - y / (x + y + z))
    return float(449 * n**3 + 3525 * n**2 + 6823.3 * n + 5520.33)


@cache
def _colour_matching() -> FloatArray:
    """Colour-matching functions at `VISIBLE_NM`, shape (n, 3); the second is V."""
    table = read_table(DATA / "cie1931_2deg_cmf_5nm.csv")
    columns = [
        np.interp(VISIBLE_NM, table["wavelength_nm"], table[name], left=0, right=0)
        for name in ("x_bar", "y_bar", "z_bar")
    ]
    return np.column_stack(columns)


def beam_exponent(angle_deg: float) -> float:
    """Exponent m of a beam ``cos^m`` that is down to half at half of `angle_deg` off its axis."""
    return float(-np.log(2) / np.log(np.cos(np.radians(angle_deg) / 2)))


@dataclass(frozen=True, kw_only=True)
class LampUniforms:
    """Lamps as the kernels take them, n of them.

    Attributes
    ----------
    position_m, axis : shape (n, 3)
    exponent, edge : shape (n,)
        Of the beam, ``cos^m``, and the cosine where it ends.
    intensity : shape (n, w)
        On the axis, W / (sr nm).
    """

    position_m: Any
    axis: Any
    exponent: Any
    edge: Any
    intensity: Any

    @classmethod
    def of(cls, lamps: Sequence[Lamp], wavelength_nm: FloatArray) -> LampUniforms:
        """Lamps at some wavelengths."""
        exponent = np.array([beam_exponent(lamp.angle_deg) for lamp in lamps])
        flux = np.array([lamp_spectrum(lamp, wavelength_nm) for lamp in lamps])
        return cls(
            position_m=np.array([lamp.position_mm for lamp in lamps]) / 1000,
            axis=np.array([unit("direction", lamp.direction) for lamp in lamps]),
            exponent=exponent,
            edge=BEAM_EDGE ** (1 / exponent),
            # The beam carries 2 pi I / (m + 1).
            intensity=flux * ((exponent + 1) / (2 * np.pi))[:, np.newaxis],
        )


def towards_lamps(lamps: LampUniforms, point: Any) -> list[tuple[Any, Any]]:
    """Kernel: for each lamp the unit direction to it from points, and its distance: what a shadow ray needs."""
    found = []
    for position in lamps.position_m:
        offset = Array3f32(*position) - point
        distance = dr.maximum(dr.norm(offset), SMALLEST_DISTANCE_M)
        found.append((offset / distance, distance))
    return found


def lamp_irradiance(
    lamps: LampUniforms, point: Any, normal: Any, attenuation: Sequence[Any], lit: Sequence[Any] | None = None
) -> list[Any]:
    """Kernel: irradiance that lamps throw on surfaces, at each wavelength.

    Parameters
    ----------
    lamps : LampUniforms
    point, normal : points and the unit normals of their lit sides, body frame
    attenuation : beam attenuation at each wavelength, 1/m
    lit : for each lamp, whether it reaches the points; all do by default
    """
    total = [Float32(0) for _ in attenuation]
    for lamp, (direction, distance) in enumerate(towards_lamps(lamps, point)):
        along_axis = -dr.dot(direction, Array3f32(*lamps.axis[lamp]))
        factor = _beam(along_axis, lamps.exponent[lamp]) * dr.maximum(dr.dot(direction, normal), 0)
        factor = factor / dr.square(distance)
        if lit is not None:
            factor = dr.select(lit[lamp], factor, 0)
        intensity = lamps.intensity[lamp]
        total = [t + i * factor * dr.exp(-c * distance) for t, i, c in zip(total, intensity, attenuation, strict=True)]
    return total


def lamp_backscatter(
    lamps: LampUniforms,
    origin: Any,
    direction: Any,
    length: Any,
    *,
    attenuation: Sequence[Any],
    volume_scattering: Callable[[Any], list[Any]],
) -> list[Any]:
    """Kernel: lamp light scattered once into a segment of the line of sight, at each wavelength.

    Parameters
    ----------
    lamps : LampUniforms
    origin, direction : where the line of sight begins, and the unit vector along which the eye looks, body frame
    length : of the segment, m; may be infinite
    attenuation : beam attenuation at each wavelength, 1/m
    volume_scattering : function of the scattering angle in radians that gives b p at each wavelength, 1/(m sr)

    Notes
    -----
    Along the segment the integrand ``b p I exp(-c (s + d)) / d^2`` has a peak beside the lamp. Over the angle at
    which the lamp sees the point, d^2 cancels (equiangular sampling, Kulla & Fajardo 2012, Computer Graphics Forum
    31, 1519), and the scattering angle is that angle plus 90 degrees. The rest is smooth: Gauss's rule with eight nodes
    over the part of the segment that lies in the beam is good to 0.5 % of the whole line's light, for beams of 20
    degrees and more and lamps 0.1 to 0.5 m beside the camera.
    """
    total = [Float32(0) for _ in attenuation]
    nodes, weights = np.polynomial.legendre.leggauss(NODE_COUNT)
    every = zip(lamps.position_m, lamps.axis, lamps.exponent, lamps.edge, lamps.intensity, strict=True)
    for position, lamp_axis, exponent, edge, intensity in every:
        axis = Array3f32(*lamp_axis)
        offset = origin - Array3f32(*position)
        before = -dr.dot(offset, direction)
        nearest = offset + direction * before
        height = dr.maximum(dr.norm(nearest), SMALLEST_DISTANCE_M)
        first, last = dr.atan(-before / height), dr.atan((length - before) / height)
        # From the lamp a point at the angle t lies along (across cos t + direction sin t): its cosine to the axis is
        # reach cos(t - middle), and the beam ends where that is the edge's.
        across, along = dr.dot(axis, nearest) / height, dr.dot(axis, direction)
        middle, reach = dr.atan2(along, across), dr.sqrt(dr.square(along) + dr.square(across))
        side = dr.acos(dr.minimum(edge / dr.maximum(reach, 1e-6), 1))
        first = dr.maximum(first, middle - side)
        half = dr.maximum(dr.minimum(last, middle + side) - first, 0) / 2
        sums = [Float32(0) for _ in attenuation]
        for node, weight in zip(nodes, weights, strict=True):
            angle = first + half * (1 + float(node))
            sine, cosine = dr.sincos(angle)
            cosine = dr.maximum(cosine, 1e-6)
            path = (before + height * (sine + 1) / cosine) * -np.log2(np.e)
            beam = float(weight) * _beam(reach * dr.cos(angle - middle), exponent)
            scattered = volume_scattering(angle + np.pi / 2)
            sums = [s + v * beam * _exp2(c * path) for s, v, c in zip(sums, scattered, attenuation, strict=True)]
        total = [t + i * s * (half / height) for t, i, s in zip(total, intensity, sums, strict=True)]
    return total


def _beam(cosine: Any, exponent: Any) -> Any:
    """Intensity over that on the axis."""
    return dr.select(cosine > 0, _exp2(exponent * dr.log2(dr.maximum(cosine, 1e-12))), 0)


def _exp2(exponent: Any) -> Any:
    """``2^x`` for x up to zero; 2^-100 stands for all that is less."""
    return power_of_two(dr.maximum(exponent, -100))
