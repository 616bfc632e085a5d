"""A recorded dive, detected again with other settings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from mirrorgaze.options import JsonOption
from mirrorgaze.output import print_json, print_progress, print_step, print_table

REPORT_EVERY_FRAMES = 10

PRINTED = (
    "frames_with_target",
    "frames_detected",
    "frames_found",
    "frame_precision",
    "frame_recall",
    "frame_f1",
    "pixel_precision",
    "pixel_recall",
    "pixel_f1",
    "detected_error_rms_px",
)


def redetect(
    recorded: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a finished dive with a lossless video.")],
    detector: Annotated[
        str | None,
        typer.Option(
            help="Settings to start from: red-ball, narrow-hue, wide-hue, onnx:FILE.", show_default="the dive's"
        ),
    ] = None,
    hue_from_deg: Annotated[float | None, typer.Option(help="First hue of the target, in degrees.")] = None,
    hue_to_deg: Annotated[
        float | None, typer.Option(help="Last hue of the target, in degrees; a range may pass over 360.")
    ] = None,
    saturation_min: Annotated[float | None, typer.Option(help="Smallest saturation, 0 to 1.")] = None,
    value_min: Annotated[float | None, typer.Option(help="Smallest brightness, 0 to 1.")] = None,
    value_max: Annotated[float | None, typer.Option(help="Largest brightness, 0 to 1.")] = None,
    aspect_max: Annotated[float | None, typer.Option(help="Largest aspect ratio of a blob.")] = None,
    circularity_min: Annotated[float | None, typer.Option(help="Smallest circularity of a blob, 0 to 1.")] = None,
    area_min_px: Annotated[float | None, typer.Option(help="Smallest area of a blob, in pixels of the crop.")] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="Write into this folder.", show_default="DIR/redetected"),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Detect the target of a recorded dive again.

    Runs the detector with other settings on the recorded images and compares both runs with ground truth. Writes the
    log with the new detections (log.parquet), what the detector sees (overlay.mp4) and comparison.json. Without an
    option the settings are the dive's [offline_detector]. What the loop did stays as it was recorded. The dive of the
    example is made by: mirrorgaze dive wide-hue -o out/wide-hue

    \b
    Example:
      mirrorgaze redetect out/wide-hue
      mirrorgaze redetect out/wide-hue --hue-from-deg 220 --hue-to-deg 10 --aspect-max 4 -o out/wider
    """
    from dives.evaluation.redetection import Recording, changed_settings
    from dives.evaluation.redetection import redetect as detect_dive

    changes = {
        "hue_from_deg": hue_from_deg,
        "hue_to_deg": hue_to_deg,
        "saturation_min": saturation_min,
        "value_min": value_min,
        "value_max": value_max,
        "aspect_max": aspect_max,
        "circularity_min": circularity_min,
        "area_min_px": area_min_px,
    }
    given = {name: value for name, value in changes.items() if value is not None}
    settings = changed_settings(Recording(recorded).dive, detector, given)
    folder = output or recorded / "redetected"
    print_step("images ...")
    found = detect_dive(recorded, folder, settings, progress=_progress)
    if json:
        print_json(found | {"folder": str(folder)})
        return
    print_table([("", "recorded", "again", "gain"), *(_row(name, found) for name in PRINTED)])
    typer.echo(f"{folder}: log.parquet, overlay.mp4, comparison.json")


def _progress(done: int, total: int) -> None:
    if done % REPORT_EVERY_FRAMES == 0 or done == total:
        print_progress("redetect", done, total)


def _row(name: str, found: dict[str, dict[str, Any]]) -> tuple[str, ...]:
    recorded, again, gain = (found[kind][name] for kind in ("recorded", "again", "gain"))
    return (name, *("-" if value is None else f"{value:.4g}" for value in (recorded, again)), _signed(gain))


def _signed(value: float | None) -> str:
    return "-" if value is None else f"{value:+.4g}"
