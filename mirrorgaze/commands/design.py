"""The main job: one rig in, a design dossier out; and its parts by themselves."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mirrorgaze.output import JsonOption, RigArgument, print_json

FolderOption = Annotated[
    Path | None, typer.Option("--output", "-o", metavar="DIR", help="Folder to write into; out/RIG by default.")
]


def design(rig: RigArgument, output: FolderOption = None, json: JsonOption = False) -> None:
    """Design a rig's mirror gaze: mount files, views, coverage, and a report.

    An interrupted run goes on where it stopped.

    \b
    Example:
      mirrorgaze design aqua2 -o out/aqua2
    """
    from mirrorgaze.loading import load_usable_rig
    from reports.dossier import design as make_dossier

    loaded = load_usable_rig(rig)
    report = make_dossier(loaded, output or Path("out") / loaded.name, announce=_announce)
    if json:
        import json as json_format

        print_json(json_format.loads((report.parent / "summary.json").read_text(encoding="utf-8")))


def export(rig: RigArgument, output: FolderOption = None, json: JsonOption = False) -> None:
    """Export the mount: everything to print, buy, assemble, draw and simulate it.

    Writes an STL per part and print plates (3MF, STL), the assembly (STEP, GLB, 3MF), drawings (SVG, PDF), the bill of
    materials (CSV), assembly steps with pictures, URDF and SDF, and a manifest. The same rig gives the same bytes.

    Nothing is written when the mount cannot be built: parts that collide or do not fit the printer are named.

    \b
    Example:
      mirrorgaze export aqua2 -o out/mount
    """
    from cad.assembly import build_assembly
    from cad.checks.assembly_checks import assembly_problems
    from cad.export import export_mount
    from mirrorgaze.loading import load_usable_rig
    from rigs import RigError

    loaded = load_usable_rig(rig)
    problems = assembly_problems(loaded, build_assembly(loaded))
    if problems:
        raise RigError(rig, problems)
    files = export_mount(loaded, output or Path("out") / loaded.name / "mount", announce=_announce)
    if json:
        print_json({"files": [str(file) for file in files]})
    else:
        for file in files:
            typer.echo(str(file))


def _announce(line: str) -> None:
    # Progress goes to stderr, so that --json leaves stdout to the machine.
    typer.echo(line, err=True)
