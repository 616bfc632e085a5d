"""What shows itself in a notebook: rigs and dives as tables of facts, coverage in numbers, frames as images."""

import cv2
import numpy as np

from dives import Dive
from optics.coverage.coverage import compute_coverage
from rigs import Rig
from rigs.display import facts_table
from scenes.stage.frame import Frame


def test_a_table_escapes_what_it_is_told():
    assert "a &lt; b" in facts_table("title", [("name", "a < b")])


def test_a_rig_shows_its_camera_and_mirrors():
    shown = Rig.load("aqua2")._repr_html_()
    assert "<caption>aqua2</caption>" in shown
    assert "Gaze mirror M2" in shown
    assert "Gaze mirror M2" not in Rig.load("bench")._repr_html_()


def test_a_dive_shows_what_it_is():
    shown = Dive.load("spiral")._repr_html_()
    assert "red ball, path: spiral" in shown
    assert "30 frames/s for 60 s" in shown


def test_a_coverage_shows_its_share():
    found = compute_coverage(Rig.load("aqua2"), [], q1=[0.0, 0.1], q2=[0.0, 0.1], columns=4, rows=4, nside=8)
    assert f"{found.covered_fraction:.1%} of all directions" in found._repr_html_()


def test_a_frame_shows_its_radiance_as_srgb():
    flat, none = np.zeros((2, 3), dtype=np.float32), np.zeros((2, 3), dtype=np.uint8)
    radiance = np.zeros((2, 3, 3), dtype=np.float32)
    radiance[..., 2] = 0.2
    frame = Frame(
        radiance=radiance,
        distance_m=flat,
        point_m=radiance,
        normal=radiance,
        label=none,
        region=none,
        instance=none.astype(np.int32),
        target_fraction=flat,
    )
    image = cv2.imdecode(np.frombuffer(frame._repr_png_(), dtype=np.uint8), cv2.IMREAD_COLOR)
    assert (image == [255, 0, 0]).all()  # blue, in OpenCV's order
