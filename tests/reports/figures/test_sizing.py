"""Tables and figures of sizing: complete, plain, and the same bytes for the same data."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

from optics.camera import camera_from_spec
from optics.sizing.gaze_range import GazeRange
from optics.sizing.limits import Request
from optics.sizing.sizing import size_mirrors
from optics.sizing.trade_off import trade_off
from optics.sizing.window import fraction_window
from reports.figures.sizing import outlines_figure, save_figure, trade_off_figure, write_outlines, write_trade_off
from rigs import Rig

AQUA2 = Rig.load("aqua2")


def request_of(fraction, elevation_deg):
    window = fraction_window(camera_from_spec(AQUA2.camera), fraction)
    gaze = GazeRange(first=(-0.5, 0.5), second=tuple(np.radians(elevation_deg)), in_joints=False)
    return Request(window=window, gaze=gaze)


@pytest.fixture(scope="module")
def sizing():
    return size_mirrors(AQUA2, request_of(0.15, (-10, 30)))


@pytest.fixture(scope="module")
def result():
    return trade_off(AQUA2, request_of(0.15, (-10, 30)), [], d1_mm=[80.0, 95.0], d2_mm=[15.0, 125.0])


def test_outlines_are_written_with_their_areas(sizing, tmp_path):
    write_outlines(sizing, tmp_path / "outlines.json")
    data = json.loads((tmp_path / "outlines.json").read_text(encoding="utf-8"))
    for name, outlines in (("M1", sizing.m1), ("M2", sizing.m2)):
        assert list(data[name]) == ["rectangle", "octagon", "ellipse", "free rectangle", "convex"]
        for kind, outline in data[name].items():
            assert outline["area_cm2"] == pytest.approx(1e4 * outlines.area_m2(kind), abs=5e-4)
            np.testing.assert_allclose(outline["corners_mm"], 1000 * outlines.corners_m(kind), atol=5e-4)


def test_the_table_has_a_row_per_design(result, tmp_path):
    write_trade_off(result, tmp_path / "trade_off.csv")
    with (tmp_path / "trade_off.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(float(row["d1_mm"]), float(row["d2_mm"])) for row in rows] == [(80, 15), (95, 15), (80, 125), (95, 125)]
    assert [row["binds"] for row in rows] == ["clearance", "clearance", "", ""]
    for row in rows:
        assert float(row["m2_cm2"]) == pytest.approx(float(row["m2_width_mm"]) * float(row["m2_height_mm"]) / 100)


def test_figures_have_the_same_bytes_twice(sizing, result, tmp_path):
    for name, make in (
        ("outlines", lambda: outlines_figure(sizing)),
        ("maps", lambda: trade_off_figure(result, AQUA2)),
    ):
        files = [tmp_path / f"{name}_{k}.png" for k in range(2)]
        for file in files:
            save_figure(make(), file)
        first, second = (file.read_bytes() for file in files)
        assert first == second and first.startswith(b"\x89PNG")
    assert len(list(tmp_path.iterdir())) == 4


def test_a_mirror_that_cannot_be_is_drawn_as_such(tmp_path):
    steep = size_mirrors(AQUA2, request_of(0.9, (-65, 0)))
    assert steep.m2 is None
    titles = [axes.get_title() for axes in outlines_figure(steep).axes]
    assert titles == ["M1: no finite mirror does", "M2: no finite mirror does"]
    write_outlines(steep, tmp_path / "outlines.json")
    assert json.loads((tmp_path / "outlines.json").read_text(encoding="utf-8")) == {"M1": None, "M2": None}
