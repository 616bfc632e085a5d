"""Windows: centred ones, fields of view in the water against closed forms, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from optics.camera import PinholeCamera
from optics.ports.port import DomePort, FlatPort, NoPort
from optics.sizing.window import Window, centred_window, field_of_view_window, fraction_window, parsed_window
from optics.train import OpticalTrain

CAMERA = PinholeCamera(width_px=640, height_px=480, fx_px=500.0, fy_px=500.0, cx_px=319.5, cy_px=239.5)
SOLVED_PX = 1e-6
"""The root is found to 1e-9 px; the sides are tangents times 500 px."""


def test_the_whole_image_reaches_half_a_pixel_beyond_its_centres():
    whole = fraction_window(CAMERA, 1.0)
    assert (whole.left_px, whole.top_px, whole.right_px, whole.bottom_px) == (-0.5, -0.5, 639.5, 479.5)
    whole.check_inside(CAMERA)


def test_boundary_runs_round_the_window_and_cells_fill_it():
    window = centred_window(CAMERA, 100, 40)
    boundary = window.boundary(5)
    assert len(boundary) == 20
    np.testing.assert_allclose(boundary[::5], [[269.5, 219.5], [369.5, 219.5], [369.5, 259.5], [269.5, 259.5]])
    cells = window.cells(10, 4)
    np.testing.assert_allclose(cells[[0, -1]], [[274.5, 224.5], [364.5, 254.5]])


@pytest.mark.parametrize(
    ("port", "index"),
    [
        (NoPort(), 1.0),
        (DomePort(radius_m=0.05, thickness_m=0.005), 1.0),
        (FlatPort(distance_m=0.02, thickness_m=0.008), 1.333),
    ],
    ids=["none", "centred dome", "flat"],
)
def test_field_of_view_in_the_water(port, index):
    """A centred dome keeps the angle; behind a flat port Snell's law does: sin(air) = n sin(water)."""
    window = field_of_view_window(CAMERA, port, np.radians(30), np.radians(20))
    expected = [2 * 500 * np.tan(np.arcsin(index * np.sin(np.radians(angle / 2)))) for angle in (30, 20)]
    np.testing.assert_allclose(window.size_px, expected, atol=SOLVED_PX)
    np.testing.assert_allclose(window.centre_px, [319.5, 239.5])


def test_a_field_of_view_that_the_rim_cuts_is_refused_with_what_there_is():
    """A ray of slope 118 / 500 leaves a 20 + 8 mm port 5.97 mm from its axis, one of 119 / 500 at 6.02 mm."""
    port = FlatPort(distance_m=0.02, thickness_m=0.008, aperture_radius_m=0.006)
    whole = 2 * np.degrees(np.arcsin(np.sin(np.arctan(118 / 500)) / 1.333))
    with pytest.raises(
        ValueError, match=f"horizontal field of view above 0 and at most {whole:.2f} degrees in the water"
    ):
        field_of_view_window(CAMERA, port, np.radians(40), np.radians(10))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: fraction_window(CAMERA, 1.5), "a fraction of the image's sides above 0 and at most 1, got 1.5"),
        (lambda: centred_window(CAMERA, 700, 100), "expected a window of at most 640 x 480 px, the whole image"),
        (lambda: Window(left_px=5, top_px=0, right_px=5, bottom_px=9), "left < right and top < bottom, got 5, 0, 5, 9"),
        (lambda: Window(left_px=0, top_px=0, right_px=np.nan, bottom_px=9), "left < right and top < bottom"),
        (lambda: Window(left_px=0, top_px=0, right_px=640, bottom_px=9).check_inside(CAMERA), "u from -0.5 to 639.5"),
        (lambda: field_of_view_window(CAMERA, NoPort(), 2.0, 0.1), "at most 65.24 degrees in the water"),
    ],
)  # fmt: skip
def test_bad_windows_are_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()


FLAT = OpticalTrain(camera=CAMERA, port=FlatPort(distance_m=0.02, thickness_m=0.008))


@pytest.mark.parametrize("text", ["128x96", "0.2", "255.5,191.5,383.5,287.5"])
def test_a_window_may_be_said_in_several_ways(text):
    window = parsed_window(text, FLAT)
    assert (window.left_px, window.top_px, window.right_px, window.bottom_px) == (255.5, 191.5, 383.5, 287.5)


def test_a_window_may_be_said_in_degrees_in_the_water():
    assert parsed_window("20x15deg", FLAT) == field_of_view_window(CAMERA, FLAT.port, *np.radians([20.0, 15.0]))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("wide", r"window wide: expected a fraction \(0.2\), pixels \(320x240\), degrees"),
        ("1,2,3", r"expected a fraction \(0.2\), pixels \(320x240\), degrees"),
        ("2", "expected a fraction of the image's sides above 0 and at most 1, got 2"),
        ("0,0,900,90", "expected a window within the image"),
        ("170x20deg", "degrees in the water, what the image shows through the port, got 170"),
    ],
)
def test_what_is_no_window_is_refused(text, words):
    with pytest.raises(ValueError, match=words):
        parsed_window(text, FLAT)
