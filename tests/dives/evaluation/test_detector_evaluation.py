"""The trial of a detector: scores by hand, colours over red, and images that a seed decides."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dives.evaluation.detector_evaluation import EvaluationImage, by_window, evaluation_images, score, target_colours
from rigs import Rig
from scenes.baking.lit_scene import prepare
from scenes.renderer import FastRenderer
from scenes.stage.scene import make_scene
from tracking.perception import ColourWindow, DetectorSettings

RED = DetectorSettings(
    window=ColourWindow(hue_from_deg=340, hue_to_deg=20, saturation_min=0.5),
    smoothing_px=1,
    opening_px=1,
    closing_px=1,
    area_min_px=1,
)
SIDE = 20
"""Of a square target: 400 px, as a disc of a radius of 11.3."""


def image(*, shown_at=None, painted_at=None, colour=(200, 20, 30), empty=False):
    """Target by truth at one place of an 80 x 60 crop, paint at another; (x, y) of the top left pixel."""
    crop = np.full((60, 80, 3), 90, dtype=np.uint8)
    target = np.zeros((60, 80), dtype=bool)
    if shown_at is not None:
        target[shown_at[1] : shown_at[1] + SIDE, shown_at[0] : shown_at[0] + SIDE] = True
    if painted_at is not None:
        crop[painted_at[1] : painted_at[1] + SIDE, painted_at[0] : painted_at[0] + SIDE] = colour
    return EvaluationImage(
        image=crop,
        crop=crop,
        target=target,
        robot=None,
        corners_px=np.zeros((4, 2)),
        distance_m=3.0,
        elevation_deg=0.0,
        over_water=0.8,
        empty=empty,
    )


def test_scores_are_those_counted_by_hand():
    """Seen twice where it is: once 5 px aside, once 30 px aside, once not at all; twice empty, one with paint."""
    found = score(
        [
            image(shown_at=(10, 10), painted_at=(15, 10)),
            image(shown_at=(10, 10), painted_at=(40, 10)),
            image(shown_at=(10, 10)),
            image(painted_at=(5, 5), empty=True),
            image(empty=True),
        ],
        by_window(RED),
    )
    assert (found.seen, found.found, found.wrong, found.empty, found.false_alarms) == (3, 1, 1, 2, 1)
    # Of 2 x 400 marked pixels 15 x 20 are the target's, of which there are 3 x 400.
    assert found.precision == pytest.approx(300 / 800)
    assert found.recall == pytest.approx(300 / 1200)


def test_target_that_is_hardly_seen_counts_neither_way():
    found = score([image(painted_at=(5, 5))], by_window(RED))
    assert (found.seen, found.found, found.wrong, found.empty) == (0, 0, 0, 0)
    assert math.isnan(found.precision) and math.isnan(found.recall)
    assert target_colours([image()]) is None


def test_hues_are_counted_over_red():
    """Hue of (200, 20, b) by Smith's formula: -60 (b - 20) / 180 for b above 20; the other side of red by green."""
    places = {"shown_at": (10, 10), "painted_at": (10, 10)}
    colours = target_colours([image(**places, colour=(200, 20, 50)), image(**places, colour=(200, 50, 20))])
    # Half of OpenCV's steps of 2 degrees, and 5 % towards the other one.
    np.testing.assert_allclose(colours.hue_deg, (-9, 0, 9), atol=1.0)
    np.testing.assert_allclose(colours.saturation, 0.9, atol=1 / 255)
    np.testing.assert_allclose(colours.value, 200 / 255)


@pytest.fixture(scope="module")
def renderer():
    rig = Rig.load("aqua2")
    return FastRenderer(prepare(make_scene(rig, world="blue"), rig, []))


def test_images_are_those_of_their_seed(renderer):
    told = []
    taken, again = (
        evaluation_images(renderer, 6, seed, lambda done, total: told.append((done, total))) for seed in (3, 3)
    )
    for first, second in zip(taken, again, strict=True):
        assert (first.image == second.image).all()
        assert (first.target == second.target).all()
    assert told[:7] == [(done, 6) for done in range(7)]
    # Every sixth is without the target.
    assert [each.empty for each in taken] == [False] * 5 + [True]
    assert not taken[-1].seen
    assert sum(each.seen for each in taken) >= 3
    assert {each.crop.shape for each in taken} == {(240, 320, 3)}
    assert (evaluation_images(renderer, 1, 4)[0].image != taken[0].image).any()
