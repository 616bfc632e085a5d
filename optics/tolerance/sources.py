"""How a rig gets its perturbations when it is built, placed under water and moved: named tolerances and their draws."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from typing import Literal

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.perturbation.parameters import PORT_CENTRE
from optics.water.water import water_index
from rigs import Port, Rig, Servo, Water

Spread = Literal["normal", "uniform"]

TEMPERATURE_STEP_CELSIUS, SALINITY_STEP_PPT = 0.5, 0.5
"""Steps of the difference quotients of the index of water."""

GEOMETRY_WAVELENGTH_NM = 550.0
"""Where `optics.ports.port.port_from_spec` takes its indices."""


@dataclass(frozen=True, kw_only=True)
class Tolerances:
    """Sizes of the perturbations: standard deviations of normal ones, half-widths of uniform ones.

    All defaults are nominal: plausible for a mount printed at home (FDM), a hobby servo and a dive trip, and yours to
    replace by what you measured. Zero takes a tolerance out.

    Attributes
    ----------
    m1_position_mm, m2_position_mm : float
        Reflecting face along its normal (its other directions change nothing). Standard deviation; 0.2 mm is the
        accuracy quoted for FDM printing.
    m1_angle_deg, m2_angle_deg : float
        Turn about each of the mirror's two axes. Standard deviation; 0.2 mm over a seat of 60 mm.
    m1_flatness_rad, m2_flatness_rad : float
        Slope error where the view's centre hits the mirror, rms about each axis. Float glass of some four waves per
        inch (633 nm): 4 x 0.633 um / 25.4 mm.
    gimbal_position_mm : float
        Where the pan axis stands, along each of the gimbal's axes. Standard deviation.
    pan_axis_tilt_deg : float
        Lean of the pan axis about each horizontal axis. Standard deviation.
    tilt_axis_offset_mm : float
        Tilt axis off the pan axis, and off its height. Standard deviation.
    tilt_axis_skew_deg : float
        Tilt axis not square to the pan axis. Standard deviation.
    joint_offset_deg : float
        Optical angle of each joint at its zero: horns go onto splines, trims are read by eye. Standard deviation.
    deadband_us : float, optional
        Change of pulse that a servo ignores; by default that of the rig's servos. Half-width, again in every pose, of
        an angle of ``travel_deg / (longest - shortest pulse)`` per microsecond.
    backlash_deg : float
        Of each gear train. Half-width, again in every pose.
    port_position_mm : float
        Pinhole to port: along the axis for a flat port, along all three axes for a dome. Standard deviation.
    port_thickness_mm : float
        Standard deviation.
    port_tilt_deg : float
        Normal of a flat port about each of the camera's transverse axes; a dome has none. Standard deviation.
    port_index : float
        Index of the port's material (grade, temperature). Standard deviation.
    temperature_celsius, salinity_ppt : float
        The water's, against the rig file's. Standard deviations; they act on its index to first order.
    """

    m1_position_mm: float = 0.2
    m1_angle_deg: float = 0.2
    m1_flatness_rad: float = 1e-4
    m2_position_mm: float = 0.2
    m2_angle_deg: float = 0.2
    m2_flatness_rad: float = 1e-4
    gimbal_position_mm: float = 0.3
    pan_axis_tilt_deg: float = 0.2
    tilt_axis_offset_mm: float = 0.2
    tilt_axis_skew_deg: float = 0.2
    joint_offset_deg: float = 1.0
    deadband_us: float | None = None
    backlash_deg: float = 0.25
    port_position_mm: float = 0.3
    port_thickness_mm: float = 0.2
    port_tilt_deg: float = 0.3
    port_index: float = 0.001
    temperature_celsius: float = 3.0
    salinity_ppt: float = 1.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if value is not None and not (math.isfinite(value) and value >= 0):
                raise ValueError(f"expected {field.name} >= 0, got {value}")


NO_TOLERANCES: dict[str, float] = {field.name: 0.0 for field in fields(Tolerances)}
"""Keyword arguments of the nominal rig: change one of them to look at it alone."""


@dataclass(frozen=True, kw_only=True)
class Source:
    """One tolerance as it acts on the rig.

    Attributes
    ----------
    name : str
        Field of `Tolerances`.
    value : float
        As it was given, in the unit of its name.
    spread : str
        ``normal`` (the size is a standard deviation) or ``uniform`` (a half-width).
    sizes : dict of str to float
        Of each perturbation (`optics.perturbation.parameters`) that it causes; metres, radians, index.
    each_pose : bool
        Whether it is drawn again in every pose, so that no calibration can know it.
    """

    name: str
    value: float
    spread: Spread
    sizes: dict[str, float]
    each_pose: bool

    def standard_deviation(self, parameter: str) -> float:
        """Of one of its perturbations, whatever its spread."""
        return self.sizes[parameter] / (math.sqrt(3) if self.spread == "uniform" else 1)

    def draw(self, rng: np.random.Generator, samples: int, poses: int) -> dict[str, FloatArray]:
        """Perturbations of shape (samples, poses), or (samples, 1) where they are the same in all poses."""
        shape = (samples, poses if self.each_pose else 1)
        return {
            name: size * (rng.uniform(-1, 1, shape) if self.spread == "uniform" else rng.standard_normal(shape))
            for name, size in self.sizes.items()
        }


def error_sources(rig: Rig, tolerances: Tolerances) -> list[Source]:
    """What the tolerances do to a rig; those that are zero or have no meaning for its port are left out."""
    gaze = rig.require_gaze()
    t, mm, deg = tolerances, 1e-3, np.pi / 180
    pan_us, tilt_us = (
        servo.deadband_us if t.deadband_us is None else t.deadband_us for servo in (gaze.servos.pan, gaze.servos.tilt)
    )
    deadband = {
        "pan_offset": pulse_angle(gaze.servos.pan, pan_us),
        "tilt_offset": pulse_angle(gaze.servos.tilt, tilt_us),
    }
    sources = [
        _source(t, "m1_position_mm", mm, "m1_shift_z"),
        _source(t, "m1_angle_deg", deg, "m1_turn_x", "m1_turn_y"),
        _source(t, "m1_flatness_rad", 1, "m1_turn_x", "m1_turn_y"),
        _source(t, "m2_position_mm", mm, "m2_shift_z"),
        _source(t, "m2_angle_deg", deg, "m2_turn_x", "m2_turn_y"),
        _source(t, "m2_flatness_rad", 1, "m2_turn_x", "m2_turn_y"),
        _source(t, "gimbal_position_mm", mm, "gimbal_shift_x", "gimbal_shift_y", "gimbal_shift_z"),
        _source(t, "pan_axis_tilt_deg", deg, "gimbal_turn_x", "gimbal_turn_y"),
        _source(t, "tilt_axis_offset_mm", mm, "tilt_axis_shift_x", "tilt_axis_shift_z"),
        _source(t, "tilt_axis_skew_deg", deg, "tilt_axis_turn_x"),
        _source(t, "joint_offset_deg", deg, "pan_offset", "tilt_offset"),
        Source(name="deadband_us", value=max(pan_us, tilt_us), spread="uniform", sizes=deadband, each_pose=True),
        _source(t, "backlash_deg", deg, "pan_offset", "tilt_offset", spread="uniform", each_pose=True),
        *_port_sources(rig.port, t),
        *(_water_sources(rig.water, t) if rig.port.shape != "none" else ()),
    ]
    return [source for source in sources if any(source.sizes.values())]


def pulse_angle(servo: Servo, pulse_us: float) -> float:
    """Angle that a servo turns for a change of pulse, radians: linear over its travel."""
    shortest, longest = servo.pulse_us
    return math.radians(servo.travel_deg) * pulse_us / (longest - shortest)


def draw_all(
    sources: Iterable[Source], *, seed: int, samples: int, poses: int, repetition: int = 0
) -> dict[str, dict[str, FloatArray]]:
    """Draws of every source, by name.

    Each source has a stream of its own, made from the seed and its name, so that leaving one out changes no other.
    Another `repetition` is the same built rigs moved to their poses again: only what is drawn in each pose differs.
    """
    return {
        source.name: source.draw(
            np.random.default_rng([seed, repetition if source.each_pose else 0, *source.name.encode()]), samples, poses
        )
        for source in sources
    }


def combined(draws: Iterable[Mapping[str, FloatArray]]) -> dict[str, FloatArray]:
    """Sum of the perturbations of several sources, shape (samples, poses) or (samples, 1)."""
    total: dict[str, FloatArray] = {}
    for draw in draws:
        for name, values in draw.items():
            total[name] = total[name] + values if name in total else values
    return total


def _source(
    tolerances: Tolerances,
    name: str,
    unit: float,
    *parameters: str,
    spread: Spread = "normal",
    each_pose: bool = False,
) -> Source:
    value = getattr(tolerances, name)
    sizes = dict.fromkeys(parameters, value * unit)
    return Source(name=name, value=value, spread=spread, sizes=sizes, each_pose=each_pose)


def _port_sources(port: Port, tolerances: Tolerances) -> list[Source]:
    if port.shape == "none":
        return []
    along = ("port_distance",) if port.shape == "flat" else PORT_CENTRE
    sources = [
        _source(tolerances, "port_position_mm", 1e-3, *along),
        _source(tolerances, "port_thickness_mm", 1e-3, "port_thickness"),
        _source(tolerances, "port_index", 1, "n_port"),
    ]
    if port.shape == "flat":
        sources.insert(2, _source(tolerances, "port_tilt_deg", np.pi / 180, "port_tilt_x", "port_tilt_y"))
    return sources


def _water_sources(water: Water, tolerances: Tolerances) -> list[Source]:
    """Temperature and salinity by the derivative of the index there, one-sided at the ends of its formula's range."""
    derivatives = {
        "temperature_celsius": _derivative(
            lambda value: _index(water.salinity_ppt, value), water.temperature_celsius, TEMPERATURE_STEP_CELSIUS, 30
        ),
        "salinity_ppt": _derivative(
            lambda value: _index(value, water.temperature_celsius), water.salinity_ppt, SALINITY_STEP_PPT, 35
        ),
    }
    return [_source(tolerances, name, derivative, "n_water") for name, derivative in derivatives.items()]


def _index(salinity_ppt: float, temperature_celsius: float) -> float:
    return float(water_index(GEOMETRY_WAVELENGTH_NM, salinity_ppt, temperature_celsius))


def _derivative(function: Callable[[float], float], at: float, step: float, largest: float) -> float:
    low, high = max(0.0, at - step), min(largest, at + step)
    return (function(high) - function(low)) / (high - low)
