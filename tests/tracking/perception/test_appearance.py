"""A target by its own colours: where contrast sees nothing of it, and what is not taken for it."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.stats import multivariate_normal

from tracking.perception import ACQUIRED_LOG_ODDS, detect_by_contrast
from tracking.perception.appearance import (
    AS_LARGE,
    EVERY_S,
    GROWING_S,
    MOST_MEDIAN,
    REMEMBERED_S,
    SPREAD,
    AppearanceModel,
    Colours,
)
from tracking.perception.outline import ellipse_share
from tracking.records import Detection

WATER, BALL, STONE = (np.array(light) for light in ([0.02, 0.10, 0.16], [0.015, 0.02, 0.03], [0.03, 0.06, 0.06]))
"""Linear light, red to blue."""
AT, RADIUS = (150, 110), 30
NOTHING = Detection(mask=np.zeros((240, 320), dtype=np.uint8), blobs=(), centroid_px=None)


def scene(thing=BALL, *, at=AT, radius=RADIUS, around=WATER, seed=0):
    """Disc in water with noise of 3 %."""
    light = around * np.ones((240, 320, 1))
    light[disc(at, radius) > 0] = thing
    light *= 1 + 0.03 * np.random.default_rng(seed).standard_normal(light.shape)
    curve = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return np.round(255 * curve).astype(np.uint8)


def disc(at, radius):
    return cv2.circle(np.zeros((240, 320), dtype=np.uint8), at, radius, 255, cv2.FILLED)


def window(at, radius):
    """Everything hidden but a disc."""
    return 255 - disc(at, radius)


def learned(images=5, **scenes):
    """Model of a ball in full view."""
    model = AppearanceModel(area_min_px=100.0)
    for image in range(images):
        crop = scene(seed=image, **scenes)
        model.note(crop, None, detect_by_contrast(crop), image * EVERY_S, regained=False)
    return model


def recalled(model, crop, hidden=None, bare=None, *, detection=NOTHING, expected_px=AT, time_s=1.0, followed=True):
    """What a loop gets, which asks it only where nothing else is found; without `bare` nothing is grown by a margin."""
    if not model.is_asked(detection, expected_px, time_s):
        return detection
    bare = hidden if bare is None else bare
    return model.recalled(detection, crop, hidden, bare, expected_px, followed=followed)


def test_in_a_gap_of_the_robot_it_is_seen_up_to_the_edge():
    """20 px wide, of which a margin of 7 leaves one cell: the ball may go on behind it, though it reaches no edge."""
    hidden, bare = (np.full((240, 320), 255, dtype=np.uint8) for _ in range(2))
    bare[:, 140:160] = hidden[:, 147:153] = 0
    crop = np.where(bare[..., np.newaxis] > 0, 90, scene(seed=4)).astype(np.uint8)
    assert recalled(learned(), crop, hidden) is NOTHING
    (blob,) = recalled(learned(), crop, hidden, bare).blobs
    shown = int(np.count_nonzero(disc(AT, RADIUS)[:, 140:160]))
    assert blob.area_px == pytest.approx(shown, rel=0.05)


def test_likelihood_is_that_of_a_normal_distribution():
    logs = np.random.default_rng(1).multivariate_normal(
        [-3, -2, -2], [[0.1, 0.02, 0], [0.02, 0.2, 0.1], [0, 0.1, 0.3]], 500
    )
    colours = Colours(first=logs.mean(axis=0), second=logs.T @ logs / len(logs))
    covariance = np.cov(logs.T, bias=True) + SPREAD**2 * np.eye(3)
    squared, log_likelihood = colours.log_likelihood(logs.astype(np.float32))
    expected = multivariate_normal(logs.mean(axis=0), covariance).logpdf(logs)
    np.testing.assert_allclose(log_likelihood - expected, 1.5 * np.log(2 * np.pi), atol=1e-4)
    assert squared.mean() == pytest.approx(3, rel=0.1)


def test_a_ball_that_fills_its_window_is_found_by_its_colours_alone():
    """Nothing is left around it to stand out from; what is seen of it is cut on all sides."""
    crop, hidden = scene(seed=9), window(AT, 20)
    assert not any(blob.log_odds >= ACQUIRED_LOG_ODDS for blob in detect_by_contrast(crop, ignored=hidden).blobs)
    found = recalled(learned(), crop, hidden)
    (blob,) = found.blobs
    assert blob.recalled and blob.log_odds == -np.inf
    np.testing.assert_allclose(blob.centroid_px, AT, atol=2)
    np.testing.assert_allclose(found.centroid_px, blob.centroid_px)
    seen = (disc(AT, 20) > 0).sum()
    assert blob.area_px == pytest.approx(seen, rel=0.3)
    assert ((found.mask > 0) & (hidden == 0)).sum() == pytest.approx(blob.area_px, rel=0.1)


@pytest.mark.parametrize(
    "thing, radius",
    [
        pytest.param(STONE, RADIUS, id="another colour"),
        pytest.param(BALL, round(1.1 * RADIUS * AS_LARGE**0.5), id="too large"),
        pytest.param(BALL, round(0.9 * RADIUS / AS_LARGE**0.5), id="too small, and whole"),
        pytest.param(WATER, RADIUS, id="water"),
    ],
)
def test_other_things_are_not_taken_for_it(thing, radius):
    assert recalled(learned(), scene(thing, radius=radius)) is NOTHING


def test_what_contrast_finds_where_it_is_expected_is_left_as_it_is():
    crop = scene(seed=3)
    seen = detect_by_contrast(crop)
    assert recalled(learned(), crop, detection=seen) is seen


@pytest.mark.parametrize("share, by_both", [(0.6, True), (0.4, False)])
def test_what_contrast_finds_most_of_elsewhere_is_found_by_both(share, by_both):
    """And learned from: but of a small part, with something else, its colours tell alone."""
    crop, model = scene(seed=3), learned()
    (seen,) = detect_by_contrast(crop).blobs
    piece = replace(seen, area_px=share * np.pi * RADIUS**2)
    found = recalled(model, crop, detection=replace(NOTHING, blobs=(piece,)), expected_px=(30, 30))
    (elsewhere,) = found.blobs
    assert elsewhere.log_odds == seen.log_odds and elsewhere.recalled is not by_both
    before = model.snapshot()
    model.note(crop, None, found, 10.0, regained=False)
    assert (model.snapshot() != before) is by_both
    model.note(crop, None, found, 10.5, regained=True)
    assert model.snapshot() != before


@pytest.mark.parametrize("way, are_of", [(0.55, False), (0.8, True), (1.2, True)])
def test_what_lies_between_target_and_water_is_neither(way, are_of):
    """Redness, greenness and lightness of a target in clear water, and of a thing that is near to it cell by cell."""
    to_logs = np.linalg.inv([[1, -0.5, -0.5], [0, 1, -1], [0, 1, 0]])
    rng = np.random.default_rng(2)

    def cells(mean, deviation):
        logs = (mean + deviation * rng.standard_normal((3000, 3))) @ to_logs.T
        return logs, Colours(first=logs.mean(axis=0), second=logs.T @ logs / len(logs))

    red, water = np.array([0.79, 0.24, -1.83]), np.array([-0.42, -0.09, -1.66])
    _, target = cells(red, [0.53, 0.2, 0.63])
    _, around = cells(water, [0.25, 0.14, 0.37])
    thing, _ = cells(water + way * (red - water), [0.17, 0.11, 0.45])
    assert np.median(target.log_likelihood(thing)[0]) < MOST_MEDIAN
    assert target.are_of(thing, around) is are_of


@pytest.mark.parametrize("says, counts", [(0.7, 0.7), (-1.9, -np.inf)])
def test_what_contrast_says_for_a_piece_of_it_is_evidence(says, counts):
    """It finds a part of the ball, as brown; the ball's own colours tell how far it goes."""
    crop, model = scene(seed=3), learned()
    (ball,) = recalled(model, crop).blobs
    piece = replace(ball, log_odds=says, area_px=500.0, centroid_px=(160.0, 105.0))
    elsewhere = replace(piece, centroid_px=(30.0, 40.0))
    seen = replace(NOTHING, blobs=(piece, elsewhere))
    assert recalled(model, crop, detection=seen).blobs == (elsewhere, replace(ball, log_odds=counts))


