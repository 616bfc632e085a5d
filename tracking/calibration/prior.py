"""The prior of a calibration: which parameters it estimates, and how far each may be off beforehand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from optics.perturbation.parameters import PORT
from optics.tolerance.sources import Tolerances, error_sources
from rigs import Rig

IN_PLANE = ("m2_shift_x", "m2_shift_y", "m2_turn_z")
"""They place M2's outline in its own plane, which only its corners show."""

MOUNT = (
    *("pan_offset", "tilt_offset", "gimbal_shift_x", "gimbal_shift_y", "gimbal_shift_z"),
    *("gimbal_turn_x", "gimbal_turn_y", "tilt_axis_shift_x", "tilt_axis_shift_z", "tilt_axis_turn_x"),
    *("m1_shift_z", "m1_turn_x", "m1_turn_y", "m2_shift_z", "m2_turn_x", "m2_turn_y", *IN_PLANE),
)

KNOWN = ("port_radius",)
"""Of the port: a dome's radius is its maker's."""

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


def estimated_parameters(rig: Rig) -> tuple[str, ...]:
    """Parameters of a rig with mirrors that a calibration may estimate, in the order of vectors and matrices."""
    return (*MOUNT, *(name for name in PORT[rig.port.shape] if name not in KNOWN))


def standard_deviations(rig: Rig, tolerances: Tolerances) -> dict[str, float]:
    """Of each parameter's perturbation, 0 for what is known: metres, radians, units of index.

    Sources that act on the same parameter add up in squares; what a servo does again in every pose is left out.
    """
    squares = dict.fromkeys(estimated_parameters(rig), 0.0)
    for source in error_sources(rig, tolerances):
        for name in source.sizes if not source.each_pose else ():
            squares[name] = squares[name] + source.standard_deviation(name) ** 2
    in_plane_m, turn = tolerances.m2_position_mm / 1000, float(np.radians(tolerances.m2_angle_deg))
    in_plane = dict(zip(IN_PLANE, (in_plane_m, in_plane_m, turn), strict=True))
    return {name: float(np.sqrt(square)) for name, square in squares.items()} | in_plane


def draw_perturbations(rig: Rig, tolerances: Tolerances, *, seed: int) -> dict[str, float]:
    """Perturbations of one built rig, from normal distributions; the same seed gives the same rig."""
    rng = np.random.default_rng(seed)
    return {name: float(sigma * rng.standard_normal()) for name, sigma in standard_deviations(rig, tolerances).items()}
