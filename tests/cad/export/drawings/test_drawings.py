"""Drawings: projections and holes of simple solids in closed form, and what the sheets of a preset say."""

from __future__ import annotations

import re

import numpy as np
import pytest
from build123d import Axis, Box, Cylinder, Pos, Rot

from cad.export.drawings.part_drawing import draw_part, named
from cad.export.drawings.projection import FRONT, LEFT, TOP, holes, outline
from cad.export.drawings.sheet import largest_scale, scale_name

ROUNDING_MM = 1e-6


def words(sheet) -> list[str]:
    return [text.get_text() for text in sheet.axes.texts]


@pytest.mark.parametrize(("view", "extent"), [(FRONT, (30, 10)), (LEFT, (20, 10)), (TOP, (30, 20))])
def test_a_box_projects_to_its_sides(view, extent):
    """A box of 30 x 20 x 10 mm: four edges are seen, the four behind them are hidden by them or fall onto them."""
    lines = outline([Box(30, 20, 10).solid()], view)
    points = np.vstack(lines.visible)
    assert np.ptp(points, axis=0) == pytest.approx(extent, abs=ROUNDING_MM)
    assert len(lines.visible) == 4


def test_coordinates_on_paper_are_those_of_the_view():
    """A box away from the origin: x to the right, z up in the front view."""
    solid = (Pos(100, 40, -7) * Box(2, 2, 2)).solid()
    points = np.vstack(outline([solid], FRONT).visible)
    assert points.mean(axis=0) == pytest.approx([100, -7], abs=ROUNDING_MM)
    assert FRONT.project([100.0, 40.0, -7.0]) == pytest.approx([100, -7])


def test_what_stands_behind_is_hidden():
    near, far = Pos(0, -20, 0) * Box(10, 1, 10), Box(4, 1, 4)
    lines = outline([near.solid(), far.solid()], FRONT, hidden=True)
    assert np.abs(np.vstack(lines.visible)).max() == pytest.approx(5)
    assert np.abs(np.vstack(lines.visible)).min() == pytest.approx(5)
    assert len(lines.hidden) >= 4


def test_holes_are_found_and_pegs_and_fillets_are_not():
    plate = Box(40, 30, 6)
    plate = plate.fillet(3, plate.edges().filter_by(Axis.Z))
    plate -= Pos(10, 5, 0) * Cylinder(2.25, 6)
    plate -= Pos(-10, 5, 1) * Cylinder(1.5, 4)
    plate += Pos(0, -8, 5) * Cylinder(3, 4)
    plate -= Pos(0, 8, 0) * Rot(0, 90, 0) * Cylinder(1.0, 80)
    found = holes(plate.solid())
    assert [(round(hole.diameter_mm, 6), round(hole.depth_mm, 6)) for hole in found] == [(4.5, 6), (3.0, 4), (2.0, 40)]
    assert found[0].mouth == pytest.approx([10, 5, 3])
    assert found[1].mouth == pytest.approx([-10, 5, 3])
    assert np.abs(found[2].axis) == pytest.approx([1, 0, 0])


def test_alike_holes_share_a_letter():
    plate = Box(40, 40, 4)
    for x in (-10, 10):
        plate -= Pos(x, 0, 0) * Cylinder(2, 4)
    plate -= Cylinder(5, 4)
    assert [name for name, _ in named(holes(plate.solid()))] == ["A", "B1", "B2"]


def test_a_sheet_gives_size_holes_and_scale():
    plate = Box(100, 60, 8) - Pos(30, 20, 0) * Cylinder(2.25, 8)
    said = words(draw_part(plate.solid(), rig="rig", name="plate", material="ABS", rig_hash="abc", origin=None))
    assert {"x 100.0", "y 60.0", "z 8.0"} <= set(said)
    # From the corner at (-50, -30, -4): the hole's mouth is at (80, 50, 8).
    at = said.index("4.5")
    assert said[at - 1 : at + 6] == ["A", "4.5", "8.0", "z", "80.0", "50.0", "8.0"]
    assert {"1:1", "plate", "rig", "ABS", "abc"} <= set(said)


@pytest.mark.parametrize(
    ("size", "scale"), [((10, 10), "10:1"), ((100, 40), "2:1"), ((101, 40), "1:1"), ((900, 1), "1:5")]
)
def test_scales_are_the_largest_of_the_standard_s(size, scale):
    assert scale_name(largest_scale(size, (200, 200))) == scale


def test_every_printed_part_and_mirror_has_a_sheet(exported):
    folder = exported.folder / "drawings"
    drawn = [part.name for part in exported.assembly.parts if part.printed or part.role.value == "mirror"]
    expected = {f"{name}.{kind}" for name in [*drawn, "assembly"] for kind in ("svg", "pdf")}
    assert {path.name for path in folder.iterdir()} == expected
    for path in folder.glob("*.pdf"):
        box = re.search(rb"/MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \]", path.read_bytes())
        points = [float(number) for number in box.groups()]
        assert points == pytest.approx([420 / 25.4 * 72, 297 / 25.4 * 72]), path.name
