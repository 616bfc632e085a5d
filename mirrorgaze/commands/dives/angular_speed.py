"""The largest angular speed of a target that a rig and a loop can follow."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from mirrorgaze.options import JsonOption, RigArgument
from mirrorgaze.output import print_json, print_progress, print_step, print_table

if TYPE_CHECKING:
    from dives.evaluation.tracking_rate import LargestSpeed

ARCS_DEG: tuple[tuple[Literal["azimuth", "elevation"], float, float], ...] = (
    ("azimuth", -60.0, 60.0),
    ("elevation", -40.0, 60.0),
)
"""Arcs that most rigs reach."""


def angular_speed(
    rig: RigArgument,
    variant: Annotated[
        str, typer.Option(help="Variants of the loop, separated by commas: default, paper, paper-literal.")
    ] = "default",
    seeds: Annotated[
        int, typer.Option(metavar="N", help="Number of power-ons of the servos, with seeds from 0.", min=1)
    ] = 3,
    distance_m: Annotated[float, typer.Option(help="Distance of the target from the gaze mirror, in metres.")] = 2.0,
    radius_m: Annotated[float, typer.Option(help="Radius of the ball, in metres.")] = 0.1,
    frame_rate_hz: Annotated[float, typer.Option(help="Images per second.")] = 30.0,
    json: JsonOption = False,
) -> None:
    """Find the largest angular speed that the loop follows.

    A ball passes along an arc, level from right to left and from below to above the bow, faster and faster; it is
    followed while the detector never misses it in more than five images in a row. Images are drawn, not rendered:
    geometry, servos, latency and control count, water and light do not.

    \b
    Example:
      mirrorgaze angular-speed aqua2 --variant default,paper
    """
    from dives.evaluation.tracking_rate import Arc, largest_angular_speed
    from mirrorgaze.loading import load_usable_rig
    from tracking.loop.offline import variant_named

    loaded = load_usable_rig(rig)
    variants = [variant_named(name.strip(), turning=True) for name in variant.split(",")]
    arcs = [
        Arc(axis=axis, from_deg=from_deg, to_deg=to_deg, distance_m=distance_m, radius_m=radius_m)
        for axis, from_deg, to_deg in ARCS_DEG
    ]
    print_step("passes of the ball ...")
    found = []
    for each in variants:
        for arc in arcs:
            progress = partial(print_progress, f"{each.name}, {arc.axis}")
            speed = largest_angular_speed(
                loaded, each, arc, seeds=seeds, frame_rate_hz=frame_rate_hz, progress=progress
            )
            found.append((each.name, speed))
    if json:
        print_json([_data(name, speed) for name, speed in found])
        return
    head = ("loop", "axis", "largest speed, deg/s", "gaze error there, RMS deg")
    print_table([head, *(_row(name, speed) for name, speed in found)])


def _row(name: str, speed: LargestSpeed) -> tuple[str, ...]:
    errors = [error for error in speed.errors_deg if error is not None]
    error = f"{max(errors):.3g}" if errors else "-"
    return (name, speed.arc.axis, str(speed.interval), error)


def _data(name: str, speed: LargestSpeed) -> dict[str, Any]:
    from dataclasses import asdict

    return {"variant": name, **asdict(speed)}
