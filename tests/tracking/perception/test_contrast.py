"""Detection by contrast: what no camera setting may change, what is told from red, and the balls of a rendered sea."""

import math

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tracking.perception import ACQUIRED_LOG_ODDS, detect_by_contrast
from tracking.perception.colour import OVER_WATER
from tracking.perception.contrast import LEAST_LOG_ODDS, Contrast, cut_out
from tracking.perception.contrast_pyramid import ContrastPyramid, median_and_spread
from tracking.perception.target_colours import ACROSS, ALONG, RED, TARGET_COLOURS

WATER = np.array([0.02, 0.10, 0.16])
"""Linear light of open water, red to blue: a hue of 208 degrees."""
BALL = np.array([0.015, 0.02, 0.03])
"""Linear light of a ball in it: darker in every channel, and least in red."""
CELL_PX = 4
"""Of the level on which the largest balls are cut out; a centroid of hundreds of cells is known much better."""
CENTROID_PX = 1.0
NOISE = 0.03
"""Standard deviation of the drawn noise, of the light."""


def srgb(linear):
    light = np.clip(linear, 0, 1)
    curve = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return np.round(255 * curve).astype(np.uint8)


def scene(ball=BALL, *, at=(150, 110), radius=30, gains=(1.0, 1.0, 1.0), seed=0):
    """Ball in water that brightens upwards, with noise; gains are those of white balance, gain and exposure."""
    rng = np.random.default_rng(seed)
    light = WATER * np.linspace(1.3, 0.8, 240)[:, np.newaxis, np.newaxis] * np.ones((1, 320, 1))
    disc = cv2.circle(np.zeros((240, 320), dtype=np.uint8), at, radius, 1, cv2.FILLED) > 0
    light[disc] = ball
    light *= 1 + NOISE * rng.standard_normal(light.shape)
    return srgb(light * gains), disc


@pytest.mark.parametrize("radius", [14, 20, 30, 45, 70])
def test_a_ball_is_found_in_any_size(radius):
    """From 5 m to 1 m of aqua2's crop."""
    crop, disc = scene(radius=radius)
    found = detect_by_contrast(crop)
    assert found.blobs[0].log_odds > ACQUIRED_LOG_ODDS
    np.testing.assert_allclose(found.blobs[0].centroid_px, (150, 110), atol=CENTROID_PX)
    # Smoothing and opening move the rim by a cell at most.
    assert found.blobs[0].area_px == pytest.approx(disc.sum(), rel=2 * CELL_PX / radius)
    assert (found.mask[disc] > 0).mean() > 0.9


@given(gains=st.tuples(*(st.floats(0.8, 4.0) for _ in range(3))))
def test_white_balance_and_exposure_change_nothing(gains):
    """A factor a channel is a constant in the logarithm; what is left is rounding to 8 bits."""
    plain, balanced = (detect_by_contrast(scene(gains=each)[0]).blobs[0] for each in ((1.0, 1.0, 1.0), gains))
    np.testing.assert_allclose(balanced.centroid_px, plain.centroid_px, atol=CENTROID_PX)
    assert balanced.log_odds == pytest.approx(plain.log_odds, abs=1.0)


@pytest.mark.parametrize(
    "thing",
    [
        pytest.param(WATER * 0.3, id="shadow"),
        pytest.param(np.array([0.02, 0.12, 0.10]), id="green"),
        pytest.param(np.array([0.12, 0.39, 0.56]), id="white, near"),
        pytest.param(np.array([0.06, 0.06, 0.012]), id="yellow"),
    ],
)
def test_what_is_no_red_thing_is_not_acquired(thing):
    """The white one is as light, and as much redder than the water, as nine of ten that are 0.5 to 1.2 m away.

    Stills of the arena, 236 of white balls; the light on them has lost its red on its way down.
    """
    blobs = detect_by_contrast(scene(thing)[0]).blobs
    assert all(blob.log_odds < ACQUIRED_LOG_ODDS for blob in blobs)


