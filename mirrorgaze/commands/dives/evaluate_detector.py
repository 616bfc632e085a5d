"""Detector evaluation: how often the target is found in images with ground truth, and what colour it has there."""

from __future__ import annotations

from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mirrorgaze.options import JsonOption, RigArgument
from mirrorgaze.output import print_json, print_progress, print_step, print_table
from mirrorgaze.scene_options import SceneOptions

if TYPE_CHECKING:
    from dives.evaluation.detector_evaluation import DetectorResults

DRAWN = 4
"""Images of the figure."""

REEF = SceneOptions(world="reef")


def evaluate_detector(
    rig: RigArgument,
    scene: SceneOptions = REEF,
    detector: Annotated[
        str, typer.Option(help="Detector: contrast, red-ball, narrow-hue, wide-hue, onnx:FILE.")
    ] = "contrast",
    images: Annotated[
        int, typer.Option(metavar="N", help="Number of images; every sixth is without the target.", min=1)
    ] = 60,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write a PNG with images, crops and masks."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Evaluate a detector on images with ground truth.

    Renders the target at random places, 1 to 5 m away, and counts detections by distance: found is a centroid within
    the target's radius of the true one, wrong is one elsewhere. Hue, saturation and value are medians of the target's
    pixels, from 5 to 95 % of the images: what a colour window has to let through.

    \b
    Example:
      mirrorgaze evaluate-detector aqua2 --world reef --detector wide-hue -o evaluation.png
    """
    from cad.assembly.meshes import rig_meshes
    from dives.evaluation.detector_evaluation import evaluated_detector, evaluation_images, results_by_distance
    from dives.views.robot_view import robot_view
    from mirrorgaze.loading import load_usable_rig
    from scenes.baking.lit_scene import prepare
    from scenes.image import check_image_path
    from scenes.renderer import FastRenderer

    chosen = evaluated_detector(detector)
    loaded = load_usable_rig(rig)
    loaded.require_gaze()
    if output is not None:
        check_image_path(output, ".png")
    print_step("light ...")
    parts = rig_meshes(loaded)
    renderer = FastRenderer(prepare(scene.scene(loaded), loaded, parts))
    print_step("images ...")
    progress = partial(print_progress, "evaluate-detector: image")
    taken = evaluation_images(renderer, images, scene.seed, progress, view=robot_view(loaded, parts))
    if output is not None:
        from reports.figures.perception import draw_detection

        shown = [each for each in taken if each.seen][:DRAWN]
        if not shown:
            raise ValueError(f"expected an image that shows the target to draw {output}, got none of {images}")
        draw_detection(shown, chosen, output)
    results = results_by_distance(taken, chosen)
    if json:
        print_json(
            {
                "rig": loaded.name,
                "detector": detector,
                "seed": scene.seed,
                "ranges": [asdict(each) for each in results],
                "file": None if output is None else str(output),
            }
        )
        return
    head = ("distance", "seen", "found", "wrong", "empty", "false alarms", "precision", "recall")
    print_table([(*head, "hue (deg)", "saturation", "value"), *map(_text_row, results)])
    if output is not None:
        typer.echo(str(output))


def _text_row(found: DetectorResults) -> tuple[str, ...]:
    counts = map(str, (found.seen, found.found, found.wrong, found.empty, found.false_alarms))
    shares = [f"{share:.2f}" for share in (found.precision, found.recall)]
    colours = ["-"] * 3
    if found.colours is not None:
        hue, *others = (found.colours.hue_deg, found.colours.saturation, found.colours.value)
        colours = [f"{hue[0]:.0f} to {hue[-1]:.0f}", *(f"{each[0]:.2f} to {each[-1]:.2f}" for each in others)]
    return (f"{found.from_m:g} to {found.to_m:g} m", *counts, *shares, *colours)
