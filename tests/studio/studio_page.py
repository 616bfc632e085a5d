"""A studio's process and its page in a real Chromium; tests that drive it are skipped where one is missing."""

import os
import shutil
import signal
import subprocess
import sys
from contextlib import contextmanager

import pytest

from rigs.files import PRESETS

pytest.importorskip("viser", reason="the studio's page needs viser: pip install 'mirrorgaze[studio]'")
playwright = pytest.importorskip(
    "playwright.sync_api", reason="driving a browser needs Playwright: pip install playwright"
)

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
if CHROMIUM is None:
    pytest.skip("there is no Chromium on PATH: apt-get install chromium", allow_module_level=True)

WIDTH_PX = 320
PATIENCE_MS = 600_000
"""Until the page shows something: ends what hangs, and a busy machine compiles the first image's kernels in minutes."""
LOOKS = 100
HARMLESS = ("favicon", "passive event listener")
"""What Chromium says of an icon that is not there, and of viser's own handler where a thing in 3-D is dragged."""


class Served:
    """A studio's process, and its address."""

    def __init__(self, folder, rig, *options):
        self.process = subprocess.Popen(
            [sys.executable, "-m", "mirrorgaze", "studio", rig, "--width-px", str(WIDTH_PX), *options],
            cwd=folder,
            env=os.environ | {"PYTHONPATH": str(PRESETS.parents[1])},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.address = self.process.stdout.readline().strip()

    def interrupt(self):
        """Ctrl-C, what it said until then, and how it ended."""
        self.process.send_signal(signal.SIGINT)
        out, err = self.process.communicate(timeout=600)
        return out, err, self.process.returncode


@contextmanager
def chromium():
    """A browser without a window."""
    with playwright.sync_playwright() as driver:
        options = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=options)
        yield browser
        browser.close()


def opened(browser, served):
    """The page of a studio; what it complains of is kept in `complaints`."""
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.set_default_timeout(PATIENCE_MS)
    page.complaints = []
    page.on("pageerror", lambda error: page.complaints.append(str(error)))
    page.on("console", lambda said: page.complaints.append(said.text) if said.type == "error" else None)
    page.goto(served.address)
    return page


def complaints(page):
    """What the page complained of and should not have."""
    return [said for said in page.complaints if not any(each in said for each in HARMLESS)]


def slider(page, label):
    """Number field of a slider."""
    row = f'//label[text()="{label}"]/ancestor::div[contains(@class, "mantine-Flex-root")][1]'
    return page.locator(f'{row}//input[@inputmode="decimal"]')


def put(page, label, value):
    field = slider(page, label)
    field.fill(f"{value:g}")
    field.press("Enter")


def waited_for(page, is_so):
    """Whether something comes true within some seconds."""
    for _ in range(LOOKS):
        if is_so():
            return True
        page.wait_for_timeout(100)
    return False
