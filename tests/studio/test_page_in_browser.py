"""The studio in a real Chromium: sliders, image, undo, saving, who is refused; one server for all tests of the file."""

import base64
import re
import urllib.error
import urllib.request
from contextlib import suppress
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.optimize import least_squares
from studio_page import LOOKS, PATIENCE_MS, WIDTH_PX, Served, complaints, opened, playwright, put, slider, waited_for

from optics import OpticalTrain
from optics.layout import Layout, camera_pose
from optics.status import Status
from rigs import Rig
from scenes.stage.scene import TARGET_M
from studio.rig_scene import HANDLE_AWAY_M, HANDLE_M, VIEWPOINT

TARGET_PX = 1.0
"""How far the ball's pixels may be from where the optics put its centre."""
RED = 2.0
"""Red over green and blue, of the ball and of nothing else among the labels."""
JOINT_DEG = 0.1
"""What the fields show, and what the table of sights loses."""
BALL_DEG = 0.5
"""As far as a pixel is on the ball's way."""
FOV_DEG = 75.0
"""Vertical, of viser's view."""

READ_IMAGE = """async () => {
  const image = document.querySelector('img');
  await image.decode();
  const canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = [image.naturalWidth, image.naturalHeight];
  canvas.getContext('2d').drawImage(image, 0, 0);
  return canvas.toDataURL('image/png');
}"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("studio")


@pytest.fixture(scope="module")
def served(folder):
    served = Served(folder, "aqua2")
    yield served
    served.process.kill()
    served.process.communicate()


@pytest.fixture(scope="module")
def page(browser, served):
    page = opened(browser, served)
    page.get_by_text(re.compile("ms to render")).wait_for()
    return page


def image(page):
    """What the page shows of the camera, shape (height, width, 3)."""
    # An image that another one replaces while it is decoded cannot be read.
    for _ in range(LOOKS):
        with suppress(playwright.Error):
            return pixels(page.evaluate(READ_IMAGE))
        page.wait_for_timeout(50)
    pytest.fail("the page shows no image")


def pixels(source):
    """Pixels of a PNG in a data address."""
    png = base64.b64decode(source.partition(",")[2])
    return cv2.imdecode(np.frombuffer(png, dtype=np.uint8), cv2.IMREAD_COLOR)[..., ::-1].astype(np.float64)


def projected_px(q1_deg, q2_deg):
    """Where the optics alone put the target's centre in the page's image."""
    rig = Rig.load("aqua2")
    train = OpticalTrain.from_rig(rig, q1=np.radians(q1_deg), q2=np.radians(q2_deg))
    found = train.project(camera_pose(rig.camera).inv().apply([TARGET_M]))
    assert found.status[0] == Status.OK
    return (found.pixels[0] + 0.5) * WIDTH_PX / rig.camera.width_px - 0.5


def seen_px(shown):
    """Middle of the red pixels."""
    v, u = np.nonzero(shown[..., 0] > RED * np.maximum(shown[..., 1], shown[..., 2]))
    return np.array([u.mean(), v.mean()]) if len(u) else np.full(2, np.nan)


def choose(page, label, value):
    row = f'//label[text()="{label}"]/ancestor::div[contains(@class, "mantine-Flex-root")][1]'
    page.locator(f"{row}//input").first.click()
    page.get_by_role("option", name=value, exact=True).click()


@pytest.fixture
def labelled(page):
    """The page, its image with a colour for each kind of thing."""
    page.get_by_role("tab", name="Water").click()
    choose(page, "overlay", "labels")
    yield page
    choose(page, "overlay", "none")
    page.get_by_role("tab", name="Design").click()


@pytest.mark.parametrize(("q1_deg", "q2_deg"), [(30.0, -10.0), (33.0, -8.0)])
def test_the_target_is_where_the_optics_put_it(labelled, q1_deg, q2_deg):
    page = labelled
    put(page, "q1, pan (deg)", q1_deg)
    put(page, "q2, tilt (deg)", q2_deg)
    u, v = projected_px(q1_deg, q2_deg)
    page.get_by_text(re.compile(re.escape(f"target at {u:.1f}, {v:.1f} px"))).wait_for()
    # The browser decodes the image after the text is there.
    assert waited_for(page, lambda: np.abs(seen_px(image(page)) - (u, v)).max() < TARGET_PX)


def test_a_slider_that_is_dragged_moves_the_image(page):
    before = image(page)
    thumb = page.get_by_role("slider").first.bounding_box()
    middle = thumb["x"] + thumb["width"] / 2, thumb["y"] + thumb["height"] / 2
    page.mouse.move(*middle)
    page.mouse.down()
    page.mouse.move(middle[0] - 40, middle[1], steps=4)
    page.mouse.up()
    assert waited_for(page, lambda: np.abs(image(page) - before).mean() > 1)


def drag(page, start, *stops):
    """Drag from a place of the window over others."""
    page.mouse.move(*start)
    page.mouse.down()
    for stop in stops:
        page.mouse.move(*stop, steps=3)
    page.mouse.up()


def joints_deg(page):
    return tuple(float(slider(page, label).input_value()) for label in ("q1, pan (deg)", "q2, tilt (deg)"))


def test_what_m2_shows_is_dragged(page):
    q_deg = (30.0, -10.0)
    put(page, "q1, pan (deg)", q_deg[0])
    put(page, "q2, tilt (deg)", q_deg[1])
    u, v = projected_px(*q_deg)
    page.get_by_text(re.compile(re.escape(f"target at {u:.1f}, {v:.1f} px"))).wait_for()
    rig, box = Rig.load("aqua2"), page.locator("img").first.bounding_box()
    # Of the window there is a whole number of pixels.
    corner, size = np.array([box["x"], box["y"]]), np.array([box["width"], box["height"]])
    start = np.round(corner + (np.array([u, v]) + 0.5) / WIDTH_PX * size[0])
    end = start + np.array([40, -25])
    drag(page, start, (start + end) / 2, end)

    def seen(place, q):
        q1, q2 = np.radians(q)
        pixel = (place - corner) / size * (rig.camera.width_px, rig.camera.height_px) - 0.5
        return OpticalTrain.from_rig(rig, q1=q1, q2=q2).unbounded().trace([pixel]).direction[0]

    expected = least_squares(lambda q: seen(end, q) - seen(start, q_deg), q_deg).x
    assert waited_for(page, lambda: joints_deg(page) == pytest.approx(expected, abs=JOINT_DEG))


def test_the_ball_on_the_gaze_is_dragged(page):
    q_deg = (40.0, 0.0)
    put(page, "q1, pan (deg)", q_deg[0])
    put(page, "q2, tilt (deg)", q_deg[1])
    page.get_by_text("azimuth 40.0°, elevation 0.0°").wait_for()
    centre = Layout.from_rig(Rig.load("aqua2")).body_from_gimbal.translation
    ball = centre + HANDLE_AWAY_M * np.array([np.cos(np.radians(40.0)), np.sin(np.radians(40.0)), 0.0])
    box = page.locator("canvas").first.bounding_box()
    eye, looked_at = (np.array(each) for each in VIEWPOINT)
    forward = (looked_at - eye) / np.linalg.norm(looked_at - eye)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    axes = np.stack([right / np.linalg.norm(right), np.cross(forward, right) / np.linalg.norm(right), forward])
    focal_px = box["height"] / 2 / np.tan(np.radians(FOV_DEG) / 2)
    middle = np.array([box["x"] + box["width"] / 2, box["y"] + box["height"] / 2])
    x, y, z = axes @ (ball - eye)
    start = np.round(middle + focal_px * np.array([x, y]) / z)
    end = start + np.array([30, -40])
    drag(page, start, (start + end) / 2, end)
    # The pointer moves in the plane of the image through the point of the ball that it took.
    depth = z - HANDLE_M
    pulled = eye + depth * (np.array([*(end - middle) / focal_px, 1.0]) @ axes) - centre
    azimuth, elevation = np.degrees([np.arctan2(pulled[1], pulled[0]), np.arcsin(pulled[2] / np.linalg.norm(pulled))])
    assert waited_for(page, lambda: joints_deg(page) == pytest.approx((azimuth, elevation / 2), abs=BALL_DEG))


def test_on_a_phone_the_image_is_as_wide_as_it_and_takes_fingers(browser, served, page):
    put(page, "q1, pan (deg)", 0)
    put(page, "q2, tilt (deg)", 0)
    page.get_by_text("azimuth 0.0°, elevation 0.0°").wait_for()
    phone = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
    with browser.new_context(**phone) as context:
        other = context.new_page()
        other.set_default_timeout(PATIENCE_MS)
        other.goto(served.address)
        shown = other.locator("img[src^='blob:']").first
        shown.wait_for()
        box = shown.bounding_box()
        assert box["x"] >= 0
        assert 300 < box["x"] + box["width"] <= 390
        assert box["y"] + box["height"] < 844
        shown.tap(position={"x": 0.55 * box["width"], "y": 0.5 * box["height"]})
        assert waited_for(page, lambda: joints_deg(page)[0] != 0)


def test_a_change_is_judged_and_undo_restores_the_bytes(page, folder):
    kept = next(folder.glob(".aqua2-*.studio.toml"))
    before = kept.read_bytes()
    put(page, "M2 width (mm)", 90)
    page.get_by_role("tab", name="Lines").click()
    page.get_by_text("gaze_mirror__width_mm=90").wait_for()
    assert kept.read_bytes() != before
    page.get_by_role("tab", name="Verdict").click()
    page.get_by_text("of the sphere").wait_for()
    page.get_by_role("tab", name="Design").click()
    page.get_by_role("button", name="Undo").click()
    assert waited_for(page, lambda: kept.read_bytes() == before)
    assert waited_for(page, lambda: slider(page, "M2 width (mm)").input_value() == "80")


def test_saves_a_rig_file(page, folder):
    put(page, "M2 width (mm)", 90)
    kept = next(folder.glob(".aqua2-*.studio.toml"))
    assert waited_for(page, lambda: "width_mm = 90" in kept.read_text())
    page.get_by_role("tab", name="Work").click()
    page.get_by_role("button", name="Save", exact=True).click()
    file = folder / "my-aqua2.toml"
    page.get_by_text(re.compile("my-aqua2.toml: saved")).wait_for()
    assert Rig.load(file).gaze.gaze_mirror.width_mm == 90
    assert "# nominal (d1 of figure 3)" in file.read_text()


def test_size_runs_to_its_end_and_is_one_step_of_undo(page, folder):
    kept = next(folder.glob(".aqua2-*.studio.toml"))
    before = kept.read_bytes()
    page.get_by_role("tab", name="Work").click()
    page.get_by_text("Size the mirrors for a window").click()
    page.get_by_role("button", name="Size", exact=True).click()
    page.get_by_text("size: done").wait_for()
    sized = Rig.load(kept).gaze.gaze_mirror.width_mm
    page.get_by_role("tab", name="Design").click()
    assert waited_for(page, lambda: float(slider(page, "M2 width (mm)").input_value()) == sized != 90)
    page.get_by_role("button", name="Undo").click()
    assert waited_for(page, lambda: kept.read_bytes() == before)


def test_two_browsers_see_the_same_rig(browser, served, page):
    with browser.new_context() as context:
        other = context.new_page()
        other.goto(served.address)
        slider(other, "q1, pan (deg)").wait_for()
        put(page, "q1, pan (deg)", 12)
        assert waited_for(page, lambda: slider(other, "q1, pan (deg)").input_value() == "12")


@pytest.mark.parametrize(
    ("address", "headers"),
    [
        (lambda url: url.split("?")[0], {}),
        (lambda url: url.split("=")[0] + "=wrong", {}),
        (lambda url: url, {"Origin": "http://evil.example"}),
        (lambda url: url, {"Host": "evil.example"}),
    ],
)
def test_others_are_refused(served, address, headers):
    asked = urllib.request.Request(address(served.address), headers=headers)
    with pytest.raises(urllib.error.HTTPError) as refused:
        urllib.request.urlopen(asked)
    refused.value.close()
    assert refused.value.code == 403


def test_a_page_of_another_site_gets_no_socket(browser, served, page):
    socket = served.address.replace("http:", "ws:")
    other = browser.new_page()
    other.goto("data:text/html,<p>another site</p>")
    outcome = other.evaluate(
        "url => new Promise(done => { const s = new WebSocket(url);"
        " s.onopen = () => done('open'); s.onerror = () => done('refused'); })",
        socket,
    )
    other.close()
    assert outcome == "refused"


def test_nothing_complained_and_ctrl_c_or_a_kill_ends_it_and_the_next_goes_on(browser, page, served, folder):
    page.wait_for_timeout(200)
    assert complaints(page) == []
    page.close()
    out, err, status = served.interrupt()
    assert status == 0
    assert "Traceback" not in out + err
    killed = Served(folder, "aqua2")
    killed.process.kill()
    killed.process.communicate()
    again = Served(folder, "aqua2")
    try:
        after = browser.new_page()
        after.goto(again.address)
        after.get_by_text("went on with the changes of the last time").wait_for()
        after.close()
        assert Path(folder / "my-aqua2.toml").is_file()
        kept = next(folder.glob(".aqua2-*.studio.toml"))
        assert "width_mm = 90" in kept.read_text()
    finally:
        _, err, status = again.interrupt()
    assert status == 0
    assert "Traceback" not in err
