"""A rig's widgets in a notebook: sliders that turn its joints. What they show is tested with the views."""

from __future__ import annotations

import sys

import cv2
import numpy as np
import pytest

from optics.gaze.kinematics import forward_gaze
from optics.gaze.sights import Sights
from optics.layout import Layout
from rigs import Rig
from studio import notebook, views
from studio.notebook import explore
from studio.results import View

RIG = Rig.load("aqua2")


@pytest.fixture
def asked(monkeypatch):
    """Requests in their order; an image is as red as q1 is large."""
    requests = []

    def see(request):
        requests.append(request)
        gaze = forward_gaze(Layout.from_rig(request.rig), *np.radians([request.q1_deg, request.q2_deg]))
        image = np.zeros((120, 160, 3), dtype=np.uint8)
        image[..., 0] = 2 * abs(request.q1_deg)
        return View(
            request=request,
            image=image,
            light="draft",
            target_px=None,
            target_m=np.zeros(3),
            target_radius_m=0.1,
            axis_m=np.zeros((2, 3)),
            cone_m=np.zeros((2, 0, 3)),
            gaze_deg=tuple(float(np.degrees(each)) for each in (gaze.azimuth, gaze.elevation, gaze.roll)),
            region=np.zeros((120, 160), dtype=np.uint8),
            sights=Sights.of(RIG),
            render_ms=12.0,
        )

    monkeypatch.setattr(views, "see", see)
    return requests


def test_a_slider_turns_the_joint_and_the_image_follows(asked):
    image, pan, tilt, overlay, line = explore(RIG, world="blue", depth_m=8.0).children
    assert (pan.min, pan.max) == (RIG.gaze.joints.pan.min_deg, RIG.gaze.joints.pan.max_deg)
    pan.value = 60.0
    tilt.value = 10.0
    overlay.value = "labels"
    assert [(each.q1_deg, each.q2_deg, each.overlay) for each in asked] == [
        (0.0, 0.0, "none"),
        (60.0, 0.0, "none"),
        (60.0, 10.0, "none"),
        (60.0, 10.0, "labels"),
    ]
    assert {(each.surroundings.world, each.surroundings.depth_m) for each in asked} == {("blue", 8.0)}
    shown = cv2.imdecode(np.frombuffer(image.value, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
    assert shown[60, 80, 0] == pytest.approx(120, abs=4)
    # The gaze turns by pan, and by twice the tilt.
    assert "60.0° azimuth, 20.0° elevation" in line.value


def test_without_ipywidgets_a_sentence_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "ipywidgets", None)
    with pytest.raises(ModuleNotFoundError, match=r"mirrorgaze\[notebook\]"):
        explore(RIG)
    assert "notebook" in notebook.MISSING
