"""The detectors of both loops on images with ground truth, and the odds of the default's.

Balls of 0.2 m, 1 to 5 m away, from random headings and gazes, in worlds and waters that differ. The odds come from
other seeds (`benchmarks.detector_fit`), so that the table tells what is found in images that nothing was chosen on.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.detector_fit import fitted_odds, samples_of, samples_of_arena, samples_of_colour
from cad.assembly.meshes import rig_meshes
from dives.evaluation.detector_evaluation import (
    EvaluationImage,
    evaluated_detector,
    evaluation_images,
    score,
)
from dives.views.robot_view import robot_view
from rigs import Rig
from scenes.baking.lit_scene import prepare
from scenes.light.sun import Sun
from scenes.renderer import FastRenderer
from scenes.stage.scene import make_scene
from tracking.perception.target_colours import TARGET_COLOURS

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
"""Case, seed and number of images that the odds come from, beside stills of the arena."""


def main(arguments: Sequence[str]) -> int:
    """Print the table, or with ``--fit`` the weights."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks detector", description=__doc__)
    parser.add_argument("--fit", action="store_true", help="fit the odds again and print them (half an hour)")
    parser.add_argument("--colour", choices=TARGET_COLOURS, default="red", help="of the target that is fitted")
    parser.add_argument("--images", type=int, default=IMAGES, help="of each case of the table")
    parser.add_argument("--detector", action="append", default=[], help="one more, such as onnx:FILE; may be repeated")
    options = parser.parse_args(arguments)
    if options.fit:
        if options.colour == "red":
            samples = samples_of_arena()
            for name, seed, count in FITTED:
                samples += samples_of(_images(name, seed, count))
        else:
            samples = samples_of_colour(options.colour)
        least, most, odds = fitted_odds(samples)
        print(f"least={least.tolist()}, most={most.tolist()}, odds={odds.tolist()}")
        return 0
    shown = ("red-ball", "contrast", *options.detector)
    Console().print(_table(options.images, shown))
    return 0


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
