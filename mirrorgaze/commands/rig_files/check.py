"""Checks of a rig file, and of its mount."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mirrorgaze.errors import BAD_INPUT, FAILED
from mirrorgaze.options import JsonOption, RigArgument
from mirrorgaze.output import print_json, print_note, print_step, print_table

if TYPE_CHECKING:
    from cad.assembly.assembly import Assembly
    from optics.feasibility.requirements import Judged
    from rigs import Rig


def check(
    rig: RigArgument,
    cad: Annotated[
        bool, typer.Option("--cad", help="Build the mount and check it: clearance, walls, screws, slicing, and more.")
    ] = False,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="With --cad, write every result as CSV and PNG here."),
    ] = None,
    require: Annotated[
        bool, typer.Option("--require", help="Judge the rig's [requirements] too; exit with 1 when one fails.")
    ] = False,
    json: JsonOption = False,
) -> None:
    """Check a rig file, and with --cad its mount.

    Prints the rig's key numbers, or everything that is wrong with it, each with its key, its value and what was
    expected. The command reads the files that it names as well, and prints what had to be done to a hull's. With --cad
    this takes half a minute, and longer the first time when there is a slicer. With --require every requirement that
    the file states passes, fails, or is not judged here: the gaze error is a dive's, the print time a slicer's (--cad).

    \b
    Example:
      mirrorgaze check aqua2 --cad -o out/checks
      mirrorgaze check my-auv.toml --require
    """
    from cad.checks.rig_problems import rig_problems
    from mirrorgaze.loading import print_hull_notes
    from rigs import Rig, RigError
    from scenes.light.rig_spectra import spectrum_problems

    try:
        loaded = Rig.load(rig)
        notes = print_hull_notes(loaded)
        problems = rig_problems(loaded) + spectrum_problems(loaded)
        if problems:
            raise RigError(rig, problems)
        if require and loaded.requirements is None:
            raise ValueError(f"{rig}: expected a table [requirements] for --require; mirrorgaze schema has its keys")
        assembly = None
        checks: dict[str, object] = {}
        if cad:
            from cad.assembly.assembly import build_assembly

            print_step("mount ...")
            assembly = build_assembly(loaded)
            checks = _check_mount(assembly, rig, output, json=json)
    except RigError as error:
        if not json:
            raise
        print_json({"source": rig, "good": False, "problems": [each.as_dict() for each in error.problems]})
        raise typer.Exit(BAD_INPUT) from None
    judged: list[Judged] = []
    if require:
        from reports.studies.requirements import judged_so_far

        print_step("requirements ...")
        judged = judged_so_far(loaded, assembly)
    if json:
        rest = {"hull_notes": notes, **checks, "rig": loaded.model_dump(mode="json")}
        requirements = [asdict(each) for each in judged]
        print_json({"source": rig, "good": True, "problems": [], "requirements": requirements, **rest})
    else:
        typer.echo(f"{rig}: good")
        print_table(_key_facts(loaded))
        if judged:
            typer.echo("requirements")
            print_table((f"  {each.name}", each.required, each.achieved, each.outcome) for each in judged)
    if any(each.outcome == "fail" for each in judged):
        raise typer.Exit(FAILED)


def _check_mount(assembly: Assembly, source: str, output: Path | None, *, json: bool) -> dict[str, object]:
    """Make all checks of a mount and print them; `RigError` with every problem when something is wrong."""
    from reports.figures.check import findings_as_dicts, summary_rows, write_checks
    from reports.studies.mount_export import mount_checks
    from rigs import RigError

    checks = mount_checks(assembly, log=print_step)
    if output is not None:
        for file in write_checks(checks, assembly.rig, output):
            print_note(str(file))
    if not json:
        print_table(summary_rows(checks))
    if checks.admissible is not None and not json:
        typer.echo(f"largest admissible rectangle around rest: {checks.admissible.largest}")
    if checks.problems:
        raise RigError(source, checks.problems)
    return {"checks": findings_as_dicts(checks)}


def _key_facts(rig: Rig) -> list[tuple[str, str]]:
    camera, port = rig.camera, rig.port
    facts = [("  camera", f"{camera.model}, {camera.width_px} x {camera.height_px} px")]
    if port.shape == "none":
        facts.append(("  port", "none"))
    else:
        facts.append(("  port", f"{port.shape}, {port.material}, {port.thickness_mm:g} mm"))
    if rig.gaze is not None:
        for label, distance, mirror in (("M1", "d1", rig.gaze.fold_mirror), ("M2", "d2", rig.gaze.gaze_mirror)):
            facts.append((f"  {label}", f"{mirror.size}, {distance} = {mirror.distance_mm:g} mm"))
        for label, joint in (("q1 (pan)", rig.gaze.joints.pan), ("q2 (tilt)", rig.gaze.joints.tilt)):
            facts.append((f"  {label}", f"{joint.min_deg:g} to {joint.max_deg:g} degrees"))
    return facts
