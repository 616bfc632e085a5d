"""Commands that the studio's page runs, to their end or stopped, in a real Chromium: a rig on a hull of one's own."""

import re

import pytest
from studio_page import Served, complaints, opened, put, slider, waited_for

from reports.studies.new_rig import new_rig_on_hull
from rigs import Rig
from tests.cad.placement.conftest import capsule

__all__ = ["capsule"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory, capsule):
    folder = tmp_path_factory.mktemp("work")
    capsule.export(folder / "eel.stl")
    new_rig_on_hull("eel", folder / "eel.toml", folder / "eel.stl", log=lambda _: None)
    return folder


@pytest.fixture(scope="module")
def served(folder):
    served = Served(folder, "eel.toml")
    yield served
    served.process.kill()
    served.process.communicate()


@pytest.fixture(scope="module")
def page(browser, served):
    page = opened(browser, served)
    page.get_by_text(re.compile("ms to render")).wait_for()
    page.get_by_role("tab", name="Work").click()
    return page


@pytest.fixture(scope="module")
def kept(folder):
    """The file that the studio keeps every change in."""
    return lambda: next(folder.glob(".eel-*.studio.toml"))


def unfolded(page, heading, button):
    """The button of a piece of work, its heading opened."""
    name = page.get_by_role("button", name=button, exact=True)
    if not name.is_visible():
        page.get_by_text(heading, exact=True).click()
    return name


def test_search_runs_to_its_end_and_a_design_is_taken(page, folder, kept):
    search = unfolded(page, "Search around here", "Search")
    put(page, "designs", 500)
    search.click()
    page.get_by_text("search: done").wait_for()
    found = sorted((folder / "out/eel-studio/search/rigs").glob("*.toml"))
    assert found
    unfolded(page, "Search around here", "Take the design").click()
    wanted = Rig.load(found[0]).gaze.gaze_mirror.width_mm
    assert waited_for(page, lambda: Rig.load(kept()).gaze.gaze_mirror.width_mm == wanted)
    page.get_by_role("tab", name="Design").click()
    assert waited_for(page, lambda: float(slider(page, "M2 width (mm)").input_value()) == pytest.approx(wanted))
    page.get_by_role("button", name="Undo").click()
    page.get_by_role("tab", name="Work").click()
    assert waited_for(page, lambda: Rig.load(kept()) == Rig.load(folder / "eel.toml"))


def test_place_puts_the_mount_where_a_changed_rig_needs_it(page, folder, kept):
    before = Rig.load(folder / "eel.toml").gaze
    page.get_by_role("tab", name="Design").click()
    put(page, "d2, M1 to M2 (mm)", before.gaze_mirror.distance_mm + 10)
    assert waited_for(page, lambda: Rig.load(kept()).gaze != before)
    page.get_by_role("tab", name="Work").click()
    unfolded(page, "Place again", "Place").click()
    page.get_by_text("place: done").wait_for()


def test_export_writes_files(page, folder):
    unfolded(page, "Export the mount", "Export").click()
    page.get_by_text("export: done").wait_for()
    written = {path.suffix for path in (folder / "out/eel-studio/mount").rglob("*")}
    assert {".stl", ".step", ".3mf", ".urdf", ".pdf"} <= written


def test_stop_ends_a_command_and_the_next_can_begin(page, folder):
    unfolded(page, "Short dive", "Dive").click()
    page.get_by_role("button", name="Stop", exact=True).click()
    page.get_by_text("dive: stopped").wait_for()
    assert not page.get_by_role("button", name="Stop", exact=True).is_visible()
    unfolded(page, "Size the mirrors for a window", "Size").click()
    page.get_by_text("size: done").wait_for()


def test_nothing_complained(page, served):
    page.wait_for_timeout(200)
    assert complaints(page) == []
    _, err, status = served.interrupt()
    assert status == 0
    assert "Traceback" not in err
