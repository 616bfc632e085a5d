"""The main job: one rig in, a design report out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mirrorgaze.options import JsonOption, OpenOption, RigArgument
from mirrorgaze.output import open_page, print_json, print_step


def design(
    rig: RigArgument,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="Write into this folder.", show_default="out/RIG"),
    ] = None,
    dive: Annotated[
        str | None,
        typer.Option(metavar="DIVE", help="Validate with this dive, a preset or a file.", show_default="spiral"),
    ] = None,
    no_dive: Annotated[bool, typer.Option("--no-dive", help="Leave the dive out, which takes longest.")] = False,
    only: Annotated[
        list[str] | None,
        typer.Option(
            metavar="STAGE", help="Make this stage alone: coverage, sizing, outside, mount, tolerance, views or dive."
        ),
    ] = None,
    browse: OpenOption = False,
    json: JsonOption = False,
) -> None:
    """Design a rig: mount, views, coverage, dive, report.

    Writes the coverage of the sphere, the mount from outside and its files, what the camera sees, a simulated dive that
    tracks a ball over the designed mirrors and is compared with ground truth, and a report of all of it (report.html,
    report.pdf, summary.json), which is there from the first stage on. An interrupted run continues where it stopped,
    and one with --no-dive or --only when it is called without.

    \b
    Example:
      mirrorgaze design aqua2 -o out/aqua2
      mirrorgaze design my-auv.toml --dive my-dive.toml
      mirrorgaze design my-auv.toml --only coverage --only views
    """
    from dives import Dive
    from mirrorgaze.loading import load_usable_rig
    from reports.studies.design import STAGES
    from reports.studies.design import design as design_rig

    unknown = sorted(set(only or ()) - set(STAGES))
    if unknown:
        raise ValueError(f"--only {unknown[0]}: expected a stage among {', '.join(STAGES)}")
    if no_dive and only:
        raise ValueError("--no-dive: expected no --only beside it, which leaves out the dive as well; leave one out")
    if no_dive and dive is not None:
        raise ValueError(f"--dive {dive}: expected no dive beside --no-dive; leave one of the two out")
    loaded = load_usable_rig(rig)
    chosen = None if dive is None else Dive.load(dive)
    stages = only or [stage for stage in STAGES if not (no_dive and stage == "dive")]
    report = design_rig(loaded, output or Path("out") / loaded.name, log=print_step, dive=chosen, only=stages)
    if browse:
        open_page(report)
    if json:
        import json as json_format

        print_json(json_format.loads((report.parent / "summary.json").read_text(encoding="utf-8")))
