"""Presets: list them, and begin a rig file with one."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from mirrorgaze.commands.mount.place import print_placement
from mirrorgaze.options import JsonOption
from mirrorgaze.output import print_json, print_step, print_table

DIVE_AND_HULL = "--dive --hull {}: expected one of both; a dive names its rig: --from RIG"


def rigs(json: JsonOption = False) -> None:
    """List the preset rigs.

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
        str | None,
        typer.Option(
            "--from", metavar="PRESET", help="Copy this preset.", show_default="aqua2; plain numbers on a hull's file"
        ),
    ] = None,
    hull: Annotated[
        str | None,
        typer.Option(
            metavar="SHAPE|FILE",
            help="Use this hull: box, open-frame or torpedo picks the preset that has it; a STEP, STL, OBJ, PLY, 3MF, "
            "GLB, glTF, COLLADA, URDF or SDF file replaces the preset's.",
        ),
    ] = None,
    unit: Annotated[
        str | None,
        typer.Option(
            metavar="mm|cm|m|inch",
            help="Unit of the numbers in a hull file.",
            show_default="what the file says, or the size",
        ),
    ] = None,
    forward: Annotated[
        str | None,
        typer.Option(metavar="AXIS", help="Axis of a hull file that is forward, such as -y.", show_default="by shape"),
    ] = None,
    up: Annotated[
        str | None,
        typer.Option(metavar="AXIS", help="Axis of a hull file that is up, such as +z.", show_default="by shape"),
    ] = None,
    keep: Annotated[
        str | None,
        typer.Option(
            metavar="all|joined|largest",
            help="Which bodies of a hull file that do not touch make its solid.",
            show_default="all",
        ),
    ] = None,
    camera_mm: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            metavar="X Y Z",
            help="Place the camera's pinhole here, in millimetres of the body frame.",
            show_default="at the nose",
        ),
    ] = None,
    camera_from: Annotated[
        str | None, typer.Option(metavar="LINK", help="Place the camera where this camera of a URDF or SDF file is.")
    ] = None,
    look: Annotated[
        str | None,
        typer.Option(
            metavar="YAW,PITCH",
            help="Let the camera look this way, in degrees: yaw to the left of ahead, pitch up.",
            show_default="ahead",
        ),
    ] = None,
    dive: Annotated[
        bool, typer.Option("--dive", help="Write a commented dive file instead; --from then names its rig.")
    ] = False,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write this file.", show_default="NAME.toml"),
    ] = None,
) -> None:
    """Create a rig file or a dive file.

    A rig begins with a preset, copied with its comments, or on a hull. A file that exists is never overwritten. The
    command opens a hull's file, and prints what it holds, what it is taken for and why. It asks for --unit where
    neither file nor size say it. The hull's middle becomes the body's origin, a robot's base link stays it. Camera,
    mirrors and anchors are placed on the hull, each with the reason in the rig file: `mirrorgaze place FILE` does that
    again after a change.

    \b
    Example:
      mirrorgaze new reef-camera --from bluerov2
      mirrorgaze new glider --hull glider.stl --unit mm --forward +y
      mirrorgaze new inspector --hull rov.stl --camera-mm 620 0 -40 --look 30,-10
      mirrorgaze new harbour --dive --from glider.toml
    """
    from rigs.new_rig import create_rig_file

    file = output or Path(f"{name}.toml")
    if hull is None or not Path(hull).suffix:
        told = {
            "--unit": unit,
            "--forward": forward,
            "--up": up,
            "--keep": keep,
            "--camera-mm": camera_mm,
            "--camera-from": camera_from,
            "--look": look,
        }
        given = [f"{option} {value}" for option, value in told.items() if value is not None]
        if given:
            raise ValueError(f"{' '.join(given)}: expected beside the file of a hull; add --hull FILE")
        if dive:
            _new_dive(name, file, preset, hull)
            return
        preset = create_rig_file(name, file, preset=preset, shape=hull)
        typer.echo(f"{file}: a copy of {preset}; change it, then: mirrorgaze check {file}")
        return
    if dive:
        raise ValueError(DIVE_AND_HULL.format(hull))
    from mirrorgaze.loading import print_hull_notes
    from reports.studies.new_rig import new_rig_on_hull

    _, placement = new_rig_on_hull(
        name,
        file,
        Path(hull),
        preset=preset,
        unit=unit,
        forward=forward,
        up=up,
        keep=keep or "all",
        camera_mm=camera_mm,
        camera_from=camera_from,
        look_deg=None if look is None else _look_deg(look),
        log=print_step,
        # Before the mount: where none fits, this says which unit or axis to look at.
        found=lambda taken: typer.echo(taken.describe()),
    )
    print_hull_notes(placement.rig)
    print_placement(placement)
    typer.echo(f"{file}: written; look at it: mirrorgaze show {file}; check its mount: mirrorgaze check {file} --cad")


def _look_deg(text: str) -> tuple[float, float]:
    """Yaw and pitch from the words of the command line."""
    try:
        yaw, pitch = (float(part) for part in text.split(","))
    except ValueError:
        yaw = pitch = math.nan
    if not (abs(yaw) <= 180 and abs(pitch) <= 90):
        raise ValueError(
            f"--look {text}: expected YAW,PITCH in degrees, yaw from -180 to 180 (to the left), pitch from -90 to 90 "
            "(up), such as 30,-10"
        )
    return yaw, pitch


def _new_dive(name: str, file: Path, rig: str | None, hull: str | None) -> None:
    from dives.planning.starter import create_dive_file

    if hull is not None:
        raise ValueError(DIVE_AND_HULL.format(hull))
    create_dive_file(name, file, rig=rig)
    typer.echo(f"{file}: written; change it, look at it: mirrorgaze dive {file} --plan; then: mirrorgaze dive {file}")
