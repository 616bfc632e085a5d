"""What a water absorbs and scatters, and the light that is left at depth."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.water.inherent_optics import InherentOptics, inherent_optics
from optics.water.radiative_transfer import RadianceField, radiance_field
from optics.water.water import (
    ATTENUATION_FILES,
    attenuation_types,
    filled_wavelengths_nm,
    tabulated_diffuse_attenuation,
)
from rigs import JerlovType, Water
from scenes.light.spectrum import sun_irradiance

WAVELENGTHS_NM = np.arange(400.0, 701.0, 25.0)

DEPTHS_M = (1.0, 5.0, 10.0)
"""Where the diffuse attenuation is solved for."""

MEAN_COSINE_DEPTH_M = 5.0
NARROW_DEG = 1.0


@dataclass(frozen=True, kw_only=True)
class ParticleProperties:
    """How the particles in a water scatter."""

    phase_function: str
    mean_cosine: float
    backscattered_fraction: float
    scattered_within_1_deg: float


@dataclass(frozen=True, kw_only=True)
class WaterProperties:
    """Properties of a water, and of the light in it.

    Attributes
    ----------
    water : Water
    sun_elevation_deg : float
        Of the light at depth.
    particles : ParticleProperties
    has_particles : bool
        Whether they scatter anything.
    gaps_nm : tuple of float
        Wavelengths at which the source has no absorption: it is interpolated between the neighbouring types.
    columns : dict
        Values by wavelength: wavelength_nm, coefficients, Kd by each campaign that has it, Kd solved at each of
        `DEPTHS_M`, and mean cosines and irradiance ratio at `MEAN_COSINE_DEPTH_M`.
    """

    water: Water
    sun_elevation_deg: float
    particles: ParticleProperties
    has_particles: bool
    gaps_nm: tuple[float, ...]
    columns: dict[str, list[float]]

    @property
    def note(self) -> str | None:
        """What should be known of the numbers' source."""
        if not self.gaps_nm:
            return None
        listed = ", ".join(f"{gap:g}" for gap in self.gaps_nm)
        return f"a at {listed} nm is interpolated between the neighbouring types: the source misprints it"

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        water = self.water
        return {
            "water": water.label,
            "source": water.source if water.iop_file is None else str(water.iop_file),
            "jerlov_type": water.jerlov_type if is_jerlov_type(water) else None,
            "salinity_ppt": water.salinity_ppt,
            "temperature_celsius": water.temperature_celsius,
            "sun_elevation_deg": self.sun_elevation_deg,
            "particles": asdict(self.particles),
            "note": self.note,
            **self.columns,
        }


def is_jerlov_type(water: Water) -> bool:
    """Whether a water is one of Jerlov's types, not pure and not a file."""
    return water.iop_file is None and water.source != "pure"


def water_properties(water: Water, *, sun_elevation_deg: float) -> WaterProperties:
    """Properties of a water under a flat surface, the standard sun and an evenly bright sky.

    Raises
    ------
    ValueError
        For a sun below the horizon.
    """
    if not 0 < sun_elevation_deg <= 90:
        raise ValueError(f"expected a sun elevation above 0 and at most 90 degrees, got {sun_elevation_deg:g}")
    optics = inherent_optics(water, WAVELENGTHS_NM)
    return WaterProperties(
        water=water,
        sun_elevation_deg=sun_elevation_deg,
        particles=ParticleProperties(
            phase_function=water.phase_function,
            mean_cosine=optics.phase.mean_cosine,
            backscattered_fraction=optics.phase.backscattered_fraction,
            scattered_within_1_deg=float(optics.phase.fraction_within(math.radians(NARROW_DEG))),
        ),
        has_particles=bool((optics.molecular_fraction < 1).any()),
        gaps_nm=() if water.iop_file else tuple(filled_wavelengths_nm(water.jerlov_type, water.source)),
        columns=_coefficients(optics)
        | _tabulated_attenuation(water, optics)
        | _solved_light(_radiance_field(optics, sun_elevation_deg)),
    )


def _coefficients(optics: InherentOptics) -> dict[str, list[float]]:
    c = optics.beam_attenuation
    return {
        "wavelength_nm": optics.wavelength_nm.tolist(),
        "a_per_m": optics.absorption.tolist(),
        "b_per_m": optics.scattering.tolist(),
        "c_per_m": c.tolist(),
        "visibility_scale_m": np.divide(1.0, c, out=np.full_like(c, np.inf), where=c > 0).tolist(),
        "albedo": optics.albedo.tolist(),
        "molecular_fraction": optics.molecular_fraction.tolist(),
        "mean_cosine": optics.mean_cosine.tolist(),
        "backscattered_fraction": optics.backscattered_fraction.tolist(),
        "n_water": optics.n_water.tolist(),
    }


def _tabulated_attenuation(water: Water, optics: InherentOptics) -> dict[str, list[float]]:
    """Kd of the water's type by the campaigns that tabulate it."""
    if water.iop_file is not None:
        return {}
    # Austin & Petzold's type I is pure sea water.
    jerlov_type: JerlovType = "I" if water.source == "pure" else water.jerlov_type
    return {
        f"kd_{source.replace('-', '_')}_per_m": tabulated_diffuse_attenuation(
            jerlov_type, optics.wavelength_nm, source
        ).tolist()
        for source in ATTENUATION_FILES
        if jerlov_type in attenuation_types(source)
    }


def _solved_light(field: RadianceField) -> dict[str, list[float]]:
    """Kd, mean cosines and Eu/Ed of the radiative-transfer solution."""
    columns = {f"kd_{depth:g}_m_per_m": _at_depth(field, field.diffuse_attenuation, depth) for depth in DEPTHS_M}
    for name, values in (
        ("mean_cosine_down", field.mean_cosine_down),
        ("mean_cosine_up", field.mean_cosine_up),
        ("irradiance_ratio", field.upwelling / field.downwelling),
    ):
        columns[name] = _at_depth(field, values, MEAN_COSINE_DEPTH_M)
    return columns


def _radiance_field(optics: InherentOptics, sun_elevation_deg: float) -> RadianceField:
    """Light under the standard sun and an evenly bright sky."""
    sun, sky = sun_irradiance(optics.wavelength_nm)
    return radiance_field(
        optics,
        sun_cosine_air=math.sin(math.radians(sun_elevation_deg)),
        sun_irradiance=sun,
        sky_radiance=lambda cosine: np.repeat(sky[:, np.newaxis] / np.pi, len(cosine), axis=1),
    )


def _at_depth(field: RadianceField, values: FloatArray, depth_m: float) -> list[float]:
    return [float(np.interp(depth_m, field.depth_m, row)) for row in values]
