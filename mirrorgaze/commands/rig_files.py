"""Rig files: list the presets, begin a new one, check one, describe the format to an editor."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mirrorgaze.errors import BAD_INPUT
from mirrorgaze.output import JsonOption, RigArgument, print_json, print_table

if TYPE_CHECKING:
    from rigs import Problem, Rig


def rigs(json: JsonOption = False) -> None:
    """List the presets.

    \b
    Example:
      mirrorgaze rigs
    """
    from rigs import Rig, preset_names

    found = [Rig.load(name) for name in preset_names()]
    if json:
        print_json([{"name": rig.name, "description": rig.description} for rig in found])
    else:
        print_table((rig.name, rig.description) for rig in found)


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the new rig.")],
    preset: Annotated[
        str | None, typer.Option("--from", metavar="PRESET", help="Preset to begin with; aqua2 by default.")
    ] = None,
    hull: Annotated[
        str | None,
        typer.Option(
            metavar="SHAPE|FILE", help="box, open-frame, torpedo, or the hull as a STEP, STL, OBJ or PLY file."
        ),
    ] = None,
    unit: Annotated[str | None, typer.Option(help="What the numbers of a hull file mean: mm, m or inch.")] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="File to write; NAME.toml by default.")
    ] = None,
) -> None:
    """Begin a rig file with a copy of a preset.

    The comments are copied too; a file that exists is never overwritten.
    A hull's shape picks the preset that has it; a hull's file takes the place
    of the preset's hull, and `mirrorgaze check FILE --cad` then says where the
    anchors have to go.

    \b
    Example:
      mirrorgaze new reef-camera --from bluerov2
      mirrorgaze new glider --hull glider.stl --unit mm
    """
    import tomlkit

    from rigs import load_document, preset_path, preset_with_hull, save_document
    from rigs.files import parse_rig, put_hull_file

    file = output or Path(f"{name}.toml")
    is_file = hull is not None and "." in hull
    if unit is not None and not is_file:
        raise ValueError(f"--unit {unit}: expected with the file of a hull only")
    if preset is None:
        preset = preset_with_hull(hull) if hull is not None and not is_file else "aqua2"
    elif hull is not None and not is_file:
        raise ValueError(f"--hull {hull}: expected --from or the shape of a hull, got both")
    document = load_document(preset_path(preset))
    document["name"] = name
    if hull is not None and is_file:
        put_hull_file(document, Path(hull), unit=unit, folder=file.parent)
    parse_rig(tomlkit.dumps(document), source=f"new rig {name!r}", folder=file.parent)
    if file.exists():
        raise FileExistsError(f"{file}: expected a new file, but there is one already")
    if not file.parent.is_dir():
        raise FileNotFoundError(f"{file}: expected an existing folder, but there is no {file.parent}")
    save_document(document, file)
    typer.echo(f"{file}: a copy of {preset}; change it, then: mirrorgaze check {file}")


def check(
    rig: RigArgument,
    cad: Annotated[
        bool, typer.Option("--cad", help="Build the mount and check it too: clearance, walls, screws, slicer, ...")
    ] = False,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FOLDER", help="With --cad: folder for every figure, as CSV and PNG."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Say that a rig is good, or all that is wrong with it.

    What had to be done to a hull from a file is told too.

    With --cad the mount is built and every check of it made; that takes half a minute, and longer the first time, when
    a slicer is there.

    \b
    Example:
      mirrorgaze check aqua2 --cad -o out/checks
    """
    from mirrorgaze.loading import tell_hull_notes
    from optics.feasibility import feasibility_problems
    from rigs import Rig, RigError

    try:
        loaded = Rig.load(rig)
        problems = feasibility_problems(loaded)
        if problems:
            raise RigError(rig, problems)
        notes = tell_hull_notes(loaded)
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


def schema() -> None:
    """Print the JSON Schema of rig files, for editors.

    An editor that knows it completes and checks rig files while you type.

    \b
    Example:
      mirrorgaze schema > rig.schema.json
    """
    from rigs import Rig

    print_json(Rig.model_json_schema())


def _check_mount(rig: Rig, source: str, output: Path | None, *, json: bool) -> dict[str, object]:
    """Make all checks of a mount and tell of them; `RigError` with every problem when something is wrong."""
    from cad.assembly import build_assembly
    from reports.check_figures import findings_as_dicts, summary_rows, write_checks
    from reports.mount_export import mount_checks
    from rigs import RigError

    checks = mount_checks(rig, build_assembly(rig), announce=lambda line: typer.echo(line, err=True))
    if output is not None:
        for file in write_checks(checks, rig, output):
            typer.echo(str(file), err=True)
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
    for label, distance, mirror in (("M1", "d1", rig.fold_mirror), ("M2", "d2", rig.gaze_mirror)):
        if mirror is not None:
            size = f"{mirror.width_mm:g} x {mirror.height_mm:g} mm"
            facts.append((f"  {label}", f"{size}, {distance} = {mirror.distance_mm:g} mm"))
    if rig.joints is not None:
        for label, joint in (("q1 (pan)", rig.joints.pan), ("q2 (tilt)", rig.joints.tilt)):
            facts.append((f"  {label}", f"{joint.min_deg:g} to {joint.max_deg:g} degrees"))
    return facts
