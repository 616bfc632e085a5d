"""Water as a Mitsuba medium: three wavelengths, their scattering and a tabulated phase function.

Mitsuba's own `tabphase` has even steps of the cosine and one table for all wavelengths. Here the peak in the forward
direction has bins of its own, and the share of the molecules may differ from wavelength to wavelength.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid

from optics.kernels.arrays import FloatArray, aligned
from optics.kernels.backend import Float32, UInt32, dr, mi
from optics.water.pure_water import molecular_phase
from scenes.reference.sea import Phase, Sea

SMALLEST_SCATTERING_ANGLE = np.radians(0.5)
"""Light that particles scatter by less counts as unscattered: b is smaller by that part. A pixel is as wide."""

BINS = 2**14
"""Bins of equal probability; the 2 % that are scattered backwards still have 300."""

INTEGRATION_STEPS = 400_001


@dataclass(frozen=True, kw_only=True)
class ScatteringTable:
    """Phase function that is constant within bins of equal probability.

    Attributes
    ----------
    edges : array, shape (BINS + 1,)
        1 - cos(angle) at the bins' edges, ascending: unlike the cosine itself it keeps its digits at small angles.
    left_out : float
        Part of the scattered light at angles below the first edge.
    """

    edges: FloatArray
    left_out: float


def scattering_table(phase: Phase, smallest_angle: float) -> ScatteringTable:
    """Table of a phase function from `smallest_angle` (radians, above zero) to pi."""
    angle = np.geomspace(smallest_angle, np.pi, INTEGRATION_STEPS)
    within = cumulative_trapezoid(2 * np.pi * phase(angle) * np.sin(angle), angle, initial=0)
    rise = 2 * np.sin(angle / 2) ** 2
    edges = np.interp(np.linspace(0, within[-1], BINS + 1), within, rise)
    return ScatteringTable(edges=edges, left_out=float(1 - within[-1]))


class WaterPhase(mi.PhaseFunction):  # type: ignore[misc]
    """Particles and molecules mixed by wavelength; both are sampled as they scatter, so that weights stay near 1."""

    def __init__(self, particles: ScatteringTable, molecules: ScatteringTable, molecular_fraction: FloatArray):
        super().__init__(mi.Properties())
        self.m_flags = mi.PhaseFunctionFlags.Anisotropic
        self._particles = _kernel_table(particles)
        self._molecules = _kernel_table(molecules)
        self._fraction = mi.Color3f(*(dr.opaque(Float32, float(value)) for value in molecular_fraction))
        self._sampled_fraction = dr.opaque(Float32, float(np.mean(molecular_fraction)))

    def sample(self, ctx: Any, interaction: Any, sample1: Any, sample2: Any, active: Any) -> tuple[Any, Any, Any]:
        """Direction, its weight for each wavelength, and its density; Mitsuba's directions point away."""
        molecular = sample1 < self._sampled_fraction
        within = dr.select(
            molecular,
            sample1 / self._sampled_fraction,
            (sample1 - self._sampled_fraction) / (1 - self._sampled_fraction),
        )
        cell = dr.minimum(UInt32(sample2.x * BINS), BINS - 1)
        rise = dr.select(
            molecular, _within_bin(self._molecules, cell, within), _within_bin(self._particles, cell, within)
        )
        sine, cosine = dr.safe_sqrt(rise * (2 - rise)), 1 - rise
        turn_sine, turn_cosine = dr.sincos(2 * dr.pi * sample2.y)
        direction = -interaction.to_world(mi.Vector3f(sine * turn_cosine, sine * turn_sine, cosine))
        value, density = self._value(rise)
        return direction, dr.select(density > 0, value / density, 0) & active, density

    def eval_pdf(self, ctx: Any, interaction: Any, direction: Any, active: Any) -> tuple[Any, Any]:
        """Phase function for each wavelength, and the density with which it is sampled."""
        # 1 - cos from the difference of unit vectors: the cosine has no digits left in the forward peak.
        rise = dr.squared_norm(direction + interaction.wi) / 2
        value, density = self._value(rise)
        return value & active, density

    def to_string(self) -> str:
        """Name for Mitsuba's printouts."""
        return "WaterPhase"

    def _value(self, rise: Any) -> tuple[Any, Any]:
        particles, molecules = _density(self._particles, rise), _density(self._molecules, rise)
        value = dr.lerp(mi.Color3f(particles), mi.Color3f(molecules), self._fraction)
        return value, dr.lerp(particles, molecules, self._sampled_fraction)


def water_medium(sea: Sea) -> Any:
    """Homogeneous Mitsuba medium of a sea at three wavelengths."""
    particles = scattering_table(sea.phase, SMALLEST_SCATTERING_ANGLE)
    # Molecules have no peak: at a thousandth of the angle nothing is left out.
    molecules = scattering_table(molecular_phase, SMALLEST_SCATTERING_ANGLE / 1000)
    by_molecules = sea.scattering * sea.molecular_fraction
    scattering = by_molecules + (sea.scattering - by_molecules) * (1 - particles.left_out)
    attenuation = sea.absorption + scattering
    fraction = np.divide(by_molecules, scattering, out=np.zeros_like(scattering), where=scattering > 0)
    albedo = np.divide(scattering, attenuation, out=np.zeros_like(scattering), where=attenuation > 0)
    return mi.load_dict(
        {
            "type": "homogeneous",
            "sigma_t": _volume(attenuation),
            "albedo": _volume(albedo),
            "phase": WaterPhase(particles, molecules, fraction),
        }
    )


def _volume(values: FloatArray) -> dict[str, Any]:
    return {"type": "constvolume", "value": {"type": "rawconstant", "value": [float(value) for value in values]}}


def _kernel_table(table: ScatteringTable) -> dict[str, Any]:
    density = 1 / (BINS * 2 * np.pi * np.diff(table.edges))
    return {"edges": Float32(aligned(table.edges, np.float32)), "density": Float32(aligned(density, np.float32))}


def _within_bin(table: dict[str, Any], cell: Any, fraction: Any) -> Any:
    low, high = dr.gather(Float32, table["edges"], cell), dr.gather(Float32, table["edges"], cell + 1)
    return dr.lerp(low, high, fraction)


def _density(table: dict[str, Any], rise: Any) -> Any:
    edges = table["edges"]
    above = dr.binary_search(0, BINS + 1, lambda position: dr.gather(Float32, edges, position) <= rise)
    cell = dr.minimum(dr.maximum(above, 1) - 1, BINS - 1)
    known = rise >= dr.gather(Float32, edges, UInt32(0))
    return dr.select(known, dr.gather(Float32, table["density"], cell), 0)
