"""The odds of the default's detector, fitted to pieces of images of which the truth is known.

A piece is the target's when most of its pixels show it, and something else when hardly any do. The images are those of
the detector's table from other seeds, and stills of the arena (`benchmarks.detector_stills`) from seeds that no dive is
judged on.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from benchmarks.detector_stills import colour_stills, stills
from dives.evaluation.detector_evaluation import EvaluationImage
from optics.kernels.arrays import FloatArray
from optics.workers.threads import resting_threads
from scenes.stage.frame import Label
from tracking.perception import DetectorSettings
from tracking.perception.contrast import Contrast, Piece, cut_out
from tracking.perception.contrast_pyramid import ContrastPyramid
from tracking.perception.target_colours import RED, TARGET_COLOURS, TargetColour

SEEDS = range(100, 250)
"""Of the arena; every second one with balls of other colours."""

TABLE_COUNTS = 4
"""Times that a piece of the table's images counts: their balls are farther, at dusk and in other waters than those of
the arena, of which there are 17 times as many pieces."""

MOSTLY, HARDLY = 0.5, 0.1
"""Shares of a piece's pixels that show the target; what lies between is left out."""

KEPT = (1.0, 99.0)
"""Percentiles of the features beyond which the odds do not go on."""

RIDGE = 1.0
"""Of the weights of standardised terms: they are finite where the classes do not overlap."""

STEPS = 40
"""Of Newton's method; it has converged after twenty."""

DIGITS = 2

COLOUR_SEEDS = (100, *range(101, 250, 2))
"""Of the arena, for targets of other colours than red."""

Samples = list[tuple[Contrast, bool]]


def samples_of(images: list[EvaluationImage]) -> Samples:
    """Pieces of the table's images, each as often as it counts, and which of them are the target."""
    return TABLE_COUNTS * [
        sample
        for each in images
        if each.robot is not None
        for sample in _samples(each.crop, each.robot, each.target, np.zeros_like(each.target), each.over_water)
    ]


def samples_of_arena() -> Samples:
    """Pieces of stills of the arena, and which of them are the target; nobody can tell what a red decoy is."""
    samples: Samples = []
    for seed in SEEDS:
        print(f"arena, seed {seed} ...", file=sys.stderr, flush=True)
        with resting_threads():
            for still in stills(seed, others=seed % 2 == 1):
                unknown = (still.label == Label.DECOY) & still.red_decoy
                samples += _samples(
                    still.crop, still.robot, still.label == Label.TARGET, unknown, still.over_water["red"]
                )
    return samples


def fitted_odds(samples: Samples) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Logistic regression, quadratic in the features, as many samples being targets as not.

    Returns
    -------
    least, most : array, shape (k,)
        Of the features: beyond, the odds do not go on.
    odds : array, shape (k + 1, k + 1)
        Upper triangle: weights of 1 and the features, two by two.
    """
    features = np.array([contrast.features() for contrast, _ in samples])
    is_target = np.array([target for _, target in samples])
    least, most = np.percentile(features, KEPT, axis=0).round(DIGITS)
    terms = np.column_stack([np.ones(len(features)), np.clip(features, least, most)])
    first, second = np.triu_indices(terms.shape[1])
    products = terms[:, first] * terms[:, second]
    counted = np.where(is_target, 0.5 / is_target.mean(), 0.5 / (1 - is_target.mean()))
    odds = np.zeros((terms.shape[1], terms.shape[1]))
    odds[first, second] = _weights(products, is_target, counted)
    return least, most, odds.round(DIGITS)


def _weights(terms: FloatArray, is_target: NDArray[np.bool_], counted: FloatArray) -> FloatArray:
    """Weights of terms, shape (n, k) of which the first is 1, by Newton's method; each sample counts so many times."""
    mean, deviation = terms[:, 1:].mean(axis=0), terms[:, 1:].std(axis=0)
    design = np.column_stack([np.ones(len(terms)), (terms[:, 1:] - mean) / deviation])
    weights, ridge = np.zeros(design.shape[1]), np.full(design.shape[1], RIDGE)
    ridge[0] = 0.0
    for _ in range(STEPS):
        expected = 1 / (1 + np.exp(-design @ weights))
        gradient = design.T @ (counted * (is_target - expected)) - ridge * weights
        curvature = (design.T * (counted * expected * (1 - expected))) @ design + np.diag(ridge)
        weights += np.linalg.solve(curvature, gradient)
    scaled = weights[1:] / deviation
    return np.array([weights[0] - scaled @ mean, *scaled])


def samples_of_colour(colour: str) -> Samples:
    """Pieces of stills with balls of all colours that stand out along one, and which of them are balls of it."""
    looked_for, samples = TARGET_COLOURS[colour], Samples()
    for seed in COLOUR_SEEDS:
        print(f"arena, seed {seed} ...", file=sys.stderr, flush=True)
        with resting_threads():
            for still in colour_stills(seed):
                decoy, target = (still.label == each for each in (Label.DECOY, Label.TARGET))
                for piece, mask in _pieces(still.crop, still.robot, looked_for, still.over_water[colour]):
                    shares = decoy[mask].mean(), target[mask].mean()
                    if shares[0] > MOSTLY and still.balls:
                        near = lambda ball, at=piece.blob.centroid_px: math.dist(ball[1], at)  # noqa: E731
                        samples.append((piece.contrast, min(still.balls, key=near)[0] == colour))
                    elif shares[1] > MOSTLY or max(shares) <= HARDLY:
                        samples.append((piece.contrast, False))
    return samples


def _samples(
    crop: NDArray[np.uint8],
    robot: NDArray[np.uint8],
    target: NDArray[np.bool_],
    unknown: NDArray[np.bool_],
    over_water: float,
) -> Iterator[tuple[Contrast, bool]]:
    """What a crop has that stands out by its redness, and whether it is the target."""
    for piece, mask in _pieces(crop, robot, RED, over_water):
        share, is_unknown = target[mask].mean(), unknown[mask].mean() > MOSTLY
        if not is_unknown and not HARDLY < share <= MOSTLY:
            yield piece.contrast, bool(share > MOSTLY)


def _pieces(
    crop: NDArray[np.uint8], robot: NDArray[np.uint8], colour: TargetColour, over_water: float
) -> Iterator[tuple[Piece, NDArray[np.bool_]]]:
    """What a crop has that stands out along a colour, and its pixels."""
    pyramid = ContrastPyramid(crop, robot, colour.contrasts)
    found: list[Piece] = []
    for place in pyramid.places():
        piece = None if any(each.covers(place) for each in found) else cut_out(pyramid, place, colour, over_water)
        if piece is None or piece.blob.area_px < DetectorSettings().area_min_px:
            continue
        found.append(piece)
        mask = np.zeros(crop.shape[:2], dtype=np.uint8)
        piece.mark(mask)
        yield piece, mask > 0
