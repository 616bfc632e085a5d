"""The detectors of both loops on images with ground truth, and the weights of the default's log odds.

Balls of 0.2 m, 1 to 5 m away, from random headings and gazes, in worlds and waters that differ. The weights come from
the seeds `FITTED`, the table from another, so that it tells what is found in images that nothing was chosen on.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from cad.assembly.meshes import rig_meshes
from dives.evaluation.detector_evaluation import (
    LEAST_RADIUS_PX,
    EvaluationImage,
    evaluated_detector,
    evaluation_images,
    score,
)
from dives.views.robot_view import robot_view
from optics.kernels.arrays import FloatArray
from rigs import Rig
from scenes.baking.lit_scene import prepare
from scenes.light.sun import Sun
from scenes.renderer import FastRenderer
from scenes.stage.scene import make_scene
from tracking.perception import DetectorSettings
from tracking.perception.contrast import JUDGED, Piece, cut_out
from tracking.perception.contrast_pyramid import ContrastPyramid

CASES: dict[str, dict[str, Any]] = {
    "tank": {"world": "tank", "depth_m": 1.0},
    "reef, IB": {"world": "reef", "depth_m": 6.0, "jerlov_type": "IB"},
    "reef, IB, dusk": {
        "world": "reef",
        "depth_m": 15.5,
        "jerlov_type": "IB",
        "cloud": 1.0,
        "sun": Sun(elevation_deg=5.0, azimuth_deg=120.0),
    },
    **{
        f"open water, {water}": {"world": "blue", "depth_m": 5.0, "jerlov_type": water}
        for water in ("IB", "II", "III", "1C", "3C")
    },
}
"""Arguments of `make_scene`; the one at dusk is the preset `dark`."""

SEED, IMAGES = 1, 60

FITTED = [(name, 0, IMAGES) for name in CASES] + [("reef, IB", 2, 180), ("reef, IB, dusk", 2, 180)]
"""Case, seed and number of images that the weights come from: reefs, where there is most to be confused with, weigh
most."""

RIDGE = 1e-2
"""Of the weights of standardised features: they are finite where the classes do not overlap."""

STEPS = 30
"""Of Newton's method; it has converged after ten."""


def main(arguments: Sequence[str]) -> int:
    """Print the table, or with ``--fit`` the weights."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks detector", description=__doc__)
    parser.add_argument("--fit", action="store_true", help="fit the weights of the log odds again and print them")
    parser.add_argument("--images", type=int, default=IMAGES, help="of each case of the table")
    parser.add_argument("--detector", action="append", default=[], help="one more, such as onnx:FILE; may be repeated")
    options = parser.parse_args(arguments)
    if options.fit:
        weights, bias = fitted(*_samples())
        print(f"WEIGHTS = {weights.round(2).tolist()}, BIAS = {bias:.2f}")
        return 0
    shown = ("red-ball", "contrast", *options.detector)
    Console().print(_table(options.images, shown))
    return 0


def fitted(features: FloatArray, is_target: FloatArray) -> tuple[FloatArray, float]:
    """Weights and bias of a logistic regression by Newton's method.

    Parameters
    ----------
    features : array, shape (n, k)
    is_target : array, shape (n,)
        1 or 0.
    """
    mean, deviation = features.mean(axis=0), features.std(axis=0)
    design = np.column_stack([(features - mean) / deviation, np.ones(len(features))])
    weights = np.zeros(design.shape[1])
    for _ in range(STEPS):
        expected = 1 / (1 + np.exp(-design @ weights))
        gradient = design.T @ (is_target - expected) - RIDGE * weights
        curvature = (design.T * (expected * (1 - expected))) @ design + RIDGE * np.eye(len(weights))
        weights += np.linalg.solve(curvature, gradient)
    scaled = weights[:-1] / deviation
    return scaled, float(weights[-1] - scaled @ mean)


def _samples() -> tuple[FloatArray, FloatArray]:
    """Features of pieces, and which of them are the target; those that touch its rim are left out."""
    features, is_target = [], []
    for name, seed, count in FITTED:
        for each in _images(name, seed, count):
            if not (each.seen or each.empty):
                continue
            v, u = np.nonzero(each.clear)
            radius = max(math.sqrt(len(u) / math.pi), LEAST_RADIUS_PX)
            for piece in _pieces(each):
                if piece.blob.area_px < DetectorSettings().area_min_px:
                    continue
                away = math.dist(piece.blob.centroid_px, (u.mean(), v.mean())) if each.seen else math.inf
                if away < radius or away >= 2 * radius:
                    features.append(piece.contrast.features())
                    is_target.append(float(away < radius))
    return np.array(features), np.array(is_target)


def _pieces(each: EvaluationImage) -> Iterator[Piece]:
    """What the default loop would judge."""
    pyramid = ContrastPyramid(each.crop, each.robot)
    found: list[Piece] = []
    for place in pyramid.places():
        if len(found) < JUDGED and not any(piece.covers(place) for piece in found):
            piece = cut_out(pyramid, place)
            found += [] if piece is None else [piece]
    yield from found


def _images(name: str, seed: int, count: int) -> list[EvaluationImage]:
    print(f"{name}, seed {seed} ...", file=sys.stderr, flush=True)
    rig = Rig.load("aqua2")
    parts = rig_meshes(rig)
    renderer = FastRenderer(prepare(make_scene(rig, **CASES[name]), rig, parts))
    return evaluation_images(renderer, count, seed, view=robot_view(rig, parts))


def _table(count: int, shown: Sequence[str]) -> Table:
    table = Table("world, water", "seen", *(f"{name}: found, wrong; false alarms" for name in shown))
    for case in CASES:
        images = _images(case, SEED, count)
        scores = [score(images, evaluated_detector(name)) for name in shown]
        table.add_row(
            case,
            str(scores[0].seen),
            *(f"{each.found}, {each.wrong}; {each.false_alarms} of {each.empty}" for each in scores),
        )
    return table