def test_of_two_the_expected_one_is_taken_or_else_the_larger():
    """Two balls, 30 and 25 pixels in radius."""
    crop = np.where(disc((60, 60), 25)[..., np.newaxis] > 0, scene(at=(60, 60), radius=25), scene())
    for expected_px, at in (((60, 60), (60, 60)), (AT, AT), (None, AT)):
        (blob,) = recalled(learned(), crop, expected_px=expected_px).blobs
        np.testing.assert_allclose(blob.centroid_px, at, atol=2)


@pytest.mark.parametrize(("later_s", "grown"), [(0.9 * GROWING_S, False), (1.1 * GROWING_S, True)])
def test_nothing_is_learned_from_what_is_suddenly_twice_as_large(later_s, grown):
    """In one piece with something that passes; but a ball that was not seen for long may have come nearer."""
    model, before = learned(), learned()
    larger = scene(radius=round(1.8 * RADIUS))
    model.note(larger, None, detect_by_contrast(larger), before.snapshot()["whole_s"] + later_s, regained=False)
    assert (model.snapshot() != before.snapshot()) is grown


@pytest.mark.parametrize(("later_s", "learns"), [(0.9 * GROWING_S, False), (1.1 * GROWING_S, True)])
def test_nothing_is_learned_from_a_suddenly_ragged_outline(later_s, learns):
    """Another ball beside the target, which looks like it: together 1.7 times as large, and 0.93 of an ellipse."""
    model, before, crop = learned(), learned(), scene()
    (alone,) = detect_by_contrast(crop).blobs
    both = disc(AT, RADIUS) | disc((AT[0] + 52, AT[1]), 26)
    share = ellipse_share(cv2.moments(both, binaryImage=True))
    assert share == pytest.approx(0.93, abs=0.01)
    blob = replace(alone, area_px=float((both > 0).sum()), ellipse_share=share)
    piece = Detection(mask=both, blobs=(blob,), centroid_px=blob.centroid_px)
    model.note(crop, None, piece, before.snapshot()["whole_s"] + later_s, regained=False)
    assert (model.snapshot() != before.snapshot()) is learns


