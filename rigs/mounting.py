"""Sections of the rig file about what holds and turns the mirrors: joints, servos, hull and mount."""

from __future__ import annotations

from math import atan, degrees, radians
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, model_validator

from rigs.catalogue import SERVO_CATALOGUE, servo_numbers
from rigs.files import FIXED_UNIT_SUFFIXES, OWN_UNIT_SUFFIXES
from rigs.section import Direction, NotNegative, Number, Positive, Section, Vector3, Whole

Angle = TypeVar("Angle", float, NDArray[np.float64])


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

    @property
    def limits(self) -> tuple[float, float]:
        """Lowest and highest joint value, radians."""
        return radians(self.min_deg), radians(self.max_deg)

    def angle(self, q: Angle) -> Angle:
        """Optical angle of joint values, radians."""
        return self.sign * q + radians(self.offset_deg)

    def value(self, angle: Angle) -> Angle:
        """Joint values of optical angles, radians; the limits are not asked."""
        return self.sign * (angle - radians(self.offset_deg))

    def values(self, count: int) -> NDArray[np.float64]:
        """Joint values in equal steps from limit to limit, radians."""
        return np.radians(np.linspace(self.min_deg, self.max_deg, count))


class StowJoint(Section):
    """The hinge that swings the fold mirror out of the camera's view: 0 is in use, `max_deg` is stowed."""

    max_deg: Annotated[Number, Field(ge=45, le=180)]


class Joints(Section):
    """q1 (pan) turns the gaze mirror about the folded axis, q2 (tilt) about a horizontal axis on it.

    With `stow` the fold mirror is on a hinge and can be swung out of the camera's view.
    """

    pan: Joint
    tilt: Joint
    stow: StowJoint | None = None


MirrorCoating = Literal["bare-aluminium", "protected-aluminium", "enhanced-aluminium"]
"""What is on the front of both mirrors: aluminium as it is, under half a wave of silica, or under two quarter waves."""


class Servo(Section):
    """A position servo; size is length x width x height with the shaft along the height.

    How it moves: `deadband_us` is the change of pulse that it ignores at rest, `pulse_period_ms` the time from pulse to
    pulse, `latency_ms` the time from a pulse to the motor's answer, `backlash_deg` the whole backlash between motor
    and horn, `jitter_us` the largest error of a pulse's width.

    How it is held: `ear_hole_spacing_mm` is from the holes of one ear to those of the other (without it they are in the
    ears' middle), `ear_hole_pitch_mm` from hole to hole of one ear, 0 for one hole; `ear_screw` and `shaft_screw` are
    the threads that go through the ears and into the shaft. `depth_rating_m` is the depth that its maker states.
    """

    name: str
    travel_deg: Positive
    speed_deg_per_s: Positive
    torque_n_m: Positive
    size_mm: tuple[Positive, Positive, Positive]
    shaft_offset_mm: NotNegative
    mass_g: Positive
    deadband_us: NotNegative
    pulse_us: tuple[Positive, Positive]
    ear_hole_spacing_mm: Positive | None = None
    ear_hole_pitch_mm: NotNegative = 0.0
    ear_screw: Literal["M2", "M3"] = "M2"
    shaft_screw: Literal["M2", "M3"] = "M3"
    depth_rating_m: Positive | None = None
    pulse_period_ms: Positive = 20.0
    latency_ms: NotNegative = 5.0
    backlash_deg: NotNegative = 0.5
    jitter_us: NotNegative = 0.2

    @model_validator(mode="after")
    def _pulses_are_ordered(self) -> Self:
        if self.pulse_us[0] >= self.pulse_us[1]:
            raise ValueError(f"expected pulse_us as shortest and longest, got {list(self.pulse_us)}")
        return self

    @model_validator(mode="after")
    def _pulses_fit_their_period(self) -> Self:
        if self.pulse_us[1] >= 1000 * self.pulse_period_ms:
            raise ValueError(
                f"expected a pulse_period_ms longer than the longest pulse of {self.pulse_us[1]:g} us, "
                f"got {self.pulse_period_ms:g} ms"
            )
        return self

    @model_validator(mode="after")
    def _rests_in_spite_of_jitter(self) -> Self:
        # Two pulses of one command may differ by twice the jitter.
        if 2 * self.jitter_us > self.deadband_us:
            raise ValueError(
                f"expected jitter_us of at most half of deadband_us = {self.deadband_us:g}, got {self.jitter_us:g}"
            )
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
    """The servos, by catalogue name or with numbers of your own; a hinge without one is held by a locking screw.

    `when_silent` is what becomes of pan and tilt when a loop that turns them fails, or sends nothing for
    `silent_after_s`: they are held where they are, or parked at q = 0 or the limits next to it.
    """

    pan: ServoChoice
    tilt: ServoChoice
    stow: ServoChoice | None = None
    when_silent: Literal["hold", "park"] = "hold"
    silent_after_s: Annotated[Number, Field(ge=0.05, le=60)] = 0.5


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