@pytest.mark.parametrize("distance_m", [0.8, 1.5, 3.0])
def test_a_black_thing_is_no_target_where_red_is_left(distance_m):
    """What is seen of it is the water before it: of each channel 1 - exp(-c r), with c of Jerlov's type IB at 5 m."""
    black = WATER * (1 - np.exp(-np.array([0.27, 0.19, 0.17]) * distance_m))
    deep, clear = (detect_by_contrast(scene(black)[0], over_water=each).blobs for each in (-1.0, OVER_WATER))
    assert all(blob.log_odds < ACQUIRED_LOG_ODDS for blob in clear)
    # The target is as black where no red is left.
    assert deep and (not clear or deep[0].log_odds > clear[0].log_odds)


@pytest.mark.parametrize("seed", range(5))
def test_water_alone_holds_nothing_that_is_acquired(seed):
    crop, _ = scene(radius=0, ball=WATER, seed=seed)
    assert all(blob.log_odds < ACQUIRED_LOG_ODDS for blob in detect_by_contrast(crop).blobs)


def test_what_is_ignored_is_neither_target_nor_surroundings():
    crop, disc = scene()
    grown = cv2.dilate(disc.astype(np.uint8), np.ones((9, 9), dtype=np.uint8)) * np.uint8(255)
    assert detect_by_contrast(crop, ignored=grown).blobs == ()
    # Something much redder beside it, hidden, changes nothing of the ball.
    beside = np.zeros((240, 320), dtype=np.uint8)
    beside[:, 200:] = 255
    painted = crop.copy()
    painted[:, 200:] = (250, 10, 10)
    plain, hidden = (detect_by_contrast(each, ignored=beside) for each in (crop, painted))
    assert plain.blobs == hidden.blobs
    assert plain.blobs[0].log_odds > ACQUIRED_LOG_ODDS


def test_too_small_a_blob_is_none():
    crop, disc = scene()
    assert detect_by_contrast(crop, 0.7 * disc.sum()).blobs
    assert detect_by_contrast(crop, 1.5 * disc.sum()).blobs == ()


def test_what_is_expected_is_judged_first():
    """Two more things stand out more than the ball that is followed: without a guess they use up what is judged."""
    crop, _ = scene(radius=20, at=(60, 120))
    for at in ((160, 60), (260, 170)):
        other, disc = scene(BALL * [2.5, 1, 1], radius=20, at=at)
        crop[disc] = other[disc]
    assert not any(math.dist(blob.centroid_px, (60, 120)) < 20 for blob in detect_by_contrast(crop).blobs)
    (followed,) = detect_by_contrast(crop, expected_px=(63.0, 118.0)).blobs
    assert math.dist(followed.centroid_px, (60, 120)) < CENTROID_PX


def test_where_a_large_ball_looks_like_itself_nothing_dark_is_sought():
    """A place on its rim stands out most, farther from its middle than a thing of that size would be wide."""
    crop, disc = scene(radius=62, at=(160, 120))
    red, rim = scene(BALL * [3, 1, 1], radius=10, at=(160, 68))
    crop[rim] = red[rim]
    cv2.circle(crop, (270, 120), 20, (5, 10, 12), -1)
    (followed,) = detect_by_contrast(crop, expected_px=(160.0, 120.0)).blobs
    assert followed.area_px == pytest.approx(disc.sum(), rel=0.1)


def in_sunlit_water(*balls):
    """Balls lit from above, in the order in which they hide each other, in clear water as white balance shows it.

    Each is its middle, its radius, and the light of its lower half, which is seen from above, and of its other one.
    """
    rng = np.random.default_rng(0)
    light = [0.16, 0.215, 0.242] * np.linspace(0.82, 1.13, 240)[:, np.newaxis, np.newaxis] * np.ones((1, 320, 1))
    for at, radius, lit, shaded in balls:
        disc = cv2.circle(np.zeros((240, 320), dtype=np.uint8), at, radius, 1, cv2.FILLED) > 0
        is_lit = np.arange(240)[:, np.newaxis] >= at[1] + 8
        light[disc & is_lit], light[disc & ~is_lit] = lit, shaded
    return srgb(light * (1 + NOISE * rng.standard_normal(light.shape)))


