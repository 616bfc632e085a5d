"""Images: what the camera sees through port and mirrors."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from mirrorgaze.options import HeightOption, JsonOption, PanOption, RigArgument, TiltOption, WidthOption
from mirrorgaze.output import print_json, print_progress, print_table
from mirrorgaze.scene_options import SceneOptions

if TYPE_CHECKING:
    from scenes.requests.request import RenderResult

SAMPLES = {"fast": 1, "reference": 64}


def render(
    rig: RigArgument,
    scene: SceneOptions,
    q1_deg: PanOption = 0.0,
    q2_deg: TiltOption = 0.0,
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="FILE", help="Write a PNG (sRGB) or an EXR (radiance, ground truth)."),
    ] = Path("view.png"),
    ground_truth: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Write ground truth here: layers.exr, masks, boxes.json.")
    ] = None,
    sensor: Annotated[bool, typer.Option("--sensor", help="Render as the rig's image sensor takes it.")] = False,
    renderer: Annotated[
        Literal["fast", "reference"], typer.Option(help="Renderer; the reference is Mitsuba's path tracer.")
    ] = "fast",
    width_px: WidthOption = None,
    height_px: HeightOption = None,
    samples: Annotated[
        int | None,
        typer.Option(
            metavar="N", help="Samples per pixel.", show_default="1; 64 for the reference", min=1, max=1_000_000
        ),
    ] = None,
    time_s: Annotated[float, typer.Option(help="Time on the clock of waves, flicker and snow, in seconds.")] = 0.0,
    blur: Annotated[bool, typer.Option("--blur", help="Add the blur by forward scattering.")] = False,
    stowed: Annotated[bool, typer.Option("--stowed", help="Swing the fold mirror out of the view.")] = False,
    light: Annotated[
        Literal["draft", "full"],
        typer.Option(help="Light between surfaces; where full light is not known yet, a draft is written first."),
    ] = "full",
    json: JsonOption = False,
) -> None:
    """Render what the camera sees.

    The reference renderer (Mitsuba's volpathmis) has a flat sea and no snow.

    \b
    Example:
      mirrorgaze render aqua2 --q1-deg 30 --q2-deg -10 -o view.png
      mirrorgaze render aqua2 --world reef --target diver --snow --depth-m 8 --sensor --ground-truth truth
      mirrorgaze render aqua2 --date 2026-03-20T15:00:00-05:00 --latitude-deg 20.5 --longitude-deg -87 -o view.exr
    """
    from cad.assembly.meshes import meshes_beside
    from rigs import Rig

    # The robot's parts are made while what renders is loaded, and the world made.
    with meshes_beside(Rig.load(rig), stowed=stowed):
        from mirrorgaze.loading import load_usable_rig
        from optics.kernels.clock import CLOCK
        from optics.workers.threads import resting_threads
        from scenes.requests.render import render
        from scenes.requests.request import Output, RenderRequest

        CLOCK.begin("scene")
        loaded = load_usable_rig(rig)
        request = RenderRequest(
            q1_deg=q1_deg,
            q2_deg=q2_deg,
            time_s=time_s,
            stowed=stowed,
            width_px=width_px,
            height_px=height_px,
            samples=SAMPLES[renderer] if samples is None else samples,
            renderer=renderer,
            seed=scene.seed,
            blur=blur,
            light=light,
        )
        files = Output(path=output, sensor=sensor, truth=ground_truth)
        # Half of the time goes into what Python does between two kernels.
        with resting_threads():
            view = render(
                loaded,
                scene.scene(loaded, flat_sea=renderer == "reference"),
                request,
                files,
                progress=lambda done, total: print_progress("reference", done, total),
                on_draft=lambda draft: typer.echo(f"{output}: draft, in rough light; the full light follows", err=True),
            )
    for note in view.notes:
        typer.echo(note, err=True)
    if json:
        print_json(view.as_dict())
        return
    how = f" (reference, {request.samples} samples)" if renderer == "reference" else ""
    how = how or (" (draft, in rough light)" if view.light == "draft" else "")
    typer.echo(f"{output}: {view.width_px} x {view.height_px} px{how}")
    if ground_truth is not None:
        typer.echo(f"{ground_truth}: {view.truth_files} files of ground truth")
    print_table(_rows(view))


def _rows(view: RenderResult) -> list[tuple[str, str]]:
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
