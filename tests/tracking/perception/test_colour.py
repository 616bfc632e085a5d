"""The colour window beside the standard library's HSV, its hue over red, opening and closing, and what is refused."""

import colorsys

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tracking.perception import DETECTORS, NARROW_HUE, RED_BALL, WIDE_HUE, ColourWindow, DetectorSettings, colour_mask

ROUNDED_DEG = 2.0
"""OpenCV keeps hue in steps of 2 degrees."""

ROUNDED = 1.5 / 255
"""Saturation and value have 8 bits, the first after a division in fixed point."""

PLAIN = {"smoothing_px": 1, "opening_px": 1, "closing_px": 1}

colours = st.tuples(*[st.integers(0, 255)] * 3)
hues = st.integers(0, 180).map(lambda half: 2.0 * half)


def image_of(rgb, shape=(4, 4)):
    return np.full((*shape, 3), rgb, dtype=np.uint8)


def passes(window, rgb):
    return bool(window.mask(image_of(rgb, (1, 1)))[0, 0])


@st.composite
def windows(draw):
    low, high = sorted((draw(st.floats(0, 1)), draw(st.floats(0, 1))))
    return ColourWindow(
        hue_from_deg=draw(hues),
        hue_to_deg=draw(hues),
        saturation_min=draw(st.floats(0, 1)),
        value_min=low,
        value_max=high,
    )


@given(rgb=colours, window=windows())
def test_window_is_that_of_the_standard_library(rgb, window):
    """Beside `colorsys`, but for colours within rounding of a bound."""
    hue, strength, value = colorsys.rgb_to_hsv(*(channel / 255 for channel in rgb))
    hue_deg, first, last = 360 * hue, window.hue_from_deg, window.hue_to_deg
    near = min(abs((hue_deg - bound + 180) % 360 - 180) for bound in (first, last)) <= ROUNDED_DEG
    near |= abs(strength - window.saturation_min) <= ROUNDED
    near |= min(abs(value - window.value_min), abs(value - window.value_max)) <= ROUNDED
    if near:
        return
    in_hue = first <= hue_deg <= last if first <= last else hue_deg >= first or hue_deg <= last
    expected = in_hue and strength >= window.saturation_min and window.value_min <= value <= window.value_max
    assert passes(window, rgb) == expected


@pytest.mark.parametrize(
    ("rgb", "hue"),
    [((200, 0, 0), 0), ((200, 200, 0), 60), ((0, 200, 0), 120), ((0, 0, 200), 240), ((200, 0, 200), 300)],
)
def test_hue_is_the_angle_of_the_colour_circle(rgb, hue):
    """Closed form: the corners of the colour hexagon. Both ends belong to a window."""
    for first, last in ((hue, (hue + 30) % 360), ((hue - 30) % 360, hue), ((hue - 2) % 360, hue + 2)):
        assert passes(ColourWindow(hue_from_deg=first, hue_to_deg=last), rgb)
    assert not passes(ColourWindow(hue_from_deg=(hue + 4) % 360, hue_to_deg=(hue - 4) % 360), rgb)


def test_red_has_two_names():
    """A window that ends or begins at 360 degrees reaches red no less than one at 0."""
    assert passes(ColourWindow(hue_from_deg=340, hue_to_deg=0), (200, 0, 0))
    assert passes(ColourWindow(hue_from_deg=0, hue_to_deg=10), (200, 0, 0))
    assert passes(ColourWindow(hue_from_deg=340, hue_to_deg=360), (200, 0, 0))
    assert passes(ColourWindow(hue_from_deg=360, hue_to_deg=10), (200, 0, 0))


@given(first=hues, last=hues, seed=st.integers(0, 100))
def test_window_over_red_is_its_two_halves(first, last, seed):
    if first <= last:
        return
    image = np.random.default_rng(seed).integers(0, 256, (8, 8, 3), dtype=np.uint8)
    whole = ColourWindow(hue_from_deg=first, hue_to_deg=last, saturation_min=0.2, value_min=0.1, value_max=0.9)
    halves = [
        ColourWindow(hue_from_deg=a, hue_to_deg=b, saturation_min=0.2, value_min=0.1, value_max=0.9).mask(image)
        for a, b in ((first, 360), (0, last))
    ]
    assert (whole.mask(image) == (halves[0] | halves[1])).all()