class TorpedoHull(Section):
    """Body of revolution about the body's x, its middle at the origin: Myring's nose, a cylinder, Myring's tail.

    `nose_exponent` is Myring's n: 2 makes the nose half an ellipsoid, more makes it blunter. `tail_angle_deg` is the
    half angle of the tail's tip. `fin_span_mm` goes from the axis to a fin's tip; the fins stand on the tail, evenly
    spread, none of them on top.
    """

    shape: Literal["torpedo"]
    length_mm: Positive
    diameter_mm: Positive
    nose_length_mm: Positive
    tail_length_mm: Positive
    nose_exponent: Annotated[Number, Field(ge=1, le=10)] = 2.0
    tail_angle_deg: Annotated[Number, Field(gt=0, lt=80)] = 25.0
    fins: Annotated[Whole, Field(ge=0, le=8)] = 4
    fin_span_mm: Positive
    fin_chord_mm: Positive

    @model_validator(mode="after")
    def _nose_and_tail_fit(self) -> Self:
        if self.nose_length_mm + self.tail_length_mm > self.length_mm:
            raise ValueError(
                f"expected nose_length_mm and tail_length_mm within length_mm = {self.length_mm:g}, "
                f"got {self.nose_length_mm:g} and {self.tail_length_mm:g}"
            )
        steepest = degrees(atan(1.5 * self.diameter_mm / self.tail_length_mm))
        if self.tail_angle_deg > steepest:
            raise ValueError(
                f"expected tail_angle_deg of at most {steepest:.1f}, beyond which a tail of this length is thicker "
                f"than the hull, got {self.tail_angle_deg:g}"
            )
        if self.fins and 2 * self.fin_span_mm <= self.diameter_mm:
            raise ValueError(
                f"expected fin_span_mm above half the diameter ({self.diameter_mm / 2:g}), got {self.fin_span_mm:g}"
            )
        if self.fins and self.fin_chord_mm > self.tail_length_mm:
            raise ValueError(
                f"expected fin_chord_mm of at most tail_length_mm = {self.tail_length_mm:g}, got {self.fin_chord_mm:g}"
            )
        return self


class HullPlane(Section):
    """A plane on the hull that the mount can be bolted to: a point and the outward normal, body frame."""

    point_mm: Vector3
    normal: Direction


Unit = Literal["mm", "cm", "m", "inch"]


KeptBodies = Literal["all", "joined", "largest"]


