"""Export of a mount that has passed every check."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mirrorgaze.options import JsonOption, RigArgument
from mirrorgaze.output import print_json, print_note, print_step


def export(
    rig: RigArgument,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="Write into this folder.", show_default="out/RIG/mount"),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Export the mount to print, buy, assemble and simulate.

    Writes an STL per part and print plates (3MF, STL), the assembly (STEP, GLB, 3MF), drawings (SVG, PDF), the bill of
    materials (CSV), assembly steps with images, URDF and SDF, the checks (CSV, PNG), the loads (CSV, PNG), and a
    manifest. The same rig gives the same bytes.

    Every check is made first (see `mirrorgaze check RIG --cad`); where there is a slicer, the plates are sliced,
    which takes long the first time. Nothing is written when a check fails or a servo is too weak.

    \b
    Example:
      mirrorgaze export aqua2 -o out/mount
    """
    from mirrorgaze.loading import load_usable_rig, print_hull_notes
    from reports.figures.check import summary_rows
    from reports.studies.mount_export import checked_mount, export_checked_mount
    from rigs import RigError

    loaded = load_usable_rig(rig)
    notes = print_hull_notes(loaded)
    try:
        mount = checked_mount(loaded, log=print_step)
    except RigError as error:
        raise RigError(rig, error.problems) from None
    files = export_checked_mount(mount, output or Path("out") / loaded.name / "mount", log=print_step)
    if json:
        print_json({"files": [str(file) for file in files], "hull_notes": notes})
    else:
        for check, counts, worst in summary_rows(mount.checks):
            print_note(f"{check}: {counts}; nearest: {worst}")
        for file in files:
            typer.echo(str(file))
