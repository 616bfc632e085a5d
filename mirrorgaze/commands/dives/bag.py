"""Finished dives for ROS 2."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mirrorgaze.options import JsonOption
from mirrorgaze.output import print_json, print_progress, print_step


def bag(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a finished dive.")],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="BAG", help="Write the bag to this folder.", show_default="DIR/bag"),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Convert a finished dive to a ROS 2 bag (MCAP).

    The bag has images, joints, transforms and the target's ground truth. An earlier bag of that name is replaced. ROS
    is not needed.

    \b
    Example:
      mirrorgaze bag out/spiral -o spiral.bag
      ros2 bag play spiral.bag
    """
    from dives.bags import dive_rig, write_bag

    print_step("bag ...")
    rig = dive_rig(folder)
    path = write_bag(
        folder, rig, output or folder / "bag", progress=lambda done, total: print_progress("bag", done, total)
    )
    files = sorted(path.iterdir())
    if json:
        print_json({"bag": path, "files": {file.name: file.stat().st_size for file in files}})
        return
    for file in files:
        typer.echo(f"{file}: {file.stat().st_size / 1e6:.1f} MB")
