"""Hose clamps of strapped saddles: how many, and how long their bands are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cad.export.drawings.bill_of_materials import bill_of_materials
from cad.export.drawings.hose_clamps import band_length_mm, hose_clamps
from cad.parts.contact import CylinderContact
from cad.parts.flange import base_seat, fold_seat
from rigs import Rig

FORWARD = (1.0, 0.0, 0.0)


def mounted(**changes) -> Rig:
    rig = Rig.load("torpedo")
    return rig.with_gaze(mount=changes)


def taut_mm(seat) -> float:
    """Closed form: how much longer than the hull's rim a band is over one saddle.

    The saddle's floor is an arc of radius R + w; from its ends the band runs straight for sqrt((R + w)^2 - R^2) to
    where it touches the hull, acos(R / (R + w)) further around.
    """
    assert isinstance(seat.contact, CylinderContact)
    radius, floor = seat.contact.radius_mm, seat.contact.radius_mm + seat.wall_mm
    half = np.arcsin(seat.width_mm / 2 / floor)
    free = np.arccos(radius / floor)
    return 2 * floor * half + 2 * np.sqrt(floor**2 - radius**2) - 2 * radius * (half + free)


def test_a_band_is_longer_than_the_hull_by_the_closed_form():
    """Arcs of 721 points are shorter than the circle by (pi / 720)^2 / 6 of their length."""
    fold, base = fold_seat(mounted()), base_seat(mounted(), FORWARD)
    rim = 2 * np.pi * fold.contact.radius_mm
    chords = rim * (np.pi / 720) ** 2 / 3
    assert band_length_mm([fold]) == pytest.approx(rim + taut_mm(fold), abs=chords)
    assert band_length_mm([fold, base]) == pytest.approx(rim + taut_mm(fold) + taut_mm(base), abs=chords)


def test_saddles_at_one_place_share_their_clamps():
    """Two slots each: two clamps for both; four when one saddle is moved by more than a band."""
    (shared,) = hose_clamps(mounted()).items()
    assert shared[1] == 2
    apart = hose_clamps(mounted(fold_anchor_mm=(635.0, 0.0, 115.0)))
    assert sum(apart.values()) == 4
    assert max(apart) < shared[0]


def test_what_is_bolted_needs_none():
    assert not hose_clamps(Rig.load("aqua2"))
    assert not hose_clamps(mounted(fold_attachment="flange", base_attachment="flange"))


def test_clamps_are_on_the_bill(aqua2):
    """aqua2's parts stand in: clamps come from the seats, not from the parts."""
    items = bill_of_materials(replace(aqua2, rig=Rig.load("torpedo")))
    clamps = [item for item in items if "Hose clamp" in item.name]
    assert [(item.kind, item.count) for item in clamps] == [("buy", 2)]
    assert clamps[0].name.startswith("Hose clamp DIN 3017-1 form A, band 12 mm, range around 23")
    assert clamps[0].name.endswith("A4 (W5)")
