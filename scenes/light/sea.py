"""The sea surface over a stage: waves, the sun through them, and the flicker they throw on what lies below."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray
from scenes.light.flicker import (
    FlickerPattern,
    depth_nodes,
    flicker_modes,
    flicker_numbers,
    flicker_pattern,
    irradiance_variation,
    sun_variation,
)
from scenes.light.light import Light
from scenes.light.waves import Waves, Wind, sea_waves, sun_numbers, wave_numbers, wave_turns


@dataclass(frozen=True, kw_only=True, eq=False)
class Sea:
    """Surface above a light; without wind it is flat, and nothing flickers."""

    light: Light
    wind: Wind
    seed: int = 0

    def numbers(self) -> dict[str, Any]:
        """Numbers of the kernels that stay as they are."""
        sun = sun_numbers(self.light.daylight, self._waves, self.light.n_water)
        if not self._blows:
            return sun
        pattern, _, mix = self._flicker
        return sun | wave_numbers(self._waves) | flicker_numbers(pattern, mix)

    def moving_numbers(self, time_s: FloatArray) -> dict[str, FloatArray]:
        """Numbers of the kernels at times, shape (n,): arrays of n rows."""
        return {"wave_turns": wave_turns(self._waves, time_s), "flicker_time_s": time_s} if self._blows else {}

    def tables(self) -> dict[str, Any]:
        """What the kernels look up."""
        return {"flicker": self._flicker[1]} if self._blows else {}

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