def test_of_a_target_that_an_edge_has_cut_the_first_whole_outline_is_usual():
    """It is ragged, as of a pale ball, and so are the next: they teach what the first did."""
    model, crop = AppearanceModel(area_min_px=100.0), scene()
    (blob,) = detect_by_contrast(crop).blobs
    ragged = replace(blob, ellipse_share=0.9)
    cut = replace(ragged, box_px=(0, *ragged.box_px[1:]))
    for image, seen in enumerate([cut] * 3 + [ragged] * 3):
        piece = Detection(mask=disc(AT, RADIUS), blobs=(seen,), centroid_px=AT)
        model.note(crop, None, piece, 1.1 * image * EVERY_S, regained=False)
        assert model.snapshot()["noted_s"] == 1.1 * image * EVERY_S


def test_of_a_lost_target_its_colours_are_a_mark_for_a_while():
    """Then what has them is a candidate, as what looks like a target is."""
    model, crop = learned(), scene()
    last_s = 4 * EVERY_S
    (blob,) = recalled(model, crop, time_s=last_s + 0.9 * REMEMBERED_S, followed=False).blobs
    assert blob.log_odds == ACQUIRED_LOG_ODDS and blob.recalled
    assert recalled(model, crop, time_s=last_s + 1.1 * REMEMBERED_S, followed=False) is NOTHING
    model.forget()
    assert recalled(model, crop) is NOTHING


def test_nothing_is_learned_from_what_does_not_look_like_a_target():
    model, crop = AppearanceModel(area_min_px=100.0), scene()
    plain = detect_by_contrast(crop)
    pale = replace(plain, blobs=(replace(plain.blobs[0], log_odds=ACQUIRED_LOG_ODDS - 0.1),))
    model.note(crop, None, pale, 0.0, regained=False)
    assert recalled(model, crop) is NOTHING


def test_it_goes_on_from_a_snapshot():
    model, again = learned(), AppearanceModel(area_min_px=100.0)
    again.restore(json.loads(json.dumps(model.snapshot())))
    assert again.snapshot() == model.snapshot()
    crop = scene(seed=5)
    assert recalled(again, crop).blobs == recalled(model, crop).blobs != ()
    empty = AppearanceModel(area_min_px=100.0)
    again.restore(json.loads(json.dumps(empty.snapshot())))
    assert recalled(again, crop) is NOTHING