def test_a_ball_beside_a_larger_one_of_another_colour_is_told_from_it():
    """Colours of a rendered dive: grey is redder than the water, and in one piece with the red ball that it touches."""
    grey = ((90, 110), 55, [0.75, 0.58, 0.43], [0.06, 0.065, 0.066])
    red = ((172, 112), 28, [0.53, 0.2, 0.15], [0.08, 0.067, 0.068])
    assert all(blob.log_odds < ACQUIRED_LOG_ODDS for blob in detect_by_contrast(in_sunlit_water(grey)).blobs)
    found = detect_by_contrast(in_sunlit_water(grey, red)).blobs[0]
    assert found.log_odds > ACQUIRED_LOG_ODDS
    assert math.dist(found.centroid_px, (172, 112)) < CELL_PX
    assert found.area_px == pytest.approx(math.pi * 28**2, rel=0.15)


def test_blobs_and_mask_are_those_that_are_likely():
    crop, _ = scene()
    found = detect_by_contrast(crop)
    assert all(blob.log_odds >= LEAST_LOG_ODDS for blob in found.blobs)
    assert set(np.unique(found.mask)) <= {0, 255}
    assert detect_by_contrast(np.zeros((240, 320, 3), dtype=np.uint8)).blobs == ()
    assert detect_by_contrast(np.full((1, 1, 3), 90, dtype=np.uint8)).blobs == ()
    with pytest.raises(ValueError, match="expected crop of uint8"):
        detect_by_contrast(np.zeros((240, 320, 3)))


def test_a_ball_larger_than_its_window_is_cut_out_whole():
    """Cut out where its top alone stands out, it would go on past the window."""
    crop, disc = scene(radius=70, at=(160, 120))
    pyramid = ContrastPyramid(crop, None, RED.contrasts)
    pieces = [cut_out(pyramid, place, RED, OVER_WATER) for place in pyramid.places()]
    areas = [piece.blob.area_px for piece in pieces if piece is not None]
    assert max(areas) == pytest.approx(disc.sum(), rel=0.1)


def test_contrasts_are_differences_of_logarithms():
    """Of the drawn ball: ln R - (ln G + ln B) / 2 and so on, beside the water at its height."""
    crop, _ = scene(radius=45)
    pyramid = ContrastPyramid(crop, None, RED.contrasts)
    piece = max(
        filter(None, (cut_out(pyramid, each, RED, OVER_WATER) for each in pyramid.places())),
        key=lambda each: each.blob.log_odds,
    )
    around = WATER * np.interp(110, [0, 239], [1.3, 0.8])
    red, green, blue = np.log(BALL / around)
    # The rim's cells hold both, and so does their smoothing.
    assert piece.contrast.along == pytest.approx(red - (green + blue) / 2, rel=0.2)
    assert piece.contrast.across == pytest.approx(green - blue, abs=0.1)
    assert piece.contrast.lightness == pytest.approx(green, rel=0.2)
    assert piece.contrast.aspect == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("dark, found", [(0.25, True), (0.5, False)])
def test_before_the_light_a_target_is_found_by_its_darkness_where_it_is_expected(dark, found):
    """A grey disc before a glow that is four times as bright in its middle as at its edge; half of it is too much."""
    down, right = np.mgrid[:240, :320]
    light = (0.2 + 0.6 * np.exp(-(((right - 170) / 90) ** 2) - ((down - 100) / 90) ** 2))[..., np.newaxis] * np.ones(3)
    disc = cv2.circle(np.zeros((240, 320), dtype=np.uint8), (150, 110), 30, 1, cv2.FILLED) > 0
    light[disc] *= dark
    crop = srgb(light * (1 + NOISE * np.random.default_rng(0).standard_normal(light.shape)))
    assert not any(blob.silhouette for blob in detect_by_contrast(crop).blobs)
    silhouettes = [blob for blob in detect_by_contrast(crop, expected_px=(160, 125)).blobs if blob.silhouette]
    assert len(silhouettes) == found
    for blob in silhouettes:
        np.testing.assert_allclose(blob.centroid_px, (150, 110), atol=CENTROID_PX)
        assert blob.area_px == pytest.approx(disc.sum(), rel=2 * CELL_PX / 30)
        assert blob.log_odds < ACQUIRED_LOG_ODDS


