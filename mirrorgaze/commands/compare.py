"""The fast renderer beside the reference."""

from __future__ import annotations

from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mirrorgaze.output import JsonOption, RigArgument, print_json, print_progress, print_table
from mirrorgaze.scenery import (
    CloudOption,
    DateOption,
    DepthOption,
    LatitudeOption,
    LongitudeOption,
    Scenery,
    SeedOption,
    SunAzimuthOption,
    SunElevationOption,
    SunOptions,
    TargetOption,
    WaterOption,
    WorldOption,
)

if TYPE_CHECKING:
    from scenes.reference.compare import Comparison


def compare(
    rig: RigArgument,
    q1: Annotated[float, typer.Option(help="Pan joint, degrees.")] = 0.0,
    q2: Annotated[float, typer.Option(help="Tilt joint, degrees; the gaze moves twice as far.")] = 0.0,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="PNG, side by side.")] = Path(
        "compare.png"
    ),
    width: Annotated[int, typer.Option(help="Pixels.", min=1, max=20000)] = 160,
    height: Annotated[int, typer.Option(help="Pixels.", min=1, max=20000)] = 120,
    samples: Annotated[int, typer.Option(help="Paths per pixel of the reference.", min=2, max=1_000_000)] = 64,
    world: WorldOption = "tank",
    target: TargetOption = "red ball",
    distance: Annotated[
        float | None, typer.Option(metavar="M", help="Hang the target on the gaze axis, metres from the last mirror.")
    ] = None,
    seed: SeedOption = 0,
    depth: DepthOption = 5.0,
    water: WaterOption = None,
    sun_elevation: SunElevationOption = None,
    sun_azimuth: SunAzimuthOption = None,
    date: DateOption = None,
    latitude: LatitudeOption = None,
    longitude: LongitudeOption = None,
    cloud: CloudOption = 0.0,
    json: JsonOption = False,
) -> None:
    """Render a pose with the fast renderer and with stock Mitsuba volpathmis, and tell how far they are apart.

    Writes fast, reference and their difference side by side (red: fast too bright, blue: too dark). Biases are in per
    cent of the reference, with the standard error that its noise leaves. The speed ratio is the time the reference
    would need to know a pixel to 3 % over the time of a fast frame. The sea is flat: the reference knows no waves.

    \b
    Example:
      mirrorgaze compare aqua2 --q1 30 --q2 -10 --water III --samples 256 -o compare.png
      mirrorgaze compare aqua2 --world blue --target buoy --distance 3 --sun-elevation 40
    """
    from mirrorgaze.loading import load_usable_rig
    from scenes.image import check_image_path
    from scenes.reference.compare import compare as compare_renderers
    from scenes.stage import on_gaze

    loaded = load_usable_rig(rig)
    check_image_path(output, ".png")
    scenery = Scenery(
        world=world,
        target=target,
        seed=seed,
        depth_m=depth,
        jerlov_type=water,
        sun=SunOptions(
            elevation_deg=sun_elevation,
            azimuth_deg=sun_azimuth,
            date=date,
            latitude_deg=latitude,
            longitude_deg=longitude,
        ),
        cloud=cloud,
        wind_m_s=0.0,
    )
    place = None if distance is None else on_gaze(loaded, q1=radians(q1), q2=radians(q2), distance_m=distance)
    found = compare_renderers(
        loaded,
        scenery.stage(loaded, target_m=place),
        q1_deg=q1,
        q2_deg=q2,
        path=output,
        width_px=width,
        height_px=height,
        samples=samples,
        seed=seed,
        progress=lambda done, total: print_progress("reference", done, total),
    )
    for note in found.notes:
        typer.echo(note, err=True)
    if json:
        print_json(found.as_dict())
        return
    typer.echo(f"{output}: fast, reference, difference")
    print_table(_rows(found))
    error, needed = found.reference_pixel_error, found.reference_time_to_3_percent_s
    typer.echo(f"fast: {1000 * found.fast_time_s:.1f} ms a frame, 1 sample per pixel, no noise")
    typer.echo(f"reference: {found.reference_time_s:.1f} s for {found.reference_samples} samples, {error:.0%} noise")
    typer.echo(f"to know a pixel to 3 % it would need {needed:.0f} s: {found.speed_ratio:.0f} x the fast frame's time")


def _rows(found: Comparison) -> list[tuple[str, ...]]:
    """A row for each set of pixels: per channel the reference's mean, the bias with its error, and z."""
    head = ("", "pixels", *(f"{name} mean, bias %, z" for name in ("red", "green", "blue")))
    rows = []
    for each in found.agreements:
        cells = (
            f"{mean:.4g}  {100 * bias:+.1f} ± {100 * error:.1f}  {z:+.1f}"
            for mean, bias, error, z in zip(each.reference, each.bias, each.standard_error, each.z, strict=True)
        )
        rows.append((each.name, str(each.pixels), *cells))
    return [head, *rows]