class FileHull(Section):
    """The user's own hull: a file, what its numbers mean, where its origin lies in the body frame, planes by name.

    `unit` may be left out where the file says it itself (STEP, COLLADA, GLB, glTF, 3MF, URDF, SDF); in COLLADA, GLB,
    glTF and 3MF it overrules what the file says. The file's axes are first the body's; then the file is turned about
    the body's axes in this order: roll (clockwise as seen from behind), pitch (nose up), yaw (to the left). Last, its
    origin is put at `position_mm`.

    `window` says what the file's skin is in the light between the camera's pinhole and the water in front of its port:
    hull as it is drawn; an opening, which is cut out of it; or clear, which light passes and parts do not.

    `keep` says what becomes of a file with several bodies that do not touch, where a solid is needed: all are kept,
    all are joined by bars, or the largest is kept alone.
    """

    shape: Literal["file"]
    file: Path
    unit: Unit | None = None
    position_mm: Vector3 = (0.0, 0.0, 0.0)
    yaw_deg: Number = 0.0
    pitch_deg: Number = 0.0
    roll_deg: Number = 0.0
    window: Literal["as-drawn", "cut", "clear"] = "as-drawn"
    keep: KeptBodies = "all"
    planes: dict[str, HullPlane] = Field(default_factory=dict)

    def __hash__(self) -> int:
        # A dict has none of its own, and results are kept by the rig that they are of.
        return hash((self.file, frozenset(self.planes.items())))

    @model_validator(mode="after")
    def _unit_is_said_once(self) -> Self:
        suffix = self.file.suffix.lower()
        if self.unit is None and suffix not in OWN_UNIT_SUFFIXES:
            expected = ", ".join(f'"{unit}"' for unit in get_args(Unit))
            raise ValueError(f"expected a unit, one of {expected}: a {suffix} file does not say what its numbers mean")
        if self.unit is not None and suffix in FIXED_UNIT_SUFFIXES:
            raise ValueError(f'expected no unit, got "{self.unit}": a {suffix} file says what its numbers mean')
        return self


ParametricHull = BoxHull | OpenFrameHull | TorpedoHull
Hull = Annotated[ParametricHull | FileHull, Field(discriminator="shape")]


class Vehicle(Section):
    """The vehicle that carries the mount, neutrally buoyant and level without it.

    `centre_mm` is its centre of buoyancy in the body frame; the centre of mass lies `righting_arm_mm` below.
    `speed_m_per_s` is the highest speed through the water at which the mirrors must work.
    """

    mass_kg: Positive
    righting_arm_mm: Positive
    centre_mm: Vector3 = (0.0, 0.0, 0.0)
    speed_m_per_s: NotNegative


Attachment = Literal["screws", "clamps", "straps", "pads"]
Colour = Literal["black", "grey", "white", "yellow", "orange", "red", "green", "blue"]


class Mount(Section):
    """How the mount is made and where it is bolted to the hull (points on the hull's surface, body frame).

    An anchor is a point and a normal. With the name of a plane of the hull, the point is dropped onto that plane along
    its normal; with a normal, point and normal count as they are; with neither, the hull's surface at the point gives
    the normal.

    A flange follows the hull's surface. Screws go into the hull; clamps are hose clamps around a cylindrical hull,
    straps are cable ties around any other, and pads are foam tape: these three leave the vehicle as it is.

    `mirror_coating` is the front of both mirrors, as it is bought and rendered. `printer` is what the printer is
    called, for its slicer's profile; bed and nozzle are what counts.
    """

    fold_anchor_mm: Vector3
    fold_plane: str | None = None
    fold_normal: Direction | None = None
    base_anchor_mm: Vector3
    base_plane: str | None = None
    base_normal: Direction | None = None
    fold_attachment: Attachment = "screws"
    base_attachment: Attachment = "screws"
    mirror_fixing: Literal["glue", "screws"] = "glue"
    mirror_coating: MirrorCoating = "protected-aluminium"
    wall_mm: Annotated[Number, Field(ge=1.2, le=20)] = 4.0
    clearance_mm: Annotated[Number, Field(ge=0.2, le=10)] = 2.0
    material: Literal["abs", "petg", "pla", "nylon"] = "abs"
    colour: Colour = "grey"
    printer_bed_mm: tuple[Positive, Positive, Positive] = (250.0, 210.0, 210.0)
    nozzle_mm: Annotated[Number, Field(ge=0.1, le=2)] = 0.4
    printer: Annotated[str, Field(pattern=r"^[^\r\n]{1,60}$")] | None = None

    @model_validator(mode="after")
    def _normal_comes_from_one_place(self) -> Self:
        for end in ("fold", "base"):
            if getattr(self, f"{end}_plane") is not None and getattr(self, f"{end}_normal") is not None:
                raise ValueError(f"expected {end}_plane or {end}_normal, got both")
        return self
