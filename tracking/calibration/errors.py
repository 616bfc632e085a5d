"""What can be off in a built rig, by name: the unknowns of a calibration, and how far each may be off beforehand.

The names and their exact meaning are those of `optics.tolerance.train.DEVIATIONS`; three more place M2's
outline in its own plane, which only its corners show.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from optics.tolerance.sources import Tolerances, error_sources
from rigs import Rig

M1_ERRORS = ("m1_shift", "m1_x", "m1_y")
M2_ERRORS = ("m2_shift", "m2_x", "m2_y")
M2_IN_PLANE = ("m2_slide_x", "m2_slide_y", "m2_z")
"""Centre of M2's face along its own x and y, and its turn about its normal."""

GIMBAL_ERRORS = (
    *("pan", "tilt", "gimbal_x", "gimbal_y", "gimbal_z", "pan_axis_x", "pan_axis_y"),
    *("tilt_axis_shift_x", "tilt_axis_shift_z", "tilt_axis_skew"),
)

SHARED_BY_PORTS = {"port_thickness": "port_thickness_m", "n_port": "n_port", "n_water": "n_water"}
PORT_ERRORS: dict[str, dict[str, str]] = {
    "flat": {
        "port_z": "port_distance_m",
        "port_tilt_x": "port_tilt_x",
        "port_tilt_y": "port_tilt_y",
        **SHARED_BY_PORTS,
    },
    "dome": {f"port_{axis}": f"port_centre_{axis}_m" for axis in "xyz"} | SHARED_BY_PORTS,
    "none": {},
}
"""Errors of each shape of port, and the parameter of `optics.derivatives` that each of them is."""

INDICES = ("n_port", "n_water")
LENGTHS = (
    *("m1_shift", "m2_shift", "m2_slide_x", "m2_slide_y", "gimbal_x", "gimbal_y", "gimbal_z"),
    *("tilt_axis_shift_x", "tilt_axis_shift_z", "port_x", "port_y", "port_z", "port_thickness"),
)

PRINT_TOLERANCES = Tolerances(
    m1_position_mm=1.0,
    m2_position_mm=1.0,
    m1_angle_deg=1.0,
    m2_angle_deg=1.0,
    gimbal_position_mm=1.0,
    pan_axis_tilt_deg=1.0,
    tilt_axis_offset_mm=1.0,
    tilt_axis_skew_deg=1.0,
    joint_offset_deg=1.0,
    port_position_mm=1.0,
    port_tilt_deg=1.0,
)
"""A print that is off by a degree and a millimetre everywhere (standard deviations); the port's thickness and material
and the water's temperature and salinity as they are known (`Tolerances`)."""

HALF_A_TOOTH_DEG = 7.5
"""Half a tooth of a servo's spline of 24 teeth: how far off a horn may be that nobody trimmed."""

PRIOR_TOLERANCES = replace(PRINT_TOLERANCES, joint_offset_deg=HALF_A_TOOTH_DEG)
"""What a calibration takes for granted before it has seen anything."""


def error_names(rig: Rig) -> tuple[str, ...]:
    """All errors that a rig with mirrors can have, in the order of vectors and matrices."""
    return (*GIMBAL_ERRORS, *M1_ERRORS, *M2_ERRORS, *M2_IN_PLANE, *PORT_ERRORS[rig.port.shape])


def standard_deviations(rig: Rig, tolerances: Tolerances) -> dict[str, float]:
    """How far each error may be off, 0 for what is known: metres, radians, units of index.

    Sources that act on the same error add up in squares; what a servo does anew in every pose is left out.
    """
    squares = dict.fromkeys(error_names(rig), 0.0)
    for source in error_sources(rig, tolerances):
        for name in source.sizes if not source.each_pose else ():
            squares[name] = squares[name] + source.standard_deviation(name) ** 2
    in_plane = {
        "m2_slide_x": tolerances.m2_position_mm / 1000,
        "m2_slide_y": tolerances.m2_position_mm / 1000,
        "m2_z": float(np.radians(tolerances.m2_angle_deg)),
    }
    return {name: float(np.sqrt(square)) for name, square in squares.items()} | in_plane


def draw_errors(rig: Rig, tolerances: Tolerances, *, seed: int) -> dict[str, float]:
    """Errors of one built rig, drawn from normal distributions; the same seed gives the same rig."""
    rng = np.random.default_rng(seed)
    return {name: float(sigma * rng.standard_normal()) for name, sigma in standard_deviations(rig, tolerances).items()}


def unit_of(name: str) -> str:
    """Unit in which an error is shown and written: mm, deg, or none for an index."""
    if name in INDICES:
        return ""
    return "mm" if name in LENGTHS else "deg"


def shown_per_si(name: str) -> float:
    """Factor from metres, radians or index to `unit_of`."""
    return {"": 1.0, "mm": 1000.0, "deg": 180 / np.pi}[unit_of(name)]


def check_errors(rig: Rig, errors: Mapping[str, float]) -> None:
    """Raise a `ValueError` that names every error that the rig cannot have, or that is no finite number."""
    known = error_names(rig)
    unknown = [name for name in errors if name not in known]
    if unknown:
        raise ValueError(f"expected errors among {', '.join(known)}, got {', '.join(unknown)}")
    wrong = [f"{name} = {value!r}" for name, value in errors.items() if not np.isfinite(value)]
    if wrong:
        raise ValueError(f"expected finite errors, got {', '.join(wrong)}")
