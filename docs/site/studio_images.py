"""Picture and film of the studio for the manual: `python -m docs.site.studio_images`, with Playwright, Chromium."""

from __future__ import annotations

import io
import re
import shutil
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from playwright.sync_api import sync_playwright

from studio.server import served
from studio.session import Session

IMAGES = Path(__file__).resolve().parents[1] / "images"
WIDTH_PX, HEIGHT_PX = 1280, 800
FILM_PX = (800, 500)
FRAMES, FRAME_MS = 16, 160
COLOURS = 256
PATIENCE_MS = 240_000
DESIGN, VERDICT = "Design", "Verdict"


def main() -> None:
    """Write studio.png and studio.webp."""
    with (
        tempfile.TemporaryDirectory() as folder,
        served(Session("aqua2", folder=Path(folder))) as address,
        sync_playwright() as driver,
    ):
        options = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=options)
        page = browser.new_page(viewport={"width": WIDTH_PX, "height": HEIGHT_PX})
        page.set_default_timeout(PATIENCE_MS)
        page.goto(address)
        page.get_by_text(re.compile("full light")).wait_for()
        page.get_by_role("tab", name=VERDICT).click()
        page.get_by_text("screw access").wait_for()
        # Chromium without a graphics card says so over the picture.
        page.get_by_role("alert").get_by_role("button").click()
        _turn(page, 30.0, -10.0)
        _picture(page).quantize(COLOURS, method=Image.Quantize.MAXCOVERAGE).save(IMAGES / "studio.png", optimize=True)
        _film(page)
        browser.close()


def _film(page: Any) -> None:
    page.get_by_role("tab", name=DESIGN).click()
    angles = 2 * np.pi * np.arange(FRAMES) / FRAMES
    frames = []
    for angle in angles:
        _turn(page, 30.0 * float(np.cos(angle)), 12.0 * float(np.sin(angle)))
        frames.append(_picture(page).resize(FILM_PX))
    frames[0].save(
        IMAGES / "studio.webp", save_all=True, append_images=frames[1:], duration=FRAME_MS, loop=0, quality=50
    )


def _turn(page: Any, q1_deg: float, q2_deg: float) -> None:
    """Put the joints somewhere, and wait for the image from there."""
    for label, value in (("q1, pan (deg)", q1_deg), ("q2, tilt (deg)", q2_deg)):
        row = f'//label[text()="{label}"]/ancestor::div[contains(@class, "mantine-Flex-root")][1]'
        field = page.locator(f'{row}//input[@inputmode="decimal"]')
        field.fill(f"{value:.1f}")
        field.press("Enter")
    page.wait_for_timeout(1000)


def _picture(page: Any) -> Image.Image:
    return Image.open(io.BytesIO(page.screenshot())).convert("RGB")


if __name__ == "__main__":
    main()
