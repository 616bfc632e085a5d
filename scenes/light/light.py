"""Light under the sea surface, as the kernels take it: the radiance field of the water, and numbers made from it.

The radiance of open water F solves the radiative-transfer equation, so the light scattered into a line of sight between
two points is ``F(z0, w) - exp(-c r) F(z1, w)`` without any fitted coefficient. F has two parts. The sun's light
scattered once is closed form; all else comes from a plane-parallel solution (`optics.water.radiative_transfer`).
`docs/explanation/rendering.md` says more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from optics.kernels.arrays import FloatArray, aligned
from optics.kernels.backend import Float32
from optics.kernels.packing import on_device, on_host, pairs_of, rows_of, vectors
from optics.water.inherent_optics import InherentOptics, inherent_optics
from optics.water.mirror_coatings import mirror_reflectance
from optics.water.pure_water import DEPOLARISATION, molecular_phase
from optics.water.radiative_transfer import RadianceField, radiance_field
from optics.water.scattering import PhaseFunction
from rigs import Water
from rigs.mounting import MirrorCoating
from scenes.light.field_table import DEPTH_SCALE_M, DEPTHS, azimuth_from, depths_m, field_table, looked_up, resampled
from scenes.light.forward_cone import forward_cone_table, hidden_shares
from scenes.light.materials import albedo_table, colour_basis
from scenes.light.sky import Daylight, sky_table
from scenes.light.spectrum import Bands, water_bands
from scenes.light.sun import Sun
from scenes.light.uniforms import LightTables, LightUniforms

PHASE_TABLE_SIZE, PHASE_ROW = 721, 2
SPECTRUM_ROW = 16
"""Numbers in a row of a table by wavelength."""
SIDES: dict[str, Callable[[FloatArray], NDArray[np.bool_]]] = {
    "level": lambda cosine: np.abs(cosine) < 0.3,
    "up": lambda cosine: cosine > 0.5,
    "down": lambda cosine: cosine < -0.5,
}
"""Which cosines of the direction looked along count as which side; numbers that differ by side go evenly between."""

FORWARD_RAD = np.radians(0.5)
"""Light scattered by less is not told apart from what was not scattered."""
PHASE_ANGLES_RAD = np.maximum(np.linspace(0, np.pi, PHASE_TABLE_SIZE), FORWARD_RAD)
DEEPEST_M = 120.0
"""Where the tables of light end."""
METAL_DEGREE = 9
"""Of the mirrors' reflectance as a polynomial of the cosine: 0.0012 from the films' at most below 84 degrees."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Light:
    """Light and water at the wavelengths of the bands.

    Attributes
    ----------
    bands : Bands
    daylight : Daylight
        Sun and sky above the surface.
    optics : InherentOptics
        Of the water.
    field : RadianceField
        The light in open water.
    coating : str
        Of the mirrors.
    """

    bands: Bands
    daylight: Daylight
    optics: InherentOptics
    field: RadianceField
    coating: MirrorCoating = "protected-aluminium"

    @cached_property
    def n_water(self) -> float:
        """Index of the water at the middle of the bands; geometry has one for all wavelengths."""
        return float(np.median(self.optics.n_water))

    @cached_property
    def towards_sun(self) -> FloatArray:
        """Unit vector towards the refracted sun, world frame, shape (3,)."""
        return self.daylight.sun.refracted(self.n_water)

    def white_radiance(self, depth_m: float) -> FloatArray:
        """Radiance of a white level Lambertian surface at a depth, per channel: what exposure is set by."""
        down = np.array([np.interp(depth_m, self.field.depth_m, row) for row in self.field.downwelling])
        return np.asarray(self.bands.weight @ down / np.pi)

    def open_water_irradiance(self, depth_m: FloatArray, normals: FloatArray) -> FloatArray:
        """Irradiance of planes in open water by all but the direct sun, by channel, shape (n, 3)."""
        light = on_device(self.uniforms(float(np.median(depth_m))))
        depth = Float32(aligned(depth_m, np.float32))
        normal = vectors(normals)
        azimuth = azimuth_from(light.sun_azimuth, normal)
        found = looked_up(light, field_table(self.ambient_nodes), depth, normal.z, azimuth)
        return on_host(found)

    def ambient_up(self, depth_m: ArrayLike) -> FloatArray:
        """Irradiance in open water of planes that face up, by all but the direct sun, by channel; shape (..., 3)."""
        nodes = depths_m(DEEPEST_M)
        level = np.log(self.ambient_nodes[:, -1, 0]) - np.multiply.outer(nodes, self.table_decay)
        depth = np.asarray(depth_m, dtype=np.float64)
        return np.stack([np.exp(np.interp(depth, nodes, channel)) for channel in level.T], axis=-1)

    def tables(self, *, without_peak: bool = False) -> LightTables:
        """What the kernels look up: the phase function, light by direction and depth, the sky, the materials.

        An eye sees light that was scattered forward. What lights a surface counts it with the direct sun: for that the
        phase function is taken `without_peak`.
        """
        phase = self._phase_table_without_peak if without_peak else self._phase_table
        return LightTables(
            phase=pairs_of(phase[:, np.newaxis], PHASE_ROW),
            field=field_table(self.field_nodes),
            ambient=field_table(self.ambient_nodes),
            sky=sky_table(self.daylight),
            forward_cone=forward_cone_table(self.hidden_shares),
            albedo=rows_of(albedo_table(self.bands), SPECTRUM_ROW),
        )

    def uniforms(self, depth_m: float) -> LightUniforms:
        """Uniforms of the kernels for a robot at a depth, but for what the surface and lamps add."""
        field, optics, bands = self.field, self.optics, self.bands
        sun = self.towards_sun
        tilt = np.hypot(sun[0], sun[1])
        cosine = {side: float(np.mean(field.cosine[SIDES[side](field.cosine)])) for side in SIDES}
        share = {side: self._shares(values, depth_m) for side, values in self._by_side.items()}
        decay = {
            side: np.array([np.interp(depth_m, field.depth_m, row) for row in rows])
            for side, rows in self._decay_by_side.items()
        }
        return LightUniforms(
            n_water=self.n_water,
            reference_depth_m=depth_m,
            steps_per_log=(DEPTHS - 1) / np.log1p(DEEPEST_M / DEPTH_SCALE_M),
            table_decay=self.table_decay,
            refracted_sun=sun,
            sun_azimuth=sun[:2] / tilt if tilt > 0 else np.array([1.0, 0.0]),
            weight=bands.weight.sum(axis=0),
            beam_attenuation=field.beam_attenuation,
            scattering=optics.scattering,
            scattering_without_peak=optics.scattering * (1 - field.forward_fraction),
            channel_attenuation=self.channel_means(depth_m)["attenuation"],
            molecular_fraction=optics.molecular_fraction,
            molecular_anisotropy=(1 - DEPOLARISATION) / (1 + DEPOLARISATION),
            sun_irradiance=field.sun_irradiance,
            sun_attenuation=field.beam_attenuation / field.sun_cosine,
            sun_scattering=optics.scattering * field.sun_irradiance,
            ambient_up=self.ambient_up(depth_m),
            ambient_fall=np.log(self.ambient_up(depth_m - 0.5) / self.ambient_up(depth_m + 0.5)),
            ambient_fraction=self._shares(field.scalar, depth_m),
            field_fraction=share["level"],
            field_fraction_rise=(share["up"] - share["level"]) / cosine["up"],
            field_decay=decay["level"],
            field_decay_rise=(decay["up"] - decay["level"]) / cosine["up"],
            field_decay_fall=(decay["down"] - decay["level"]) / cosine["down"],
            colour_basis=colour_basis(bands.wavelength_nm),
            sky_irradiance=self.daylight.sky_irradiance,
            mirror_fit=self._metal_fit,
        )

    @cached_property
    def field_nodes(self) -> FloatArray:
        """Radiance of open water but for the sun's light scattered once, at the nodes of a table, by channel."""
        return self._nodes(self.field.multiple)

    @cached_property
    def ambient_nodes(self) -> FloatArray:
        """Irradiance by all but the direct sun, by the outward normal, at the nodes of a table, by channel."""
        return self._nodes(self.field.irradiance)

    @cached_property
    def table_decay(self) -> FloatArray:
        """What the tables' values fall off with, by channel, 1/m: they hold what is left to be interpolated."""
        return np.array([self.field.asymptotic_attenuation[row > 0].min() for row in self.bands.weight])

    @cached_property
    def hidden_shares(self) -> FloatArray:
        """Share of the scattered light that comes from a line's end, at the nodes of `scenes.light.forward_cone`."""
        molecular = float(np.median(self.optics.molecular_fraction))
        return hidden_shares(lambda angle: self.phase_without_peak(angle, molecular))

    def channel_means(self, depth_m: float) -> dict[str, FloatArray]:
        """Means over each channel's light at a depth: attenuation, scattering, that by more than the peak, molecules.

        Wavelengths count as there is light of them around.
        """
        around = [np.interp(depth_m, self.field.depth_m, row) for row in self.field.scalar]
        weight = self.bands.weight * around
        weight /= weight.sum(axis=1, keepdims=True)
        values = {
            "attenuation": self.field.beam_attenuation,
            "scattering": self.optics.scattering,
            "scattering_without_peak": self.optics.scattering * (1 - self.field.forward_fraction),
            "molecular": self.optics.molecular_fraction,
        }
        return {name: np.asarray(weight @ each) for name, each in values.items()}

    def phase_without_peak(self, angle_rad: FloatArray, molecular: float) -> FloatArray:
        """Phase function of particles and a share of molecules, 1/sr, without what counts as not scattered."""
        particles = np.interp(angle_rad, PHASE_ANGLES_RAD, self._phase_table_without_peak)
        return np.asarray((1 - molecular) * particles + molecular * molecular_phase(angle_rad))

    def _nodes(self, values: FloatArray) -> FloatArray:
        field = self.field
        axes = field.depth_m, field.cosine, field.azimuth_rad
        decay = field.asymptotic_attenuation
        # Without their exponential fall values are smooth in depth, as `optics.water.radiative_transfer` says.
        level = values * np.exp(np.multiply.outer(decay, field.depth_m))[..., np.newaxis, np.newaxis]
        nodes = resampled(*axes, level, DEEPEST_M)
        left = self.table_decay.repeat(len(decay) // 3) - decay
        nodes = nodes * np.exp(np.multiply.outer(depths_m(DEEPEST_M), left))[:, np.newaxis, np.newaxis]
        return np.asarray(nodes @ self.bands.weight.T)

    @cached_property
    def _by_side(self) -> dict[str, FloatArray]:
        """Mean radiance but for the sun's light scattered once, by wavelength and depth."""
        field = self.field
        return {side: field.multiple[:, :, chosen(field.cosine)].mean(axis=(2, 3)) for side, chosen in SIDES.items()}

    @cached_property
    def _decay_by_side(self) -> dict[str, FloatArray]:
        """How fast it falls off with depth, by channel and depth, 1/m."""
        weight, depth = self.bands.weight, self.field.depth_m
        return {side: -np.gradient(np.log(weight @ values), depth, axis=1) for side, values in self._by_side.items()}

    def _shares(self, values: FloatArray, depth_m: float) -> FloatArray:
        """Values by wavelength over those of their channel, at a depth; shape (w,)."""
        here = np.array([np.interp(depth_m, self.field.depth_m, row) for row in values])
        return np.asarray(here / ((self.bands.weight > 0).T @ (self.bands.weight @ here)))

    @cached_property
    def _metal_fit(self) -> FloatArray:
        cosine = np.linspace(0.05, 1, 400)
        values = mirror_reflectance(self.coating, self.bands.wavelength_nm, cosine, self.n_water)
        return np.asarray(np.polynomial.polynomial.polyfit(cosine, values.T, METAL_DEGREE).T)

    @cached_property
    def _phase_table(self) -> FloatArray:
        """Phase function of particles at even steps; forward, where it grows without bounds, it is held constant."""
        return np.asarray(self.optics.phase(PHASE_ANGLES_RAD))

    @cached_property
    def _phase_table_without_peak(self) -> FloatArray:
        """The same without what counts as not scattered."""
        particles = 1 - self.optics.molecular_fraction
        if not particles.any():
            return self._phase_table
        share = float(np.mean(self.field.forward_fraction / particles))
        return without_forward_peak(self.optics.phase, share, PHASE_ANGLES_RAD)


def underwater_light(
    water: Water,
    daylight: Daylight | None = None,
    bands: Bands | None = None,
    coating: MirrorCoating = "protected-aluminium",
) -> Light:
    """Light below a flat surface in a rig's water, and its mirrors' coating; the radiance field is solved and kept."""
    bands = bands or water_bands()
    daylight = daylight or Daylight(wavelength_nm=bands.wavelength_nm, sun=Sun(), cloud=0.0)
    optics = inherent_optics(water, bands.wavelength_nm)
    field = radiance_field(
        optics,
        sun_cosine_air=daylight.sun.cosine,
        sun_irradiance=daylight.sun_irradiance,
        sky_radiance=daylight.sky_radiance,
        deepest_m=DEEPEST_M,
    )
    return Light(bands=bands, daylight=daylight, optics=optics, field=field, coating=coating)


def without_forward_peak(phase: PhaseFunction, share: float, angle_rad: FloatArray) -> FloatArray:
    """Phase function without a share of its light, cut off flat from the top of its forward peak, 1/sr."""
    ring = np.geomspace(1e-7, np.pi, 20001)
    values = phase(ring)
    weight = 2 * np.pi * np.sin(ring) * np.gradient(ring)

    def missing(log_height: float) -> float:
        return float(weight @ np.maximum(values - np.exp(log_height), 0)) - share

    height = np.exp(brentq(missing, np.log(values.min()), np.log(values.max())))
    return np.asarray(np.minimum(phase(angle_rad), height))
