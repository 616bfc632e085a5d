"""The flat sea surface from below, and the light above it.

A path tracer that starts at the eye cannot find the sun through a refracting surface. So the sea surface is replaced by
one that does not bend light, with the sun and the sky above it already bent: what comes through it, and what it
reflects back into the water, is what a refracting surface sends down. Seen from the water the two are the same.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.kernels.backend import Float32, Float64, UInt32, dr, mi
from optics.kernels.refraction import dielectric_transmittance
from scenes.reference.sea import Sea

SKY_ROWS, SKY_COLUMNS = 721, 4
"""Of the map of the sky as water bends it: a row for each quarter of a degree; it is the same all around."""


class SeaSurface(mi.BSDF):  # type: ignore[misc]
    """Lets light through unbent with Fresnel's transmittance of water to air, reflects the rest."""

    def __init__(self, n_water: float):
        super().__init__(mi.Properties())
        both_sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        self.m_components = [mi.BSDFFlags.DeltaReflection | both_sides, mi.BSDFFlags.Null | both_sides]
        self.m_flags = self.m_components[0] | self.m_components[1]
        self._n_water = dr.opaque(Float32, float(n_water))

    def _transmittance(self, si: Any) -> Any:
        return dielectric_transmittance(dr.abs(si.wi.z), self._n_water, 1.0)

    def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any) -> tuple[Any, Any]:
        """One of the two, as probable as it is bright."""
        transmittance = self._transmittance(si)
        passes = sample1 < transmittance
        sample = mi.BSDFSample3f()
        sample.wo = dr.select(passes, -si.wi, mi.Vector3f(-si.wi.x, -si.wi.y, si.wi.z))
        sample.pdf = dr.select(passes, transmittance, 1 - transmittance)
        sample.eta = 1.0
        sample.sampled_component = dr.select(passes, UInt32(1), UInt32(0))
        sample.sampled_type = dr.select(passes, UInt32(+mi.BSDFFlags.Null), UInt32(+mi.BSDFFlags.DeltaReflection))
        return sample, mi.Color3f(1) & active

    def eval(self, ctx: Any, si: Any, wo: Any, active: Any) -> Any:
        """Nothing but the two deltas."""
        return mi.Color3f(0)

    def pdf(self, ctx: Any, si: Any, wo: Any, active: Any) -> Any:
        """Nothing but the two deltas."""
        return mi.Float(0)

    def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any) -> tuple[Any, Any]:
        """Nothing but the two deltas."""
        return mi.Color3f(0), mi.Float(0)

    def eval_null_transmission(self, si: Any, active: Any) -> Any:
        """What of a lamp above is seen straight through."""
        return mi.Color3f(self._transmittance(si)) & active

    def to_string(self) -> str:
        """Name for Mitsuba's printouts."""
        return "SeaSurface"


def lamps(sea: Sea) -> dict[str, Any]:
    """Sun and sky of a sea at three wavelengths, as they must be above a `SeaSurface`."""
    n_water = float(np.mean(sea.n_water))
    passed = float(dielectric_transmittance(Float64(float(sea.towards_sun[2])), n_water, 1.0)[0])
    return {
        "sun": {
            "type": "directional",
            "direction": [-float(component) for component in sea.towards_sun],
            "irradiance": {"type": "rawconstant", "value": [float(value / passed) for value in sea.sun_irradiance]},
        },
        "sky": {
            "type": "envmap",
            "bitmap": mi.Bitmap(_bent_sky(sea, n_water)),
            # Mitsuba's maps have their zenith along y.
            "to_world": mi.ScalarTransform4f().rotate([1, 0, 0], 90),
        },
    }


def _bent_sky(sea: Sea, n_water: float) -> NDArray[np.float32]:
    """Radiance n^2 L of the sky by the direction in the water, without the surface's transmittance.

    Basic radiance L / n^2 is conserved. Outside Snell's window nothing passes; one row more keeps its edge whole.
    """
    angle = np.linspace(0, np.pi, SKY_ROWS)
    sine_air = n_water * np.sin(angle)
    radiance = n_water**2 * sea.sky_radiance(np.sqrt(np.clip(1 - sine_air**2, 0, 1)))
    edge = np.arcsin(1 / n_water) + np.pi / (SKY_ROWS - 1)
    rows = np.where(angle <= edge, radiance, 0).T
    return np.ascontiguousarray(np.repeat(rows[:, np.newaxis], SKY_COLUMNS, axis=1), dtype=np.float32)
