"""The sea surface over a scene: waves, the sun through them, and the flicker they throw on what lies below."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray
from scenes.light.flicker import (
    FlickerPattern,
    FlickerUniforms,
    depth_nodes,
    flicker_modes,
    flicker_pattern,
    irradiance_variation,
    sun_variation,
)
from scenes.light.light import Light
from scenes.light.uniforms import LightTables, LightUniforms
from scenes.light.waves import SunUniforms, Waves, WaveUniforms, Wind, sea_waves, wave_turns


@dataclass(frozen=True, kw_only=True)
class SeaState:
    """What moves at the sea surface: the waves' phases in turns (`scenes.light.waves`), and the flicker's clock."""

    wave_turns: Any
    flicker_time_s: Any


@dataclass(frozen=True, kw_only=True, eq=False)
class Sea:
    """Surface above a light; without wind it is flat, and nothing flickers."""

    light: Light
    wind: Wind
    seed: int = 0

    def uniforms(self, depth_m: float) -> LightUniforms:
        """Uniforms of the kernels for a robot at a depth, with the surface."""
        below = self.light.uniforms(depth_m)
        sun = SunUniforms.of(self.light.daylight, self._waves, self.light.n_water)
        if not self._blows:
            return replace(below, sun=sun)
        pattern, _, mix = self._flicker
        return replace(below, sun=sun, waves=WaveUniforms.of(self._waves), flicker=FlickerUniforms.of(pattern, mix))

    def state(self, time_s: FloatArray) -> SeaState | None:
        """What moves, at times, shape (n,); None for a flat sea."""
        return SeaState(wave_turns=wave_turns(self._waves, time_s), flicker_time_s=time_s) if self._blows else None

    def tables(self) -> LightTables:
        """What the kernels look up."""
        below = self.light.tables()
        return replace(below, flicker=self._flicker[1]) if self._blows else below

    @property
    def _blows(self) -> bool:
        return self.wind.speed_m_per_s > 0

    @cached_property
    def _waves(self) -> Waves:
        return sea_waves(self.wind, self.seed)

    @cached_property
    def _flicker(self) -> tuple[FlickerPattern, Any, FloatArray]:
        """Pattern, table and mix of the sun's variation over depth."""
        field = self.light.field
        depth = depth_nodes()
        total = np.array([np.interp(depth, field.depth_m, row) for row in field.downwelling])
        along = np.multiply.outer(field.beam_attenuation / field.sun_cosine, depth)
        sun = (field.sun_irradiance * field.sun_cosine)[:, np.newaxis] * np.exp(-along)
        measured = irradiance_variation(depth, field.wavelength_nm, self.wind)
        table, mix = flicker_modes(sun_variation(measured, total, sun))
        pattern = flicker_pattern(self.wind, self.light.towards_sun, self.light.n_water, self.seed)
        return pattern, table, mix
