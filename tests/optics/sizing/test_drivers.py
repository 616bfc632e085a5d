"""What drives a mirror's sides: closed forms of a narrow window, and the sizes that sizing gives."""

from __future__ import annotations

import numpy as np
import pytest

from optics.sizing.drivers import side_drivers
from optics.sizing.gaze_range import GazeRange
from optics.sizing.limits import Request
from optics.sizing.sizing import size_mirrors
from optics.sizing.window import centred_window
from optics.train import OpticalTrain
from rigs import Rig

RIG = Rig.load("aqua2")
REQUEST = Request(
    window=centred_window(OpticalTrain.bare(RIG).camera, 40, 30),
    gaze=GazeRange(first=(0.0, 0.0), second=(-np.pi / 6, np.pi / 9), in_joints=False),
    margin_m=0.0,
    angle_tolerance=0.0,
)


def test_the_steepest_gaze_drives_the_height_of_m2() -> None:
    # Its height grows as 1 / cos(45 degrees - tilt): the lowest gaze is the one that grazes most.
    found = {(driver.mirror, driver.side): driver for driver in side_drivers(RIG, REQUEST)}
    assert set(found) == {(mirror, side) for mirror in ("M1", "M2") for side in ("width", "height")}
    height = found["M2", "height"]
    assert height.gaze == pytest.approx((0.0, -np.pi / 6), abs=1e-12)
    assert height.q2 == pytest.approx(-np.pi / 12)
    assert found["M1", "width"].gaze is None
    window = REQUEST.window
    for driver in found.values():
        (u, v) = driver.pixel
        assert u in {window.left_px, window.right_px} or v in {window.top_px, window.bottom_px}


def test_lengths_are_those_of_the_rectangles() -> None:
    sizing = size_mirrors(RIG, REQUEST)
    assert sizing.m1 is not None and sizing.m2 is not None
    lengths = [driver.length_m for driver in side_drivers(RIG, REQUEST)]
    sides = [*np.ptp(sizing.m1.corners_m("rectangle"), axis=0), *np.ptp(sizing.m2.corners_m("rectangle"), axis=0)]
    assert lengths == pytest.approx(sides, rel=1e-3)


def test_what_the_joints_do_not_reach_drives_nothing() -> None:
    unreached = GazeRange(first=(np.pi, np.pi), second=(-1.5, -1.5), in_joints=False)
    assert side_drivers(RIG, Request(window=REQUEST.window, gaze=unreached)) == ()
