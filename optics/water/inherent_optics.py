"""Inherent optical properties of a rig's water: absorption, scattering and phase function by wavelength."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from optics.kernels.arrays import FloatArray
from optics.kernels.tables import read_spectra
from optics.water.pure_water import molecular_moments, molecular_phase, pure_absorption, pure_scattering
from optics.water.scattering import PhaseFunction, fournier_forand_phase, henyey_greenstein_phase, petzold_phase
from optics.water.water import absorption, check_range, molecular_scattering_of_types, scattering, water_index
from rigs import Water
from rigs.water import PETZOLD_MEAN_COSINE


@dataclass(frozen=True, kw_only=True, eq=False)
class InherentOptics:
    """What the water does to light, whatever the light; arrays of shape (w,).

    Attributes
    ----------
    wavelength_nm : array
    absorption, scattering : array
        a and b, 1/m; both include the water itself.
    molecular_fraction : array
        Share of b that molecules scatter, by `molecular_phase`; the rest scatters by `phase`.
    phase : PhaseFunction
        Of the particles, at every wavelength.
    n_water : array
        Index relative to air.
    """

    wavelength_nm: FloatArray
    absorption: FloatArray
    scattering: FloatArray
    molecular_fraction: FloatArray
    phase: PhaseFunction
    n_water: FloatArray

    @property
    def beam_attenuation(self) -> FloatArray:
        """Beam attenuation coefficient c = a + b, 1/m."""
        return self.absorption + self.scattering

    @property
    def albedo(self) -> FloatArray:
        """Single-scattering albedo b / c; zero where the water does nothing."""
        c = self.beam_attenuation
        return np.divide(self.scattering, c, out=np.zeros_like(c), where=c > 0)

    @property
    def mean_cosine(self) -> FloatArray:
        """Mean cosine of the scattering angle, molecules included."""
        return (1 - self.molecular_fraction) * self.phase.mean_cosine

    @property
    def backscattered_fraction(self) -> FloatArray:
        """Share of b that turns light by more than 90 degrees, molecules included."""
        molecules = self.molecular_fraction
        return np.asarray(molecules / 2 + (1 - molecules) * self.phase.backscattered_fraction)

    def phase_function(self, angle_rad: ArrayLike) -> FloatArray:
        """Phase function of particles and molecules together, 1/sr; shape (w, k) for angles of shape (k,)."""
        angle = np.atleast_1d(np.asarray(angle_rad, dtype=np.float64))
        return self._mixed(molecular_phase(angle), self.phase(angle))

    def moments(self, count: int) -> FloatArray:
        """First Legendre moments of `phase_function`, shape (w, count)."""
        return self._mixed(molecular_moments(count), self.phase.moments(count))

    def _mixed(self, molecules: FloatArray, particles: FloatArray) -> FloatArray:
        share = self.molecular_fraction[:, np.newaxis]
        return np.asarray(share * molecules + (1 - share) * particles)


def inherent_optics(water: Water, wavelength_nm: ArrayLike) -> InherentOptics:
    """Inherent optical properties of a rig's water.

    Parameters
    ----------
    wavelength_nm : array, shape (w,)
        400 to 700 nm.

    Raises
    ------
    ValueError
        For wavelengths that the source does not cover, or a file of one's own that cannot be used.
    """
    wavelength = np.atleast_1d(np.asarray(wavelength_nm, dtype=np.float64))
    check_range("wavelength_nm", wavelength, 400, 700)
    a, b, molecules = _coefficients(water, wavelength)
    return InherentOptics(
        wavelength_nm=wavelength,
        absorption=a,
        scattering=b,
        molecular_fraction=np.divide(np.minimum(molecules, b), b, out=np.zeros_like(b), where=b > 0),
        phase=particle_phase(water),
        n_water=water_index(wavelength, water.salinity_ppt, water.temperature_celsius),
    )


def particle_phase(water: Water) -> PhaseFunction:
    """Phase function of the particles in a rig's water."""
    if water.phase_function == "petzold":
        return petzold_phase()
    if water.phase_function == "henyey-greenstein":
        return henyey_greenstein_phase(PETZOLD_MEAN_COSINE if water.mean_cosine is None else water.mean_cosine)
    return fournier_forand_phase(water.backscattered_fraction)


def _coefficients(water: Water, wavelength_nm: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Absorption, scattering, and the molecules' part of the scattering, 1/m."""
    if water.iop_file is None and water.source != "pure":
        return (
            absorption(water.jerlov_type, wavelength_nm, water.source),
            scattering(water.jerlov_type, wavelength_nm, water.source),
            molecular_scattering_of_types(wavelength_nm),
        )
    salt_and_heat = water.salinity_ppt, water.temperature_celsius
    molecules = pure_scattering(wavelength_nm, *salt_and_heat)
    if water.iop_file is None:
        return pure_absorption(wavelength_nm, *salt_and_heat), molecules, molecules
    a, b, own_molecules = _own_coefficients(water.iop_file, wavelength_nm)
    return a, b, molecules if own_molecules is None else own_molecules


def _own_coefficients(path: Path, wavelength_nm: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray | None]:
    """Absorption, scattering and (if the file has it) molecular scattering at wavelengths, 1/m, from a user's CSV.

    Columns ``wavelength_nm, a_per_m, b_per_m`` and optionally ``b_molecular_per_m``; a and b include the water itself.

    Raises
    ------
    ValueError
        With everything that is wrong with the file.
    """
    columns = read_spectra(path, required=("a_per_m", "b_per_m"), optional=("b_molecular_per_m",))
    given = columns["wavelength_nm"]
    if given[0] > wavelength_nm.min() or given[-1] < wavelength_nm.max():
        raise ValueError(
            f"{path}: expected wavelength_nm from {wavelength_nm.min():g} to {wavelength_nm.max():g} at least, "
            f"got {given[0]:g} to {given[-1]:g}"
        )
    if "b_molecular_per_m" in columns and (columns["b_molecular_per_m"] > columns["b_per_m"]).any():
        raise ValueError(f"{path}: expected b_molecular_per_m of at most b_per_m, of which it is a part")
    a, b = (np.interp(wavelength_nm, given, columns[name]) for name in ("a_per_m", "b_per_m"))
    if "b_molecular_per_m" not in columns:
        return a, b, None
    return a, b, np.interp(wavelength_nm, given, columns["b_molecular_per_m"])
