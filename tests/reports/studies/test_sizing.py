"""Sizes of the mirrors in a design report: what `mirrorgaze size` says without options."""

from __future__ import annotations

import inspect
import math

import pytest

from mirrorgaze.commands.design.size import size
from reports.pages.page import html
from reports.pages.sizing import sizing_section
from reports.studies.sizing import sizing_results, usual_request
from rigs import Rig

RIG = Rig.load("aqua2")


def test_the_usual_request_is_about_the_cameras_view():
    camera = RIG.camera.model_copy(update={"yaw_deg": 30.0, "pitch_deg": -70.0})
    gaze = usual_request(RIG.model_copy(update={"camera": camera})).gaze
    assert [math.degrees(value) for value in (*gaze.first, *gaze.second)] == pytest.approx([-30, 90, -90, -40])


def test_the_usual_request_is_what_the_command_asks_for_without_options():
    asked = {name: each.default for name, each in inspect.signature(size).parameters.items()}
    request = usual_request(RIG)
    width, height = request.window.size_px
    assert (width / RIG.camera.width_px, height / RIG.camera.height_px) == (float(asked["window"]),) * 2
    assert (asked["azimuth_deg"], asked["elevation_deg"]) == (None, None)
    found = [math.degrees(value) for value in (*request.gaze.first, *request.gaze.second)]
    assert found == pytest.approx([-60, 60, -30, 30])
    assert 1000 * request.margin_m == asked["margin_mm"]
    assert math.degrees(request.angle_tolerance) == asked["angle_tolerance_deg"]


def test_the_section_has_present_and_needed_sizes_and_what_drives_them(tmp_path):
    """aqua2's M2 is 100 mm high: a gaze of -30 degrees far to the side asks for more than half as much again."""
    found, files = sizing_results(RIG, tmp_path)
    assert files == [tmp_path / "sizing" / "outlines.png"]
    assert files[0].is_file()
    m1, m2 = found.mirrors
    assert (m1.name, m1.present, m2.name) == ("M1", RIG.gaze.fold_mirror.size, "M2")
    assert any(each.startswith("M2 height 155.0 mm: at azimuth -52, elevation -30") for each in found.drivers)
    page = html(sizing_section(found, tmp_path))
    for shown in (m1.present, m2.present, m2.needed, *found.drivers, *found.obstacles):
        assert shown in page