def test_full_circle_takes_every_hue():
    image = np.random.default_rng(0).integers(0, 256, (50, 50, 3), dtype=np.uint8)
    assert ColourWindow(hue_from_deg=0, hue_to_deg=360).mask(image).all()


def test_window_says_all_that_is_wrong_with_it():
    with pytest.raises(ValueError) as caught:
        ColourWindow(hue_from_deg=-1, hue_to_deg=361, saturation_min=np.nan, value_min=0.5, value_max=0.4)
    told = str(caught.value)
    for part in (
        "expected hue_from_deg from 0 to 360, got -1",
        "expected hue_to_deg from 0 to 360, got 361",
        "expected saturation_min from 0 to 1, got nan",
        "expected value_min up to value_max, got 0.5 and 0.4",
    ):
        assert part in told


def test_settings_say_all_that_is_wrong_with_them():
    with pytest.raises(ValueError) as caught:
        DetectorSettings(smoothing_px=0, opening_px=4, closing_px=-3, area_min_px=-1, circularity_min=2, aspect_max=0.5)
    told = str(caught.value)
    for part in (
        "expected an odd smoothing_px from 1 to 99, got 0",
        "expected an odd opening_px from 1 to 99, got 4",
        "expected an odd closing_px from 1 to 99, got -3",
        "expected area_min_px of at least 0, got -1",
        "expected circularity_min from 0 to 1, got 2",
        "expected aspect_max of at least 1, got 0.5",
    ):
        assert part in told


def drawn(*shapes):
    """Dull red discs and holes (x, y, radius, colour) on blue water."""
    image = image_of((40, 60, 90), (120, 160))
    for x, y, radius, colour in shapes:
        cv2.circle(image, (x, y), radius, colour, -1)
    return image


RED, BLUE = (80, 50, 55), (40, 60, 90)


def test_opening_removes_specks_and_closing_fills_holes():
    settings = DetectorSettings(smoothing_px=1)
    speck = (20, 20, 3, RED)
    holes = [(78, 58, 2, BLUE), (84, 63, 1, BLUE)]
    found = colour_mask(drawn((80, 60, 20, RED), *holes, speck), settings)
    whole = colour_mask(drawn((80, 60, 20, RED)), DetectorSettings(**PLAIN))
    assert not found[:40, :40].any()
    # Opening and closing round the rim of a disc by less than a pixel around it.
    assert (found != whole).sum() < 2 * np.pi * 20
    assert found[58, 78] and found[63, 84]
    assert not colour_mask(drawn((80, 60, 20, RED), *holes), DetectorSettings(**PLAIN))[58, 78]


def test_elements_are_discs():
    """A square loses its corners when it is opened with a disc, and only them."""
    image = image_of(BLUE, (60, 60))
    image[20:40, 20:40] = RED
    found = colour_mask(image, DetectorSettings(smoothing_px=1, opening_px=9, closing_px=1))
    assert not found[20, 20] and found[20, 30] and found[30, 20] and found[24, 24]


def test_smoothing_takes_the_noise_out_of_pale_colours():
    rng = np.random.default_rng(5)
    noisy = np.clip(image_of((62, 56, 60), (120, 160)) + rng.normal(0, 4, (120, 160, 3)), 0, 255).astype(np.uint8)
    shares = [
        (colour_mask(noisy, DetectorSettings(smoothing_px=side, opening_px=1, closing_px=1)) > 0).mean()
        for side in (1, 3, 5)
    ]
    assert shares[0] < shares[1] < shares[2]


@pytest.mark.parametrize("name", DETECTORS)
def test_black_and_white_images_hold_no_target(name):
    for level in (0, 255):
        assert not colour_mask(image_of((level,) * 3, (240, 320)), DETECTORS[name]).any()


def test_wide_hue_is_wider_than_the_others():
    image = np.random.default_rng(0).integers(20, 110, (200, 200, 3), dtype=np.uint8)
    shares = [settings.window.mask(image).mean() for settings in (NARROW_HUE, RED_BALL, WIDE_HUE)]
    assert shares[0] < shares[1] < shares[2]


@pytest.mark.parametrize(
    "crop", [np.zeros((10, 10), dtype=np.uint8), np.zeros((10, 10, 3)), np.zeros((4, 0, 3), dtype=np.uint8), [1, 2]]
)
def test_anything_but_a_image_is_refused(crop):
    for take in (RED_BALL.window.mask, lambda each: colour_mask(each, RED_BALL)):
        with pytest.raises(ValueError, match="of uint8, shape"):
            take(crop)
