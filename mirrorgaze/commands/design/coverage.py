"""What a rig sees of the sphere around the robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from mirrorgaze.options import JsonOption, OpenOption, RigArgument
from mirrorgaze.output import open_page, print_json, print_step, print_table

SHOWN = 3
"""Changes that are printed; the page has all."""


def coverage(
    rig: RigArgument,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="Write into this folder.", show_default="out/RIG-coverage"),
    ] = None,
    step_deg: Annotated[
        float, typer.Option(help="Largest step of both joints over their ranges, from 0.25 to 90 degrees.")
    ] = 1.0,
    browse: OpenOption = False,
    json: JsonOption = False,
) -> None:
    """Map what a rig sees of the sphere around the robot.

    Writes a page that opens from disk (coverage.html) with usable field of view, blind directions, what would open
    them, and resolution, its figures, tables (CSV) and numbers (JSON). An interrupted run continues where it stopped.

    \b
    Example:
      mirrorgaze coverage aqua2 -o out/aqua2-coverage --step-deg 2
    """
    import json as json_format

    from mirrorgaze.loading import load_usable_rig
    from reports.studies.coverage import coverage_report

    loaded = load_usable_rig(rig)
    folder = output or Path("out") / f"{loaded.name}-coverage"
    report = coverage_report(loaded, folder, step_deg=step_deg, log=print_step)
    if browse:
        open_page(report)
    results = json_format.loads((folder / "coverage.json").read_text(encoding="utf-8"))
    if json:
        print_json(results)
        return
    maps = results["coverage"]
    usable, poses = maps["usable_solid_angle_sr"], maps["poses_seeing_a_direction"]
    covered, limits = maps["covered_fraction"], maps["covered_range"]
    typer.echo(str(report))
    print_table(
        [
            (
                "  covered",
                f"{covered:.1%} of all directions in {maps['poses']} poses; "
                f"{limits['low']:.1%} to {limits['high']:.1%} with finer steps",
            ),
            ("  usable", f"{1000 * usable['mean']:.1f} msr mean, {1000 * usable['largest']:.1f} msr at most"),
            ("  redundancy", f"{poses['median']:.0f} poses see a direction (median)"),
            ("  blind", f"{len(maps['blind_patches'])} patches"),
            *(("  would open", _opening(opening)) for opening in maps["openings"][:SHOWN]),
        ]
    )


def _opening(found: dict[str, Any]) -> str:
    from optics.coverage.openings.openings import Opening
    from reports.pages.coverage import opening_words

    opening = Opening(**found)
    gained = (
        f"{1000 * opening.gained_sr:.1f} msr, {opening.share:.0%} of a patch; {1000 * opening.net_sr:+.0f} msr in all"
    )
    return f"{opening_words(opening)}: {gained}"
