"""Sizing: how large the mirrors have to be, what stands in the way, and what other distances would give."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mirrorgaze.errors import FAILED
from mirrorgaze.options import JsonOption, RigArgument
from mirrorgaze.output import print_json, print_step, print_table

if TYPE_CHECKING:
    from optics.sizing.sizing import Sizing


class Outline(StrEnum):
    """Outlines of a rig file."""

    RECTANGLE = "rectangle"
    OCTAGON = "octagon"
    ELLIPSE = "ellipse"


def size(
    rig: RigArgument,
    window: Annotated[
        str,
        typer.Option(
            help="Part of the image to pass: a fraction of its sides (0.2), pixels (320x240), degrees in the water "
            "(20x15deg), or edges left,top,right,bottom in pixels; the first three are centred."
        ),
    ] = "0.2",
    azimuth_deg: Annotated[
        tuple[float, float] | None,
        typer.Option(
            help="Range of the gaze azimuth, from and to, in degrees; 0 is ahead, left is positive.",
            show_default="60 to both sides of the camera's view",
        ),
    ] = None,
    elevation_deg: Annotated[
        tuple[float, float] | None,
        typer.Option(
            help="Range of the gaze elevation, from and to, in degrees; up is positive.",
            show_default="30 below and above the camera's view",
        ),
    ] = None,
    margin_mm: Annotated[
        float, typer.Option(help="Margin added all around for printing and lip, in millimetres.")
    ] = 2.0,
    angle_tolerance_deg: Annotated[
        float, typer.Option(help="Largest angular error of camera, M1 and M2 each, in degrees.")
    ] = 0.25,
    outline: Annotated[
        Outline | None, typer.Option(help="Outline of both mirrors, in place of those in the rig file.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="Write outlines and the trade-off to this folder."),
    ] = None,
    apply: Annotated[bool, typer.Option("--apply", help="Write sides and outlines into the rig file.")] = False,
    json: JsonOption = False,
) -> None:
    """Size both mirrors for an image window and gaze range.

    Says which gaze and pixel drive each side, and what to buy; with --apply the sizes are written into the rig file.
    Exit status 1 when the request cannot be met; the output then says what limits it and how much would fit. With
    --output also the trade-off over the distances d1 and d2, as CSV and PNG.

    \b
    Example:
      mirrorgaze size aqua2 --window 20x15deg --azimuth-deg -60 60 --elevation-deg -20 30 -o out/sizes
    """
    import math

    from cad.assembly.hull_surface import file_hull_distance
    from mirrorgaze.loading import how_to_apply, own_rig_file
    from optics.sizing.drivers import side_drivers
    from optics.sizing.gaze_range import GazeRange
    from optics.sizing.limits import Request
    from optics.sizing.sizing import size_mirrors
    from optics.sizing.window import parsed_window
    from optics.train import OpticalTrain
    from reports.studies.sizing import apply_sizes, driver_sentence, mountable, purchase, sizing_as_dict, write_sizing
    from rigs import Rig

    if apply:
        file = own_rig_file(rig)
    loaded = Rig.load(rig)
    if outline is not None:
        both = {"outline": outline.value}
        loaded = loaded.with_gaze(fold_mirror=both, gaze_mirror=both)
    request = Request(
        window=parsed_window(window, OpticalTrain.bare(loaded)),
        gaze=GazeRange.about_view(loaded.camera, azimuth_deg, elevation_deg),
        margin_m=margin_mm / 1000,
        angle_tolerance=math.radians(angle_tolerance_deg),
    )
    print_step("sizes ...")
    sizing = mountable(size_mirrors(loaded, request, file_hull_distance(loaded)))
    drivers = side_drivers(loaded, request)
    if json:
        print_json(sizing_as_dict(sizing, drivers))
    else:
        _print(rig, sizing)
        for driver in drivers:
            typer.echo(f"  {driver_sentence(driver, request.gaze.names)}")
        if not sizing.bindings:
            typer.echo(f"  buy: {purchase(sizing)}")
            if not apply:
                typer.echo(f"  {how_to_apply(rig)}")
    if output is not None:
        write_sizing(loaded, sizing, output, log=print_step)
    if sizing.bindings:
        raise typer.Exit(FAILED)
    if apply:
        apply_sizes(sizing, file)
        if not json:
            typer.echo(f"{file}: sizes written; check that the mount fits: mirrorgaze check {file} --cad")


def _print(name: str, sizing: Sizing) -> None:
    from reports.studies.sizing import asked_for, size_rows, would_fit

    typer.echo(f"{name}: {asked_for(sizing.request)}")
    print_table(size_rows(sizing))
    typer.echo(f"  the present mirrors pass {sizing.passed_now:.1%} of it (without margins)")
    for binding in sizing.bindings:
        typer.echo(f"  cannot be met, {binding.constraint}: {binding.message}")
    if sizing.bindings:
        typer.echo(f"  would fit: {would_fit(sizing)}")