def test_a_ball_that_looks_like_itself_is_no_silhouette():
    crop, _ = scene()
    assert not detect_by_contrast(crop, expected_px=(150, 110)).blobs[0].silhouette


INHERENT = {
    "orange": (1.7, 0.2, -1.3),
    "yellow": (2.2, 1.3, -0.7),
    "green": (1.0, 0.6, -0.6),
    "white": (2.5, 1.8, 1.4),
}
"""Logarithms of light over that of open water in IB at 5 m, from near by (`scenes.light.inherent_contrast`)."""


@pytest.mark.parametrize("colour", INHERENT)
def test_a_ball_of_each_colour_is_found_by_those_who_look_for_it(colour):
    looked_for, contrast = TARGET_COLOURS[colour], np.array(INHERENT[colour])
    # Of the contrast in red, green and blue, 2 m of IB leave so much (exp -c r).
    crop, _ = scene(WATER * (1 + np.expm1(contrast) * [0.35, 0.7, 0.75]))
    known = float(contrast @ looked_for.over_water)
    found = detect_by_contrast(crop, colour=looked_for, over_water=known).blobs[0]
    assert found.log_odds > ACQUIRED_LOG_ODDS
    np.testing.assert_allclose(found.centroid_px, (150, 110), atol=CENTROID_PX)
    red = detect_by_contrast(scene()[0], colour=looked_for, over_water=known).blobs
    assert all(blob.log_odds < ACQUIRED_LOG_ODDS for blob in red)


def test_odds_fall_with_what_speaks_against_a_red_target():
    usual = {"standing_out": 10, "clearness": 5, "along": 0.5, "across": 0.06, "lightness": -0.5, "aspect": 1.3}
    usual |= {"over_water": OVER_WATER}
    best = RED.log_odds(Contrast(**usual).features())
    for worse in ({"standing_out": 2}, {"clearness": 1}, {"across": 0.5}, {"lightness": 0.5}, {"aspect": 4}):
        assert RED.log_odds(Contrast(**usual | worse).features()) < best


def test_spread_is_that_of_a_normal_distribution_but_for_a_few():
    values = np.random.default_rng(1).normal(3.0, 0.5, 20_000).astype(np.float32)
    values[:1000] = 100.0
    # The standard error of a MAD of so many is 0.6 %; 5 % of outliers move it by 7 %.
    assert median_and_spread(values)[1] == pytest.approx(0.5, rel=0.1)
    assert median_and_spread(np.array([5, 1, 3], dtype=np.float32))[0] == 3


@pytest.mark.parametrize("colour", TARGET_COLOURS.values(), ids=TARGET_COLOURS.keys())
def test_what_stands_out_by_more_than_anything_seen_is_judged_by_its_hue(colour):
    """A ball of 0.2 m half a metre away stands out twice as much as any that the odds were fitted to."""
    most = colour.most[ALONG]
    as_much = np.array([1.0, 1.0, most, 0.3 * most, -0.3, 0.1, 0.5])
    more = as_much.copy()
    more[[ALONG, ACROSS]] *= 2
    assert colour.log_odds(more) == pytest.approx(colour.log_odds(as_much))
    other_hue = as_much.copy()
    other_hue[ALONG] *= 2
    assert colour.log_odds(other_hue) != pytest.approx(colour.log_odds(as_much))


def test_a_silhouette_is_sought_where_it_is_expected_whatever_is_elsewhere():
    """A black disc where the target is expected, and a red one far from it: which is followed its place must tell."""
    crop, _ = scene(WATER * 0.15)
    cv2.circle(crop, (285, 40), 22, (200, 60, 60), -1)
    blobs = detect_by_contrast(crop, expected_px=(150.0, 110.0)).blobs
    (dark,) = [blob for blob in blobs if blob.silhouette]
    np.testing.assert_allclose(dark.centroid_px, (150, 110), atol=CENTROID_PX)
    assert blobs[0].log_odds > ACQUIRED_LOG_ODDS and not blobs[0].silhouette
