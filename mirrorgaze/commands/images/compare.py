"""The fast renderer beside the reference."""

from __future__ import annotations

from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mirrorgaze.options import JsonOption, PanOption, RigArgument, TiltOption
from mirrorgaze.output import print_json, print_progress, print_step, print_table
from mirrorgaze.scene_options import SceneOptions

if TYPE_CHECKING:
    from scenes.reference.compare import Comparison


def compare(
    rig: RigArgument,
    scene: SceneOptions,
    q1_deg: PanOption = 0.0,
    q2_deg: TiltOption = 0.0,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE", help="Write both and their difference to this PNG.")
    ] = Path("compare.png"),
    width_px: Annotated[int, typer.Option(metavar="N", help="Image width, in pixels.", min=1, max=20000)] = 160,
    height_px: Annotated[int, typer.Option(metavar="N", help="Image height, in pixels.", min=1, max=20000)] = 120,
    samples: Annotated[
        int, typer.Option(metavar="N", help="Paths per pixel of the reference.", min=2, max=1_000_000)
    ] = 64,
    target_distance_m: Annotated[
        float | None,
        typer.Option(
            help="Place the target on the gaze axis, at this distance from the last mirror, in metres.",
            show_default="where the world has it",
        ),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Compare the fast renderer with the reference.

    Renders one pose with both (the reference is Mitsuba's volpathmis) and writes fast, reference and their difference
    side by side (red: fast too bright, blue: too dark). Biases are in per cent of the reference, with the standard
    error that its noise leaves. The speed ratio is the time that the reference would need to know a pixel to 3 % over
    the time of a fast frame. The sea is flat and without snow: the reference has no others.

    \b
    Example:
      mirrorgaze compare aqua2 --q1-deg 30 --q2-deg -10 --water III --samples 256 -o compare.png
      mirrorgaze compare aqua2 --world blue --target buoy --target-distance-m 3 --sun-elevation-deg 40
    """
    from mirrorgaze.loading import load_usable_rig
    from scenes.image import check_image_path
    from scenes.reference.compare import compare as compare_renderers
    from scenes.stage.scene import on_gaze

    loaded = load_usable_rig(rig)
    check_image_path(output, ".png")
    target = None
    if target_distance_m is not None:
        target = on_gaze(loaded, q1=radians(q1_deg), q2=radians(q2_deg), distance_m=target_distance_m)
    print_step("light and both renderers ...")
    found = compare_renderers(
        loaded,
        scene.scene(loaded, target_m=target, flat_sea=True),
        q1_deg=q1_deg,
        q2_deg=q2_deg,
        path=output,
        width_px=width_px,
        height_px=height_px,
        samples=samples,
        seed=scene.seed,
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
