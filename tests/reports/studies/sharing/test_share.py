"""The explorer of aqua2, made once and coarsely: what its file holds, and what Chromium makes of it, offline."""

from __future__ import annotations

import json
import re
import shutil
from contextlib import suppress
from functools import partial

import numpy as np
import pytest

from cad.assembly.meshes import rig_meshes
from optics.coverage.coverage import covered_cells
from optics.coverage.sphere import cell_directions
from optics.gaze.kinematics import forward_gaze
from optics.layout import Layout
from optics.mesh import Group
from optics.occlusion import Occluder
from reports.studies.design import MapGrid
from reports.studies.sharing import share as module
from reports.studies.sharing.share import Fineness, share
from rigs import Rig
from scenes.baking.light_quality import LightQuality

RIG = Rig.load("aqua2").with_(joints__pan__offset_deg=3.0, joints__tilt__sign=-1, joints__tilt__min_deg=-60.0)
"""With an offset and a reversed joint: a closed form that leaves one out is wrong."""
MAPS = MapGrid(poses=5, columns=16, rows=12)
FINENESS = Fineness(views=2, poses=(4, 6), nside=8, coverage=MAPS, light=LightQuality.coarse())
ROUNDING = 1e-9
MOST_MB = 25.0
LOCAL = ("data:", "file:")


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("share") / "explorer.html"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "prints", partial(module.prints, slicing=False))
        return share(RIG, path, log=lambda line: None, fineness=FINENESS)


@pytest.fixture(scope="module")
def page(file):
    """The file in a browser without a network; what went wrong on it is in `page.wrong`."""
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="driving a browser needs Playwright: pip install playwright"
    )
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        pytest.skip("there is no Chromium on PATH: apt-get install chromium")
    with playwright.sync_playwright() as driver:
        options = ["--no-sandbox", "--use-gl=swiftshader", "--enable-unsafe-swiftshader"]
        browser = driver.chromium.launch(executable_path=chromium, args=options)
        phone = {"viewport": {"width": 390, "height": 800}, "has_touch": True, "is_mobile": True}
        shown = browser.new_context(offline=True, **phone).new_page()
        shown.wrong = []
        shown.on("pageerror", lambda error: shown.wrong.append(str(error)))
        shown.on("console", lambda said: shown.wrong.append(said.text) if said.type == "error" else None)
        shown.on("request", lambda asked: shown.wrong.extend([asked.url] * (not asked.url.startswith(LOCAL))))
        shown.goto(file.as_uri())
        yield shown
        with suppress(playwright.Error):
            browser.close()


def test_the_file_is_small_and_stands_alone(file):
    text = file.read_text(encoding="utf-8")
    assert file.stat().st_size < 1e6 * MOST_MB
    assert not re.search(r"https?://|<script src|<link|@import|url\(", text)
    assert "Bill of materials" in text and "fold bracket" in text


def test_it_holds_every_part_and_a_view_of_each_joint_value(file):
    data = json.loads(re.search(r'(?s)id="data">(.*?)</script>', file.read_text(encoding="utf-8"))[1])
    assert [part["name"] for part in data["parts"]] == [part.name for part in rig_meshes(RIG)]
    corners = [(a, b) for b in (-60.0, 122.5) for a in (-77.5, 77.5)]
    np.testing.assert_allclose([view["q_deg"] for view in data["views"]], corners)


def test_its_gaze_is_that_of_the_optics(page):
    layout = Layout.from_rig(RIG)
    for q1, q2 in ((0.0, 0.0), (30.0, -10.0), (-77.5, 122.5), (12.3, 45.6)):
        found = page.evaluate(f"forwardGaze({q1}, {q2})")
        gaze = forward_gaze(layout, np.radians(q1), np.radians(q2))
        assert found["direction"] == pytest.approx(gaze.direction.tolist(), abs=ROUNDING)
        for name in ("azimuth", "elevation", "roll"):
            turn = found[name] - float(np.degrees(getattr(gaze, name)))
            assert (turn + 180) % 360 - 180 == pytest.approx(0, abs=1e-7)


def test_its_joints_move_as_the_rig_s(page):
    layout = Layout.from_rig(RIG)
    q1, q2 = np.radians([20.0, -15.0])
    for group, pose in (("pan", layout.body_from_pan(q1)), ("tilt", layout.body_from_m2(q1, q2))):
        found = np.reshape(page.evaluate(f"bodyFrom('{group}', 20, -15)"), (4, 4)).T
        np.testing.assert_allclose(found, pose.as_matrix(), atol=ROUNDING)


