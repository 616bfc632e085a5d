"""A picture of a rig beside its hull."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mirrorgaze.options import JsonOption, RigArgument
from mirrorgaze.output import print_json, print_note, print_step, print_table


def show(
    rig: RigArgument,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="Write into this folder.", show_default="out/RIG-show"),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Draw camera, mirrors and anchors beside the hull.

    Writes four views (show.png), the same for any 3-D viewer (show.glb) and the distances from the hull (show.json);
    what is inside the hull, in the way of the light or off the surface is red. It needs no mount: look at it before
    anything is built.

    \b
    Example:
      mirrorgaze show aqua2 -o out/aqua2-show
    """
    from reports.studies.show import show_rig
    from rigs import Rig

    loaded = Rig.load(rig)
    print_step("views ...")
    view = show_rig(loaded)
    files = view.write(output or Path("out") / f"{loaded.name}-show")
    if json:
        print_json(view.numbers)
        return
    print_table(
        [
            ("", "mm from the hull", ""),
            *((place.name, f"{round(place.distance_mm, 1) + 0:16.1f}", place.wrong) for place in view.standing.places),
        ]
    )
    for file in files:
        print_note(str(file))
