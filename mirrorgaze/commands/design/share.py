"""One file in which colleagues without Python explore a rig."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mirrorgaze.options import OpenOption, RigArgument
from mirrorgaze.output import open_page, print_step


def share(
    rig: RigArgument,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write this HTML file.", show_default="RIG-explorer.html"),
    ] = None,
    browse: OpenOption = False,
) -> None:
    """Write one HTML file to explore a rig in.

    It needs neither Python nor a network: the solids with joints that move, views of the camera on a grid of joint
    values with the exact gaze in between, which poses see a direction, key numbers and the bill of materials.

    \b
    Example:
      mirrorgaze share aqua2 -o explorer.html
    """
    from mirrorgaze.loading import load_usable_rig
    from reports.studies.sharing.share import share as share_rig

    loaded = load_usable_rig(rig)
    path = output or Path(f"{loaded.name}-explorer.html")
    if path.suffix.lower() not in {".html", ".htm"} or path.is_dir():
        raise ValueError(f"--output {path}: expected an HTML file, such as {loaded.name}-explorer.html")
    if not path.parent.is_dir():
        raise ValueError(f"--output {path}: expected a folder that exists, got {path.parent}")
    made = share_rig(loaded, path, log=print_step)
    if browse:
        open_page(made)
    typer.echo(f"{made} ({made.stat().st_size / 1e6:.1f} MB)")
