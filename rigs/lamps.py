"""The rig file's `[[lamps]]`: lights that the vehicle carries."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from rigs.section import Direction, Number, Positive, Section, Vector3

LED_COLOUR_TEMPERATURES = (4500.0, 9000.0)
PLANCK_COLOUR_TEMPERATURES = (1500.0, 15000.0)
"""Kelvin: what a blue LED under a yellow phosphor can be mixed to, and what a glowing body is taken for."""


class Lamp(Section):
    """A lamp fixed to the body: a beam about an axis, given as it is in the water.

    `angle_deg` is the full angle between the directions of half the intensity. How bright it is, is said by
    `luminous_flux_lm` or by `radiant_flux_w` (350 to 750 nm), one of them.
    """

    position_mm: Vector3
    direction: Direction = (1.0, 0.0, 0.0)
    angle_deg: Annotated[Number, Field(ge=5, le=170)]
    luminous_flux_lm: Positive | None = None
    radiant_flux_w: Positive | None = None
    spectrum: Literal["led", "planck"] = "led"
    colour_temperature_k: Positive = 6200.0

    @model_validator(mode="after")
    def _flux_is_said_once(self) -> Self:
        given = [self.luminous_flux_lm, self.radiant_flux_w]
        if given.count(None) != 1:
            raise ValueError(f"expected either luminous_flux_lm or radiant_flux_w, got {given[0]} and {given[1]}")
        return self

    @model_validator(mode="after")
    def _colour_is_in_reach(self) -> Self:
        least, most = LED_COLOUR_TEMPERATURES if self.spectrum == "led" else PLANCK_COLOUR_TEMPERATURES
        if not least <= self.colour_temperature_k <= most:
            raise ValueError(
                f'expected colour_temperature_k from {least:g} to {most:g} with spectrum = "{self.spectrum}", '
                f"got {self.colour_temperature_k:g}"
            )
        return self