def test_it_says_who_sees_a_direction(page):
    """Of the cell that a direction is in: the poses whose mirrors show it, as coverage finds them one by one."""
    layout, parts, (pan, tilt) = Layout.from_rig(RIG), rig_meshes(RIG), FINENESS.poses
    occluders = {group: Occluder.of_group(parts, group) for group in Group}
    poses = np.array([(a, b) for b in layout.tilt.values(tilt) for a in layout.pan.values(pan)])
    seen = np.array([covered_cells(RIG, occluders, q1=[a], q2=[b], nside=FINENESS.nside) for a, b in poses])
    by_poses = seen.sum(axis=0).argsort()
    assert seen[:, by_poses[-1]].any() and not seen[:, by_poses[0]].any()
    for cell in (*by_poses[:2], *by_poses[-8:]):
        x, y, z = cell_directions(FINENESS.nside)[cell]
        azimuth, elevation = np.degrees([np.arctan2(y, x), np.arcsin(z)])
        found = np.reshape(page.evaluate(f"whoSees({azimuth}, {elevation})"), (-1, 2))
        np.testing.assert_allclose(found, np.degrees(poses[seen[:, cell]]), atol=ROUNDING)


def test_a_slider_moves_rig_image_and_read_out(page):
    """Solids are drawn, and drawn otherwise when a joint has moved; nothing goes wrong on a phone's width."""
    drawn = "drawRig(), document.getElementById('rig').toDataURL()"
    before = page.evaluate(f"({drawn})"), page.get_attribute("#view", "src"), page.text_content("#gaze")
    page.evaluate("s => { s.value = 70; s.dispatchEvent(new Event('input')); }", page.query_selector("#q1"))
    after = page.evaluate(f"({drawn})"), page.get_attribute("#view", "src"), page.text_content("#gaze")
    assert all(one != other for one, other in zip(before, after, strict=True))
    assert "q1 = 77.5°" in page.text_content("#shown")
    assert page.evaluate("document.documentElement.scrollWidth") == 390
    assert page.wrong == []


def fingers(page, *moves):
    """Touch the screen: for each move where the fingers are, in pixels."""
    screen = page.context.new_cdp_session(page)
    for kind, places in zip(("touchStart", *["touchMove"] * (len(moves) - 1)), moves, strict=True):
        points = [{"x": float(x), "y": float(y), "id": number} for number, (x, y) in enumerate(places)]
        screen.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    screen.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})


def test_a_finger_turns_the_rig_and_two_bring_it_nearer(page):
    page.locator("#rig").scroll_into_view_if_needed()
    box = page.locator("#rig").bounding_box()
    middle = np.array([box["x"] + box["width"] / 2, box["y"] + box["height"] / 2])
    before = page.evaluate("({ ...camera })")
    aside = np.array([1.0, 0.0])
    fingers(page, [middle], [middle + 30 * aside], [middle + 60 * aside])
    turned = page.evaluate("({ ...camera })")
    assert turned["distance"] == before["distance"]
    assert turned != before
    fingers(page, *([middle - half * aside, middle + half * aside] for half in (20, 30, 40)))
    # Twice as far apart brings the eye to half of the distance.
    assert page.evaluate("camera.distance") == pytest.approx(before["distance"] / 2, rel=0.01)
    assert page.wrong == []


def test_a_tap_on_the_map_is_answered(page):
    page.locator("#map").scroll_into_view_if_needed()
    box = page.locator("#map").bounding_box()
    page.tap("#map", position={"x": 0.5 * box["width"], "y": 0.3 * box["height"]})
    assert re.search(r"poses? shows? azimuth .*°, elevation 36°", page.text_content("#answer"))
    assert page.wrong == []


def test_a_dark_screen_has_dark_paper_and_a_printer_none(page):
    """The style is that of all pages; the browser says what it makes of it."""
    paper = "getComputedStyle(document.body).backgroundColor"
    page.emulate_media(color_scheme="dark")
    dark = page.evaluate(paper)
    page.emulate_media(color_scheme="dark", media="print")
    printed = page.evaluate(paper)
    page.emulate_media(color_scheme="light", media="screen")
    assert [dark, printed, page.evaluate(paper)] == ["rgb(15, 23, 42)", "rgb(255, 255, 255)", "rgb(255, 255, 255)"]
