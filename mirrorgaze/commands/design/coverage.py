"""What a rig sees of the sphere around the robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mirrorgaze.options import JsonOption, RigArgument
from mirrorgaze.output import print_json, print_note, print_table


def coverage(
    rig: RigArgument,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="Write into this folder.", show_default="out/RIG-coverage"),
    ] = None,
    step_deg: Annotated[
        float, typer.Option(help="Largest step of both joints over their ranges, from 0.25 to 90 degrees.")
    ] = 1.0,
    json: JsonOption = False,
) -> None:
    """Map what a rig sees of the sphere around the robot.

    Writes a page that opens from disk (coverage.html) with usable field of view, blind directions and resolution, its
    figures, tables (CSV) and numbers (JSON). An interrupted run continues where it stopped.

    \b
    Example:
      mirrorgaze coverage aqua2 -o out/aqua2-coverage --step-deg 2
    """
    import json as json_format

    from mirrorgaze.loading import load_usable_rig
    from reports.studies.coverage import coverage_report

    loaded = load_usable_rig(rig)
    folder = output or Path("out") / f"{loaded.name}-coverage"
    report = coverage_report(loaded, folder, step_deg=step_deg, log=print_note)
    results = json_format.loads((folder / "coverage.json").read_text(encoding="utf-8"))
    if json:
        print_json(results)
        return
    maps = results["coverage"]
    usable, poses = maps["usable_solid_angle_sr"], maps["poses_seeing_a_direction"]
    covered, error = maps["covered_fraction"], maps["covered_standard_error"]
    typer.echo(str(report))
    print_table(
        [
            (
                "  covered",
                f"{covered:.1%} of all directions in {maps['poses']} poses, to ±{error:.2%}",
            ),
            ("  usable", f"{1000 * usable['mean']:.1f} msr mean, {1000 * usable['largest']:.1f} msr at most"),
            ("  redundancy", f"{poses['median']:.0f} poses see a direction (median)"),
            ("  blind", f"{len(maps['blind_patches'])} patches"),
        ]
    )
