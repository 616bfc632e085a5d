"""Checks of a rig file, and of its mount."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mirrorgaze.errors import BAD_INPUT
from mirrorgaze.options import JsonOption, RigArgument
from mirrorgaze.output import print_json, print_note, print_step, print_table

if TYPE_CHECKING:
    from rigs import Problem, Rig


def check(
    rig: RigArgument,
    cad: Annotated[
        bool, typer.Option("--cad", help="Build the mount and check it: clearance, walls, screws, slicing, and more.")
    ] = False,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="With --cad, write every result as CSV and PNG here."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Check a rig file, and with --cad its mount.

    Prints the rig's key numbers, or everything that is wrong with it, each with its key, its value and what was
    expected; also what had to be done to a hull from a file. With --cad this takes half a minute, and longer the first
    time when there is a slicer.

    \b
    Example:
      mirrorgaze check aqua2 --cad -o out/checks
    """
    from cad.checks.rig_problems import rig_problems
    from mirrorgaze.loading import print_hull_notes
    from rigs import Rig, RigError

    try:
        loaded = Rig.load(rig)
        notes = print_hull_notes(loaded)
        problems = rig_problems(loaded)
        if problems:
            raise RigError(rig, problems)
        checks = _check_mount(loaded, rig, output, json=json) if cad else {}
    except RigError as error:
        if not json:
            raise
        print_json({"source": rig, "good": False, "problems": [_as_json(problem) for problem in error.problems]})
        raise typer.Exit(BAD_INPUT) from None
    if json:
        rest = {"hull_notes": notes, **checks, "rig": loaded.model_dump(mode="json")}
        print_json({"source": rig, "good": True, "problems": [], **rest})
    else:
        typer.echo(f"{rig}: good")
        print_table(_key_facts(loaded))


def _check_mount(rig: Rig, source: str, output: Path | None, *, json: bool) -> dict[str, object]:
    """Make all checks of a mount and print them; `RigError` with every problem when something is wrong."""
    from cad.assembly.assembly import build_assembly
    from reports.figures.check import findings_as_dicts, summary_rows, write_checks
    from reports.studies.mount_export import mount_checks
    from rigs import RigError

    print_step("mount ...")
    checks = mount_checks(build_assembly(rig), log=print_step)
    if output is not None:
        for file in write_checks(checks, rig, output):
            print_note(str(file))
    if not json:
        print_table(summary_rows(checks))
    if checks.admissible is not None and not json:
        typer.echo(f"largest admissible rectangle around rest: {checks.admissible.largest}")
    if checks.problems:
        raise RigError(source, checks.problems)
    return {"checks": findings_as_dicts(checks)}


def _as_json(problem: Problem) -> dict[str, object]:
    return {"place": problem.place, "value": problem.value, "expected": problem.expected, "message": str(problem)}


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
