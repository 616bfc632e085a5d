"""The drill template on paper: its holes in points of the PDF are the layout's, and its bar is 100 mm long."""

from __future__ import annotations

import re

import numpy as np
import pytest
from pypdf import PdfReader

from cad.export.drawings.drill_template import BAR_AT_MM, BAR_MM, CENTRES_MM, screwed_seats, write_drill_template
from rigs import Rig

POINTS_PER_MM = 72 / 25.4
PAPER_MM = 0.002
"""Points are written with three to six decimals."""
LINE = re.compile(r"([-\d.]+) ([-\d.]+) m\s+([-\d.]+) ([-\d.]+) l\s+S")


@pytest.fixture(scope="module")
def rig():
    return Rig.load("aqua2").with_gaze(mount={"fold_attachment": "screws", "base_attachment": "screws"})


@pytest.fixture(scope="module")
def sheet(rig, tmp_path_factory):
    (path,) = write_drill_template(rig, tmp_path_factory.mktemp("template") / "drill_template.pdf")
    return path


def segments_mm(path):
    """Straight lines of one stroke, each as start and end, millimetres from the sheet's lower left corner."""
    content = PdfReader(path).pages[0].get_contents().get_data().decode("latin-1")
    return np.array(LINE.findall(content), dtype=float).reshape(-1, 2, 2) / POINTS_PER_MM


def test_it_is_a4_at_full_scale_with_a_bar_of_100_mm(sheet):
    box = PdfReader(sheet).pages[0].mediabox
    assert [float(side) / POINTS_PER_MM for side in (box.width, box.height)] == pytest.approx([210, 297], abs=0.01)
    bars = [line for line in segments_mm(sheet) if line[0] == pytest.approx(BAR_AT_MM, abs=PAPER_MM)]
    assert max(np.linalg.norm(end - start) for start, end in bars) == pytest.approx(BAR_MM, abs=PAPER_MM)


def test_holes_in_points_are_where_the_flange_s_screws_are(rig, sheet, aqua2_screws):
    """The screws of the assembly, dropped along the hull's normal onto the flange's plane."""
    lines = segments_mm(sheet)
    level = lines[np.abs(lines[:, 0, 1] - lines[:, 1, 1]) < PAPER_MM]
    upright = lines[np.abs(lines[:, 0, 0] - lines[:, 1, 0]) < PAPER_MM]
    crossings = [
        tuple(a) for a in level.mean(axis=1) if (np.linalg.norm(upright.mean(axis=1) - a, axis=1) < PAPER_MM).any()
    ]
    for end, seat in screwed_seats(rig).items():
        screws = np.array([point for name, point in aqua2_screws if name.startswith(f"{end}_flange_screw")])
        assert len(screws) == 4
        on_flange = 1000 * seat.body_from_seat.inv().apply(screws)[:, :2] + CENTRES_MM[end]
        for place in on_flange:
            assert min(np.linalg.norm(np.array(crossings) - place, axis=1)) < PAPER_MM + 0.01


@pytest.fixture(scope="module")
def aqua2_screws(rig):
    """Names and centres of bounding boxes of the flanges' screws, body frame, metres."""
    from cad.assembly.assembly import build_assembly

    return [
        (part.name, (part.mesh.vertices_m.min(axis=0) + part.mesh.vertices_m.max(axis=0)) / 2)
        for part in build_assembly(rig).parts
        if "flange_screw" in part.name
    ]


def test_a_mount_without_screws_has_no_template_and_the_sheet_comes_out_the_same(rig, sheet, tmp_path):
    assert write_drill_template(Rig.load("aqua2"), tmp_path / "none.pdf") == []
    assert not (tmp_path / "none.pdf").exists()
    again = write_drill_template(rig, tmp_path / "again.pdf")
    assert again[0].read_bytes() == sheet.read_bytes()


def test_it_says_what_to_drill(sheet):
    words = PdfReader(sheet).pages[0].extract_text()
    for said in ("drill template 1:1", "4 x M4, drill 3.3 mm", "Fold bracket", "Gimbal base", "100 mm"):
        assert said in words
