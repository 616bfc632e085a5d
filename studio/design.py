"""The numbers of a design that the studio has sliders and choices for, each a key of the rig file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, get_args

from rigs import Rig
from rigs.gaze import FlatMirror
from rigs.port import PortMaterial

OUTLINES: tuple[str, ...] = get_args(FlatMirror.model_fields["outline"].annotation)
PORT_MATERIALS: tuple[str, ...] = get_args(PortMaterial)


@dataclass(frozen=True)
class Number:
    """A number of a design.

    Attributes
    ----------
    place : str
        Key of the rig file, with ``[0]`` for a number of a list.
    label : str
        With its unit.
    low, high : float
        What the slider reaches, around the value that the rig has at the beginning.
    step : float
    """

    place: str
    label: str
    low: float
    high: float
    step: float


LENGTHS = (
    ("fold_mirror.distance_mm", "d1, pinhole to M1 (mm)"),
    ("gaze_mirror.distance_mm", "d2, M1 to M2 (mm)"),
    ("fold_mirror.width_mm", "M1 width (mm)"),
    ("fold_mirror.height_mm", "M1 height (mm)"),
    ("gaze_mirror.width_mm", "M2 width (mm)"),
    ("gaze_mirror.height_mm", "M2 height (mm)"),
)
CAMERA = (
    ("camera.position_mm[0]", "x, forward (mm)", 60.0, 1.0),
    ("camera.position_mm[1]", "y, left (mm)", 60.0, 1.0),
    ("camera.position_mm[2]", "z, up (mm)", 60.0, 1.0),
    ("camera.yaw_deg", "yaw, left (deg)", 45.0, 0.5),
    ("camera.pitch_deg", "pitch, up (deg)", 45.0, 0.5),
    ("camera.roll_deg", "roll, clockwise (deg)", 45.0, 0.5),
)
JOINTS = (
    ("joints.pan.min_deg", "q1 from (deg)"),
    ("joints.pan.max_deg", "q1 to (deg)"),
    ("joints.tilt.min_deg", "q2 from (deg)"),
    ("joints.tilt.max_deg", "q2 to (deg)"),
)
ANCHORS = tuple(
    (f"mount.{end}_anchor_mm[{axis}]", f"{end} {name} (mm)", 40.0, 1.0)
    for end in ("fold", "base")
    for axis, name in enumerate("xyz")
)
PORTS = {
    "flat": (
        ("port.distance_mm", "pinhole to port (mm)"),
        ("port.thickness_mm", "port's thickness (mm)"),
        ("port.aperture_diameter_mm", "port's aperture (mm)"),
    ),
    "dome": (
        ("port.inner_radius_mm", "dome's inner radius (mm)"),
        ("port.thickness_mm", "port's thickness (mm)"),
        ("port.aperture_diameter_mm", "port's aperture (mm)"),
    ),
    "none": (),
}
CHOICES = (
    ("fold_mirror.outline", "M1 outline", OUTLINES),
    ("gaze_mirror.outline", "M2 outline", OUTLINES),
    ("port.material", "port's material", PORT_MATERIALS),
)
LENGTH_FACTORS = (0.5, 2.0)
JOINT_REACH_DEG = 60.0


def numbers(rig: Rig) -> dict[str, tuple[Number, ...]]:
    """Sliders of a rig by the heading that they stand under."""
    return {
        "Mirrors": tuple(_length(rig, *each) for each in LENGTHS),
        "Camera": tuple(_around(rig, *each) for each in CAMERA),
        "Joint limits": tuple(_around(rig, *each, JOINT_REACH_DEG, 0.5) for each in JOINTS),
        "Port": tuple(_length(rig, *each) for each in PORTS[rig.port.shape]),
        "Anchors": tuple(_around(rig, *each) for each in ANCHORS),
    }


def choices(rig: Rig) -> tuple[tuple[str, str, tuple[str, ...]], ...]:
    """Key, label and values of what a rig can choose."""
    return tuple(each for each in CHOICES if each[0] != "port.material" or rig.port.shape != "none")


def value_at(rig: Rig, place: str) -> Any:
    """Value at a place of a rig."""
    name, _, index = place.removesuffix("]").partition("[")
    value: Any = rig.model_dump(mode="json")
    for key in name.split("."):
        value = value[key]
    return value[int(index)] if index else value


def change_at(rig: Rig, place: str, value: Any) -> dict[str, Any]:
    """Key of the rig file, and its whole value, of a change at a place."""
    name, _, index = place.removesuffix("]").partition("[")
    if not index:
        return {name: value}
    values = list(value_at(rig, name))
    values[int(index)] = value
    return {name: values}


def _length(rig: Rig, place: str, label: str) -> Number:
    value = value_at(rig, place)
    low, high = (round(factor * value, 1) for factor in LENGTH_FACTORS)
    return Number(place, label, low, high, 0.5)


def _around(rig: Rig, place: str, label: str, reach: float, step: float) -> Number:
    value = value_at(rig, place)
    return Number(place, label, value - reach, value + reach, step)
