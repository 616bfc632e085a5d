"""Presets: list them, and begin a rig file with one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mirrorgaze.options import JsonOption
from mirrorgaze.output import print_json, print_table


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
        str | None, typer.Option("--from", metavar="PRESET", help="Copy this preset.", show_default="aqua2")
    ] = None,
    hull: Annotated[
        str | None,
        typer.Option(
            metavar="SHAPE|FILE",
            help="Use this hull: box, open-frame or torpedo picks the preset that has it; a STEP, STL, OBJ or PLY file "
            "replaces the preset's.",
        ),
    ] = None,
    unit: Annotated[str | None, typer.Option(help="Unit of the numbers in a hull file: mm, cm, m or inch.")] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write this rig file.", show_default="NAME.toml"),
    ] = None,
) -> None:
    """Create a rig file from a preset.

    The preset is copied with its comments. A file that exists is never overwritten. With a hull's file, `mirrorgaze
    check FILE --cad` then says where the anchors have to go.

    \b
    Example:
      mirrorgaze new reef-camera --from bluerov2
      mirrorgaze new glider --hull glider.stl --unit mm
    """
    from rigs.new_rig import create_rig_file

    file = output or Path(f"{name}.toml")
    copied = create_rig_file(name, file, preset=preset, hull=hull, unit=unit)
    typer.echo(f"{file}: a copy of {copied}; change it, then: mirrorgaze check {file}")
