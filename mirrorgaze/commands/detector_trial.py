"""Trial of a detector: how often it finds the target in pictures whose truth is known, and what colour it has there."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mirrorgaze.output import JsonOption, RigArgument, print_json, print_progress, print_table
from mirrorgaze.scenery import DepthOption, Scenery, SeedOption, SunOptions, TargetOption, WaterOption, WorldOption

if TYPE_CHECKING:
    from tracking.perception import DetectorSettings
    from tracking.perception.trial import TrialPicture

RANGES_M = ((2.0, 3.0), (3.0, 4.0), (4.0, 5.0), (2.0, 5.0))
"""Distances in which pictures are counted together."""

DRAWN = 4
"""Pictures of the figure."""


def detector_trial(
    rig: RigArgument,
    detector: Annotated[str, typer.Option(help="Settings by name: red-ball, narrow-hue, wide-hue.")] = "red-ball",
    pictures: Annotated[int, typer.Option(help="How many; every sixth is without the target.", min=1)] = 60,
    world: WorldOption = "reef",
    target: TargetOption = "red ball",
    depth: DepthOption = 5.0,
    water: WaterOption = None,
    seed: SeedOption = 0,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="PNG: pictures, crops and masks.")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Try a detector on pictures with the target at random places, 2 to 5 m away, and say what colour it has there.

    Found is a centroid within the target's radius of the true one; wrong is one elsewhere. Hue, saturation and value
    are medians of the target's pixels, 5 and 95 % of the pictures: what a colour window has to let through.

    \b
    Example:
      mirrorgaze detector-trial aqua2 --world reef --detector wide-hue -o trial.png
    """
    from cad.meshes import rig_meshes
    from mirrorgaze.loading import load_usable_rig
    from scenes.image import check_image_path
    from scenes.renderer import FastRenderer
    from tracking.perception import DETECTORS
    from tracking.perception.trial import trial_pictures

    if detector not in DETECTORS:
        raise ValueError(f"expected --detector to be one of {', '.join(DETECTORS)}, got {detector!r}")
    loaded = load_usable_rig(rig)
    if not loaded.has_mirrors:
        raise ValueError(f"{rig}: expected a rig with mirrors, got {loaded.name!r}, which has none")
    if output is not None:
        check_image_path(output, ".png")
    scenery = Scenery(
        world=world,
        target=target,
        seed=seed,
        depth_m=depth,
        jerlov_type=water,
        sun=SunOptions(),
        cloud=0.0,
        wind_m_s=None,
    )
    renderer = FastRenderer(loaded, rig_meshes(loaded), scenery.stage(loaded))
    taken = trial_pictures(renderer, pictures, seed, partial(print_progress, "detector-trial: picture"))
    settings = DETECTORS[detector]
    if output is not None:
        from reports.perception_figures import draw_detection

        shown = [each for each in taken if each.seen][:DRAWN]
        if not shown:
            raise ValueError(f"expected a picture that shows the target to draw {output}, got none of {pictures}")
        draw_detection(shown, settings, output)
    rows = [
        _row(low, high, [each for each in taken if low <= each.distance_m < high], settings) for low, high in RANGES_M
    ]
    if json:
        print_json(
            {
                "rig": loaded.name,
                "detector": detector,
                "seed": seed,
                "ranges": rows,
                "file": None if output is None else str(output),
            }
        )
        return
    head = ("distance", "seen", "found", "wrong", "empty", "false alarms", "precision", "recall")
    print_table([(*head, "hue (deg)", "saturation", "value"), *map(_told, rows)])
    if output is not None:
        typer.echo(str(output))


def _row(low_m: float, high_m: float, pictures: list[TrialPicture], settings: DetectorSettings) -> dict[str, Any]:
    from dataclasses import asdict

    from tracking.perception.trial import score, target_colours

    colours = target_colours(pictures)
    counted = {"from_m": low_m, "to_m": high_m, **asdict(score(pictures, settings))}
    return {**counted, "colours": None if colours is None else asdict(colours)}


def _told(row: dict[str, Any]) -> tuple[str, ...]:
    counts = [str(row[key]) for key in ("seen", "found", "wrong", "empty", "false_alarms")]
    shares = [f"{row[key]:.2f}" for key in ("precision", "recall")]
    colours = ["-"] * 3
    if row["colours"] is not None:
        hue, saturation, value = row["colours"].values()
        colours = [
            f"{hue[0]:.0f} to {hue[-1]:.0f}",
            *(f"{each[0]:.2f} to {each[-1]:.2f}" for each in (saturation, value)),
        ]
    return (f"{row['from_m']:g} to {row['to_m']:g} m", *counts, *shares, *colours)
