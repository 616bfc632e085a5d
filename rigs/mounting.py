"""Sections of the rig file about what holds and turns the mirrors: joints, servos, hull and mount."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from rigs.section import NotNegative, Number, Positive, Section, Vector3, Whole
from rigs.servos import SERVO_CATALOGUE, servo_numbers


class Joint(Section):
    """One revolute joint: q in [min_deg, max_deg]; the optical angle is sign * q + offset_deg."""

    min_deg: Annotated[Number, Field(ge=-360, le=360)]
    max_deg: Annotated[Number, Field(ge=-360, le=360)]
    offset_deg: Number = 0.0
    sign: Literal[1, -1] = 1

    @model_validator(mode="after")
    def _limits_are_ordered(self) -> Self:
        if self.min_deg >= self.max_deg:
            raise ValueError(f"expected min_deg < max_deg, got {self.min_deg:g} and {self.max_deg:g}")
        return self


class Joints(Section):
    """q1 (pan) turns the gaze mirror about the folded axis, q2 (tilt) about a horizontal axis on it."""

    pan: Joint
    tilt: Joint


class Servo(Section):
    """A position servo; size is length x width x height with the shaft along the height."""

    name: str
    travel_deg: Positive
    speed_deg_per_s: Positive
    torque_n_m: Positive
    size_mm: tuple[Positive, Positive, Positive]
    shaft_offset_mm: NotNegative
    mass_g: Positive
    deadband_us: NotNegative
    pulse_us: tuple[Positive, Positive]

    @model_validator(mode="after")
    def _pulses_are_ordered(self) -> Self:
        if self.pulse_us[0] >= self.pulse_us[1]:
            raise ValueError(f"expected pulse_us as shortest and longest, got {list(self.pulse_us)}")
        return self


def _look_up_servo(value: Any) -> Any:
    """A servo may be named: its numbers then come from the catalogue."""
    if isinstance(value, str):
        if value not in SERVO_CATALOGUE:
            raise ValueError(f"expected a servo of the catalogue ({', '.join(sorted(SERVO_CATALOGUE))}) or a table")
        return servo_numbers(value)
    return value


ServoChoice = Annotated[Servo, BeforeValidator(_look_up_servo, json_schema_input_type=str | Servo)]


class Servos(Section):
    """The two servos, by catalogue name or with numbers of your own."""

    pan: ServoChoice
    tilt: ServoChoice


class BoxHull(Section):
    """Rounded box around the body's origin, with `flippers_per_side` paddles (AQUA has three on each side)."""

    shape: Literal["box"]
    length_mm: Positive
    width_mm: Positive
    height_mm: Positive
    edge_radius_mm: NotNegative = 20.0
    flippers_per_side: Annotated[Whole, Field(ge=0, le=6)] = 0

    @model_validator(mode="after")
    def _radius_fits(self) -> Self:
        smallest = min(self.length_mm, self.width_mm, self.height_mm)
        if 2 * self.edge_radius_mm >= smallest:
            raise ValueError(
                f"expected edge_radius_mm below half the smallest side ({smallest / 2:g}), got {self.edge_radius_mm:g}"
            )
        return self


class OpenFrameHull(Section):
    """Open-frame ROV around the body's origin: two side panels, a bottom panel, and a tube that holds the camera."""

    shape: Literal["open-frame"]
    length_mm: Positive
    width_mm: Positive
    height_mm: Positive
    panel_thickness_mm: Positive = 12.0
    tube_diameter_mm: Positive = 114.0


class FileHull(Section):
    """The user's own hull: a STEP or STL file, its unit, and where its origin lies in the body frame."""

    shape: Literal["file"]
    file: Path
    unit: Literal["mm", "m", "inch"]
    position_mm: Vector3 = (0.0, 0.0, 0.0)
    yaw_deg: Number = 0.0
    pitch_deg: Number = 0.0
    roll_deg: Number = 0.0


Hull = Annotated[BoxHull | OpenFrameHull | FileHull, Field(discriminator="shape")]


class Mount(Section):
    """How the mount is made and where it is bolted to the hull (points on the hull's surface, body frame)."""

    fold_anchor_mm: Vector3
    base_anchor_mm: Vector3
    wall_mm: Annotated[Number, Field(ge=1.2, le=20)] = 4.0
    clearance_mm: Annotated[Number, Field(ge=0.2, le=10)] = 2.0
    material: Literal["abs", "petg", "pla", "nylon"] = "abs"
    printer_bed_mm: tuple[Positive, Positive, Positive] = (250.0, 210.0, 210.0)
    nozzle_mm: Annotated[Number, Field(ge=0.1, le=2)] = 0.4
