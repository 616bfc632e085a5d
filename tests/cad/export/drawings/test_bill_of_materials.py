"""The bill of materials counts every part once and asks for it by its catalogue name."""

from __future__ import annotations

import csv

import pytest
import trimesh

from cad.assembly.assembly import build_assembly
from cad.checks.sequence.steps import assembly_steps
from cad.export.drawings.bill_of_materials import bill_of_materials
from cad.export.printing.prints import prints
from optics.mesh import Role
from rigs.catalogue import MATERIALS

CHORDS = 0.01
"""Share of a curved part's volume that the triangles of its mesh cut off, at most."""


def test_every_part_but_the_hull_is_on_the_bill_once(built):
    items = bill_of_materials(built)
    named = [name for item in items for name in item.parts]
    assert sorted(named) == sorted(part.name for part in built.parts if part.role is not Role.HULL)
    assert all(item.count == len(item.parts) for item in items if item.parts)
    assert len({item.name for item in items}) == len(items)


def test_prints_weigh_volume_times_density(built):
    density = MATERIALS[built.rig.gaze.mount.material].density_kg_per_m3
    prints = [item for item in bill_of_materials(built) if item.kind == "print"]
    assert [item.name for item in prints] == [part.name for part in built.parts if part.printed]
    for item in prints:
        volume_mm3 = built.part(item.name).solid.volume
        assert item.volume_cm3 == pytest.approx(volume_mm3 / 1000, rel=CHORDS)
        assert item.mass_g == pytest.approx(density * volume_mm3 * 1e-6, rel=CHORDS)
        assert item.material == built.rig.gaze.mount.material


def test_what_is_bought_has_the_name_to_order_it_by(exported):
    with (exported.folder / "bom.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    bought = {row["name"]: row for row in rows if row["kind"] == "buy"}
    servo, mirror = exported.assembly.rig.gaze.servos.pan, exported.assembly.rig.gaze.gaze_mirror
    named = f"Servo {servo.name}, rated to {servo.depth_rating_m:g} m"
    assert bought[named]["count"] == "2"
    assert float(bought[named]["mass_g"]) == servo.mass_g
    assert any(f"{mirror.width_mm:g} x {mirror.height_mm:g} x {mirror.thickness_mm:g} mm" in name for name in bought)
    assert any("ISO 4762" in name for name in bought)


def test_the_bill_says_which_mirror_and_which_servo_to_buy(aqua2):
    names = [item.name for item in bill_of_materials(aqua2) if item.kind == "buy"]
    mirrors = [name for name in names if name.startswith("Front-surface mirror")]
    assert len(mirrors) == 2
    assert all("protected aluminium" in name and "edges sealed" in name for name in mirrors)
    assert "Servo hs5086wp-paper, rated to 1 m" in names
    assert "Socket head cap screw ISO 4762 M3x8 A4-70, on the shaft of servo hs5086wp-paper" in names


def test_what_a_mirror_is_bonded_with_is_on_the_bill_and_in_its_step(aqua2):
    """Or the clip that holds it instead."""
    screwed = build_assembly(aqua2.rig.with_gaze(mount={"mirror_fixing": "screws"}))
    for built, glued in ((aqua2, True), (screwed, False)):
        names = [item.name for item in bill_of_materials(built)]
        titles = [step.title for step in assembly_steps(built) if step.title.startswith("Slide")]
        assert any(name.startswith("Silicone") for name in names) is glued
        assert [title.endswith("onto silicone") for title in titles] == [glued, glued]


def test_the_bill_says_where_to_buy_and_how_to_print(built):
    """Each catalogue name of every preset has its kind of shop; what is not known of prints is left empty."""
    rig, printed = built.rig, built.printed
    items = bill_of_materials(built, prints(rig, printed, slicing=False))
    assert all(item.supplier for item in items)
    assert {item.supplier for item in items if item.kind == "print"} == {"own printer"}
    assert [item.name for item in items if item.printed] == [mesh.name for mesh in printed]
    assert bill_of_materials(built)[0].printed is None


def test_the_printed_parts_lie_apart_as_they_are_printed(exported):
    """What is in `print` is what the bill of materials says is printed, with plates and profile, and its boxes."""
    with (exported.folder / "bom.csv").open(encoding="utf-8", newline="") as file:
        rows = {row["name"]: row for row in csv.DictReader(file) if row["kind"] == "print"}
    there = {path.name for path in (exported.folder / "print").iterdir()}
    assert {name for name in there if not name.startswith("plate_")} == {f"{name}.stl" for name in rows} | {
        "prusaslicer.ini"
    }
    for name, row in rows.items():
        bounds = trimesh.load_mesh(exported.folder / f"print/{name}.stl").bounds
        assert bounds[0] == pytest.approx([0, 0, 0], abs=1e-4)
        assert bounds[1] == pytest.approx([float(side) for side in row["as_printed_mm"].split(" x ")], abs=0.06)
        assert float(row["print_hours"]) > 0
