"""Bands around hull and flanges: how many, how long, how hard they press, in bill of materials, masses and steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import RigidTransform, Rotation

from cad.assembly.assembly import build_assembly
from cad.checks.assembly_checks import assembly_problems
from cad.checks.sequence.steps import assembly_steps
from cad.export.drawings.bill_of_materials import bill_of_materials
from cad.loads.masses import part_bodies
from cad.parts.bands import BAND_WIDTH_MM, Band, bands
from cad.parts.contact import CylinderContact, PlaneContact
from cad.parts.flange import Seat, base_seat, fold_seat
from rigs import Rig

FORWARD = (1.0, 0.0, 0.0)
NO_HULL = trimesh.Trimesh()
"""A cylinder's radius is known to its seats."""


def mounted(**changes) -> Rig:
    return Rig.load("torpedo").with_gaze(mount=changes)


def around_torpedo(*seats: Seat) -> list[Band]:
    return bands(seats, NO_HULL)


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


def on_a_slab(half_width_mm: float, offset_mm: float = 0.0) -> tuple[Band, Seat]:
    """Band around a slab 40 mm thick with a strapped flange on its top, so far beside its middle."""
    seat = Seat(
        body_from_seat=RigidTransform.from_translation([0.0, offset_mm / 1000, 0.02]),
        contact=PlaneContact(),
        attachment="straps",
        wall_mm=5.0,
    )
    slab = trimesh.creation.box((200, 2 * half_width_mm, 40))
    return bands([seat], slab)[0], seat


def test_a_band_is_longer_than_the_hull_by_the_closed_form():
    """Arcs of 721 points are shorter than the circle by (pi / 720)^2 / 6 of their length."""
    fold, base = fold_seat(mounted()), base_seat(mounted(), FORWARD)
    rim = 2 * np.pi * fold.contact.radius_mm
    chords = rim * (np.pi / 720) ** 2 / 3
    assert around_torpedo(fold)[0].length_mm == pytest.approx(rim + taut_mm(fold), abs=chords)
    expected = rim + taut_mm(fold) + taut_mm(base)
    assert around_torpedo(fold, base)[0].length_mm == pytest.approx(expected, abs=chords)


def test_a_band_around_a_slab_has_the_length_of_its_trapezium():
    """Closed form: over a floor of half width b at height h, down to the slab's edges at a, and around three sides."""
    band, seat = on_a_slab(100.0)
    b, h = seat.width_mm / 2, seat.floor_mm
    assert band.length_mm == pytest.approx(2 * b + 2 * np.hypot(100 - b, h) + 2 * 40 + 200, abs=1e-6)


@pytest.mark.parametrize("offset_mm", [0.0, 30.0])
def test_a_band_presses_by_the_change_of_its_direction(offset_mm):
    """Closed form: the sines of the angles at which the free stretches leave, h over their lengths."""
    band, seat = on_a_slab(100.0, offset_mm)
    h = seat.floor_mm
    runs = [100 - side * offset_mm - seat.width_mm / 2 for side in (-1, 1)]
    assert band.press(seat) == pytest.approx(sum(h / np.hypot(run, h) for run in runs), abs=1e-9)


def test_a_clamp_presses_a_saddle_by_its_arc_and_the_free_stretches():
    """Closed form: it leaves the saddle's floor at half its arc and the free angle together, on either side."""
    seat = fold_seat(mounted())
    floor = seat.contact.radius_mm + seat.wall_mm
    angle = np.arcsin(seat.width_mm / 2 / floor) + np.arccos(seat.contact.radius_mm / floor)
    assert around_torpedo(seat)[0].press(seat) == pytest.approx(2 * np.sin(angle), rel=0.01)


def test_saddles_at_one_place_share_their_clamps():
    """Two slots each: two clamps for both; four when one saddle is moved by more than a band."""
    rig = mounted()
    shared = around_torpedo(fold_seat(rig), base_seat(rig, FORWARD))
    assert [len(band.seats) for band in shared] == [2, 2]
    rig = mounted(fold_anchor_mm=(635.0, 0.0, 115.0))
    apart = around_torpedo(fold_seat(rig), base_seat(rig, FORWARD))
    assert [len(band.seats) for band in apart] == [1, 1, 1, 1]
    assert max(band.length_mm for band in apart) < shared[0].length_mm


def test_a_drawn_band_goes_around_what_it_straps():
    """Taut and as thick as it is: its volume is length times section, and it enters neither hull nor flange."""
    for band in (on_a_slab(100.0)[0], around_torpedo(fold_seat(mounted()))[0]):
        solid = band.solid()
        assert solid.is_valid
        thickness = {"clamps": 0.9, "straps": 1.9}[band.kind]
        expected = thickness * BAND_WIDTH_MM * (band.length_mm + np.pi * thickness)
        assert solid.volume == pytest.approx(expected, rel=0.01)
        assert min(abs(vertex.X - band.x_mm) for vertex in solid.vertices()) == pytest.approx(BAND_WIDTH_MM / 2)
        contact = band.seats[0].contact
        if isinstance(contact, CylinderContact):
            middles = (edge.center() for edge in solid.edges())
            assert min(np.hypot(middle.Y, middle.Z) for middle in middles) > contact.radius_mm - 1e-6


def test_what_is_screwed_needs_none():
    rig = mounted(fold_attachment="screws", base_attachment="screws")
    assert not around_torpedo(fold_seat(rig), base_seat(rig, FORWARD))


def test_a_body_that_is_not_there_is_named():
    _, seat = on_a_slab(100.0)
    away = replace(seat, body_from_seat=RigidTransform.from_components([0.5, 0.0, 0.02], Rotation.identity()))
    with pytest.raises(ValueError, match=r"expected hull to go around at x = 483\.0, found none"):
        bands([away], trimesh.creation.box((200, 200, 40)))


@pytest.fixture(scope="module", params=["torpedo", "aqua2 on pads", "aqua2"])
def held(request: pytest.FixtureRequest, built_preset):
    if request.param != "aqua2 on pads":
        return built_preset(request.param)
    return build_assembly(Rig.load("aqua2").with_gaze(mount={"fold_attachment": "pads", "base_attachment": "pads"}))


def test_what_is_in_the_bill_of_materials_is_in_the_masses_and_in_the_steps(held):
    """And nothing else is: pieces by name, their mass together, and each in some step; but 2 g of silicone."""
    items = [item for item in bill_of_materials(held) if item.parts]
    bodies = [body for group in part_bodies(held.rig, held.meshes).values() for body in group]
    assert sorted(name for item in items for name in item.parts) == sorted(body.name for body in bodies)
    assert sum(item.count * item.mass_g for item in items) == pytest.approx(1000 * sum(body.mass_kg for body in bodies))
    steps = assembly_steps(held)
    assert [problem for step in steps for problem in step.problems] == []
    added = [name for step in steps for name in step.added]
    assert set(added) == {body.name for body in bodies}
    kinds = {item.name: item.count for item in items if item.name.startswith(("Hose clamp", "Cable tie", "Acrylic"))}
    assert list(kinds.values()) == [2]


def test_no_preset_that_is_strapped_or_taped_has_a_problem(held):
    assert assembly_problems(held, grid_steps=2) == []
