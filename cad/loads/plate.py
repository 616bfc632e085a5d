"""Water against a flat plate: the forces on a mirror that turns, and on one that is carried through the water.

A mirror in its holder is taken for a rectangular plate in free water, its axis in the middle.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

BROADSIDE_COEFFICIENT = 1.98
"""Normal force coefficient of a long plate square to the flow (Hoerner 1965, Fluid-Dynamic Drag, 3-16). A square plate
has 1.17: to take the long plate's for every mirror is on the safe side."""

ATTACHED_LIFT_COEFFICIENT = 0.8
"""Largest lift coefficient of a thin flat plate before the flow leaves it, below ten degrees; nominal, as measured at
the Reynolds numbers of mirrors (10^4 to 10^5)."""

INCIDENCES = 721
"""Steps over a right angle at which the largest moment is looked for."""


def normal_force_coefficient(incidence_rad: ArrayLike) -> NDArray[np.float64]:
    """Normal force over dynamic pressure and area, by the angle between plate and flow.

    Kirchhoff's and Rayleigh's free streamlines, ``2 pi sin a / (4 + pi sin a)``, raised to the measured value
    broadside on for the suction behind the plate; Hoerner 1965, 3-16 writes it ``1 / (0.222 + 0.283 / sin a)``.
    """
    sine = np.sin(np.asarray(incidence_rad, dtype=np.float64))
    return np.asarray(BROADSIDE_COEFFICIENT * (4 + np.pi) * sine / (4 + np.pi * sine))


def centre_of_pressure(incidence_rad: ArrayLike) -> NDArray[np.float64]:
    """How far ahead of the plate's middle the force acts, as a fraction of the chord.

    Rayleigh 1876, Philosophical Magazine 2, 430: ``(3 / 4) cos a / (4 + pi sin a)``; 3/16 at grazing flow. For flow
    that has left the plate: attached flow acts at a quarter.
    """
    incidence = np.asarray(incidence_rad, dtype=np.float64)
    return np.asarray(0.75 * np.cos(incidence) / (4 + np.pi * np.sin(incidence)))


def largest_flow_moment(chord_m: float, span_m: float, speed_m_per_s: float, density_kg_per_m3: float) -> float:
    """Largest moment of a steady flow about an axis along the span in the plate's middle, N m; over all incidences.

    The larger of what separated flow gives (0.149 of dynamic pressure, area and chord, at some 30 degrees) and
    attached flow (the largest lift at a quarter of the chord from the middle: 0.2).
    """
    incidence = np.linspace(0, np.pi / 2, INCIDENCES)
    separated = float(np.max(normal_force_coefficient(incidence) * centre_of_pressure(incidence)))
    largest = max(separated, ATTACHED_LIFT_COEFFICIENT / 4)
    pressure = density_kg_per_m3 / 2 * speed_m_per_s**2
    return pressure * chord_m**2 * span_m * largest


def turning_moment(chord_m: float, span_m: float, rate_rad_per_s: float, density_kg_per_m3: float) -> float:
    """Moment that keeps a plate turning in still water about an axis along the span in its middle, N m.

    Each strip at a distance y from the axis moves square to itself with ``rate y``: with a = chord / 2 the moment is
    the integral of ``C rho / 2 (rate y)^2 y span dy`` over both halves, ``C rho rate^2 span a^4 / 4``.
    """
    half = chord_m / 2
    return BROADSIDE_COEFFICIENT * density_kg_per_m3 * rate_rad_per_s**2 * span_m * half**4 / 4


def added_inertia(chord_m: float, span_m: float, density_kg_per_m3: float) -> float:
    """Moment of inertia of the water that a plate sets in motion about an axis along the span in its middle, kg m^2.

    ``pi rho a^4 / 8`` per length of span, a = chord / 2: Newman 1977, Marine Hydrodynamics, table 4.3.
    """
    return float(np.pi * density_kg_per_m3 * (chord_m / 2) ** 4 / 8 * span_m)


def added_mass(chord_m: float, span_m: float, density_kg_per_m3: float) -> float:
    """Mass of the water that a plate moves when it moves square to itself, kg.

    ``pi rho a^2`` per length of span, a = half the shorter side: Newman 1977, table 4.3; an upper bound for a plate of
    finite length.
    """
    short, long = min(chord_m, span_m), max(chord_m, span_m)
    return float(np.pi * density_kg_per_m3 * (short / 2) ** 2 * long)
