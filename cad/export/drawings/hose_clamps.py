"""Hose clamps that strap saddles to a cylindrical hull: how many to buy, and how far around they have to reach."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
from scipy.spatial import ConvexHull

from cad.parts.contact import CylinderContact
from cad.parts.flange import STRAP_PLACES_MM, STRAP_WIDTH_MM, Seat, base_seat, fold_seat
from optics.kernels.arrays import FloatArray
from rigs import Rig
from rigs.catalogue import MATERIALS

BAND_WIDTH_MM = 12.0
BAND_THICKNESS_MM = 0.9
"""Nominal, for the mass; the housing of the screw is left out."""
ARC_POINTS = 721
FORWARD = (1.0, 0.0, 0.0)


def hose_clamps(rig: Rig) -> Counter[int]:
    """Hose clamps by the diameter of a circle as long as their band, millimetres, rounded up; none without saddles.

    Saddles whose slots lie in one plane share a clamp.
    """
    seats = [seat for seat in (fold_seat(rig), base_seat(rig, FORWARD)) if seat.strapped]
    slots = sorted(((slot_mm(seat, place), seat) for seat in seats for place in STRAP_PLACES_MM), key=lambda s: s[0])
    bands: list[tuple[float, list[Seat]]] = []
    for at, seat in slots:
        # A band may run aslant by the play that it has in its slots.
        if bands and at - bands[-1][0] <= STRAP_WIDTH_MM - BAND_WIDTH_MM:
            bands[-1][1].append(seat)
        else:
            bands.append((at, [seat]))
    return Counter(int(np.ceil(band_length_mm(under) / np.pi)) for _, under in bands)


def slot_mm(seat: Seat, place_mm: float) -> float:
    """Where along the hull a slot is: x of the body, millimetres."""
    return float(1000 * seat.body_from_seat.apply([place_mm / 1000, 0.0, 0.0])[0])


def band_length_mm(seats: Sequence[Seat]) -> float:
    """Length of a taut band around the hull and over saddles: the rim of their convex hull, millimetres."""
    outline = [arc for seat in seats for arc in _arcs(seat)]
    # In two dimensions SciPy calls the length of the rim the area.
    return float(ConvexHull(np.vstack(outline)).area)


def clamp_name(diameter_mm: int) -> str:
    """What to order."""
    return f"Hose clamp DIN 3017-1 form A, band {BAND_WIDTH_MM:g} mm, range around {diameter_mm} mm, A4 (W5)"


def clamp_volume_cm3(diameter_mm: int) -> float:
    """Steel of a clamp's band."""
    return float(np.pi * diameter_mm * BAND_WIDTH_MM * BAND_THICKNESS_MM / 1000)


def clamp_mass_g(diameter_mm: int) -> float:
    """Mass of a clamp's band."""
    return clamp_volume_cm3(diameter_mm) * MATERIALS["stainless"].density_kg_per_m3 / 1000


def _arcs(seat: Seat) -> list[FloatArray]:
    """The hull's circle, and the floor of the saddle's slots, across the hull; shape (n, 2), millimetres."""
    assert isinstance(seat.contact, CylinderContact)
    radius, floor = seat.contact.radius_mm, seat.contact.radius_mm + seat.wall_mm
    half = np.arcsin(seat.width_mm / 2 / floor)
    middle = np.arctan2(seat.normal[2], seat.normal[1])
    return [
        length * np.column_stack([np.cos(angles), np.sin(angles)])
        for length, angles in (
            (radius, np.linspace(0, 2 * np.pi, ARC_POINTS)),
            (floor, middle + np.linspace(-half, half, ARC_POINTS)),
        )
    ]
