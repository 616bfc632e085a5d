"""Corners: how far the paper's interpolation of the gaze mirror's corners is from the exact ones."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mirrorgaze.options import JsonOption, RigArgument
from mirrorgaze.output import print_json, print_step, print_table

POWERS = (1.0, 2.0, 3.0, 4.0)
"""Of eq. 6; the paper leaves p open."""


def corners(
    rig: RigArgument,
    samples: Annotated[
        str, typer.Option(metavar="N,N,...", help="Numbers of samples to try, square numbers separated by commas.")
    ] = "25,49,100,400",
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write a PNG with maps over both joints, and the means."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Evaluate the paper's interpolation of mirror corners.

    Compares inverse-distance weighting (eq. 6) with the exact corners of the gaze mirror. The samples are exact and
    stand on a square grid over the joints' range, so that the error is the interpolation's own: of a pose the root mean
    square of its four corners, in pixels of the image.

    \b
    Example:
      mirrorgaze corners aqua2 -o corner_error.png
    """
    from mirrorgaze.loading import load_usable_rig
    from tracking.perception.corners.errors import corner_error
    from tracking.perception.corners.inverse_distance import DEFAULT_POWER

    counts = _counts(samples)
    loaded = load_usable_rig(rig)
    loaded.require_gaze()
    print_step("corners ...")
    errors = {(count, power): corner_error(loaded, count, power) for count in counts for power in POWERS}
    if output is not None:
        from reports.figures.perception import draw_corner_errors

        draw_corner_errors(errors, output, power=DEFAULT_POWER)
    rows: list[dict[str, float]] = [
        {"samples": count, "power": power, "rms_px": each.rms_px, "p95_px": each.p95_px, "largest_px": each.largest_px}
        for (count, power), each in errors.items()
    ]
    if json:
        print_json({"rig": loaded.name, "errors": rows, "file": None if output is None else str(output)})
        return
    print_table([("samples", "power", "rms (px)", "95 %", "largest"), *map(_text_row, rows)])
    if output is not None:
        typer.echo(str(output))


def _text_row(row: dict[str, float]) -> tuple[str, ...]:
    numbers = (f"{row[key]:.1f}" for key in ("rms_px", "p95_px", "largest_px"))
    return (f"{row['samples']:.0f}", f"{row['power']:g}", *numbers)


def _counts(text: str) -> list[int]:
    try:
        return sorted({int(number) for number in text.split(",")})
    except ValueError:
        raise ValueError(f"expected --samples to be whole numbers separated by commas, got {text!r}") from None
