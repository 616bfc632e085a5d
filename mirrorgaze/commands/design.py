"""The main job: one rig in, a design dossier out; and its parts by themselves."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mirrorgaze.output import JsonOption, RigArgument, print_json

DiveOption = Annotated[
    str | None, typer.Option(metavar="DIVE", help="Dive to validate with, a preset or a file, instead of `spiral`.")
]
FolderOption = Annotated[
    Path | None, typer.Option("--output", "-o", metavar="DIR", help="Folder to write into; out/RIG by default.")
]


def design(rig: RigArgument, output: FolderOption = None, dive: DiveOption = None, json: JsonOption = False) -> None:
    """Design a rig's mirror gaze: mount files, views, coverage, a dive that validates it, and a report.

    The dive's loop tracks a ball over the designed mirrors, and is compared with the truth. An interrupted run goes on
    where it stopped.

    \b
    Example:
      mirrorgaze design aqua2 -o out/aqua2
      mirrorgaze design my-auv.toml --dive my-dive.toml
    """
    from mirrorgaze.loading import load_usable_rig
    from reports.dossier import design as make_dossier
    from tracking.dives import Dive

    loaded = load_usable_rig(rig)
    chosen = None if dive is None else Dive.load(dive)
    report = make_dossier(loaded, output or Path("out") / loaded.name, announce=_announce, dive=chosen)
    if json:
        import json as json_format

        print_json(json_format.loads((report.parent / "summary.json").read_text(encoding="utf-8")))


def export(rig: RigArgument, output: FolderOption = None, json: JsonOption = False) -> None:
    """Export the mount: everything to print, buy, assemble, draw and simulate it.

    Writes an STL per part and print plates (3MF, STL), the assembly (STEP, GLB, 3MF), drawings (SVG, PDF), the bill of
    materials (CSV), assembly steps with pictures, URDF and SDF, the checks (CSV, PNG), the loads (CSV, PNG), and a
    manifest. The same rig gives the same bytes.

    Every check is made first (see `mirrorgaze check RIG --cad`); where there is a slicer, parts and plates are sliced,
    which takes long the first time. Nothing is written when one fails, or a servo is too weak.

    \b
    Example:
      mirrorgaze export aqua2 -o out/mount
    """
    from mirrorgaze.loading import load_usable_rig, tell_hull_notes
    from reports.check_figures import summary_rows
    from reports.mount_export import export_checked_mount
    from rigs import RigError

    loaded = load_usable_rig(rig)
    notes = tell_hull_notes(loaded)
    try:
        mount = export_checked_mount(loaded, output or Path("out") / loaded.name / "mount", announce=_announce)
    except RigError as error:
        raise RigError(rig, error.problems) from None
    if json:
        print_json({"files": [str(file) for file in mount.files], "hull_notes": notes})
    else:
        for check, counts, worst in summary_rows(mount.checks):
            _announce(f"{check}: {counts}; nearest: {worst}")
        for file in mount.files:
            typer.echo(str(file))


def _announce(line: str) -> None:
    # Progress goes to stderr, so that --json leaves stdout to the machine.
    typer.echo(line, err=True)
