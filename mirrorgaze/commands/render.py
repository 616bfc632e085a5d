"""Pictures: what the camera sees through port and mirrors."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mirrorgaze.output import JsonOption, RigArgument, print_json, print_table


def render(
    rig: RigArgument,
    q1: Annotated[float, typer.Option(help="Pan joint, degrees.")] = 0.0,
    q2: Annotated[float, typer.Option(help="Tilt joint, degrees; the gaze moves twice as far.")] = 0.0,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE", help="PNG (a picture) or EXR (radiance, ground truth).")
    ] = Path("view.png"),
    width: Annotated[int | None, typer.Option(help="Pixels; the camera's own by default.", min=1, max=20000)] = None,
    height: Annotated[int | None, typer.Option(help="Pixels; the camera's own by default.", min=1, max=20000)] = None,
    samples: Annotated[int, typer.Option(help="Samples per pixel, for smooth edges.", min=1, max=1024)] = 1,
    world: Annotated[str, typer.Option(help="What is around the robot.")] = "tank",
    depth: Annotated[float, typer.Option(help="Of the robot below the surface, metres.")] = 5.0,
    water: Annotated[str | None, typer.Option(help="Jerlov type; the rig's own by default.")] = None,
    stowed: Annotated[bool, typer.Option("--stowed", help="With the fold mirror swung out of the view.")] = False,
    json: JsonOption = False,
) -> None:
    """Render what the camera sees for a pose of the gaze mirror.

    \b
    Example:
      mirrorgaze render aqua2 --q1 30 --q2 -10 -o view.png
    """
    from mirrorgaze.loading import load_usable_rig
    from scenes.views import render_view

    loaded = load_usable_rig(rig)
    view = render_view(
        loaded,
        q1_deg=q1,
        q2_deg=q2,
        path=output,
        width_px=width,
        height_px=height,
        samples=samples,
        world=world,
        depth_m=depth,
        jerlov_type=water,
        stowed=stowed,
    )
    if json:
        print_json(view.as_dict())
        return
    typer.echo(f"{output}: {view.width_px} x {view.height_px} px in {view.time_s:.2f} s (first frame, with compiling)")
    rows = [(f"  {name}", f"{count} px") for name, count in view.region_px.items()]
    if view.gaze_deg is not None:
        rows += [(f"  gaze {name}", f"{value:.2f} deg") for name, value in view.gaze_deg.items()]
    print_table(rows)
