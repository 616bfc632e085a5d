"""Pictures: what the camera sees through port and mirrors."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

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
    from scenes.views import View

SAMPLES = {"fast": 1, "reference": 64}
WIND_M_S = {"fast": None, "reference": 0.0}
"""Where nothing else is said: the reference renderer knows a flat sea only, the other blows as a stage does."""


def render(
    rig: RigArgument,
    q1: Annotated[float, typer.Option(help="Pan joint, degrees.")] = 0.0,
    q2: Annotated[float, typer.Option(help="Tilt joint, degrees; the gaze moves twice as far.")] = 0.0,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE", help="PNG (a picture) or EXR (radiance, ground truth).")
    ] = Path("view.png"),
    truth: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for ground truth: layers.exr, masks, boxes.json.")
    ] = None,
    sensor: Annotated[bool, typer.Option("--sensor", help="As the rig's image sensor takes it; PNG.")] = False,
    renderer: Annotated[Literal["fast", "reference"], typer.Option(help="The reference traces paths.")] = "fast",
    width: Annotated[int | None, typer.Option(help="Pixels; the camera's own by default.", min=1, max=20000)] = None,
    height: Annotated[int | None, typer.Option(help="Pixels; the camera's own by default.", min=1, max=20000)] = None,
    samples: Annotated[
        int | None, typer.Option(help="Per pixel; 1 by default, 64 for the reference.", min=1, max=1_000_000)
    ] = None,
    world: WorldOption = "tank",
    target: TargetOption = "red ball",
    blur: Annotated[bool, typer.Option("--blur", help="With the blur by light scattered forward.")] = False,
    snow: Annotated[bool, typer.Option("--snow", help="With marine snow.")] = False,
    seed: SeedOption = 0,
    depth: DepthOption = 5.0,
    water: WaterOption = None,
    sun_elevation: SunElevationOption = None,
    sun_azimuth: SunAzimuthOption = None,
    date: DateOption = None,
    latitude: LatitudeOption = None,
    longitude: LongitudeOption = None,
    cloud: CloudOption = 0.0,
    wind: Annotated[
        float | None, typer.Option(metavar="M/S", help="Over the sea: waves and flicker; 3 by default, 0 is flat.")
    ] = None,
    time: Annotated[float, typer.Option(metavar="S", help="Clock of waves, flicker and snow, seconds.")] = 0.0,
    stowed: Annotated[bool, typer.Option("--stowed", help="With the fold mirror swung out of the view.")] = False,
    json: JsonOption = False,
) -> None:
    """Render what the camera sees for a pose of the gaze mirror.

    The reference renderer (Mitsuba's volpathmis) knows a flat sea without snow.

    \b
    Example:
      mirrorgaze render aqua2 --q1 30 --q2 -10 -o view.png
      mirrorgaze render aqua2 --world reef --target diver --snow --depth 8 --sensor --truth truth
      mirrorgaze render aqua2 --date 2026-03-20T15:00:00-05:00 --latitude 20.5 --longitude -87 -o view.exr
    """
    from mirrorgaze.loading import load_usable_rig
    from scenes.views import Output, Shot, render_view

    loaded = load_usable_rig(rig)
    shot = Shot(
        q1_deg=q1,
        q2_deg=q2,
        time_s=time,
        stowed=stowed,
        width_px=width,
        height_px=height,
        samples=SAMPLES[renderer] if samples is None else samples,
        renderer=renderer,
        seed=seed,
        blur=blur,
    )
    files = Output(path=output, sensor=sensor, truth=truth)
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
        wind_m_s=WIND_M_S[renderer] if wind is None else wind,
        snow=snow,
    )
    stage = scenery.stage(loaded)
    view = render_view(
        loaded, stage, shot, files, progress=lambda done, total: print_progress("reference", done, total)
    )
    for note in view.notes:
        typer.echo(note, err=True)
    if json:
        print_json(view.as_dict())
        return
    first = "first frame, with compiling" if renderer == "fast" else f"reference, {shot.samples} samples"
    typer.echo(f"{output}: {view.width_px} x {view.height_px} px in {view.time_s:.2f} s ({first})")
    if truth is not None:
        typer.echo(f"{truth}: {view.truth_files} files of ground truth")
    print_table(_rows(view))


def _rows(view: View) -> list[tuple[str, str]]:
    rows = [(f"  {name}", f"{count} px") for name, count in view.region_px.items()]
    if view.gaze_deg is not None:
        rows += [(f"  gaze {name}", f"{value:.2f} deg") for name, value in view.gaze_deg.items()]
    rows += [(f"  sun {name}", f"{value:.2f} deg") for name, value in view.sun_deg.items()]
    if view.exposure is not None:
        rows += [
            ("  exposure time", f"{view.exposure['time_ms']:.3f} ms"),
            ("  gain", f"{view.exposure['gain_db']:.1f} dB"),
        ]
    return rows
