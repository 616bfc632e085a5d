"""The largest angular speed of a target that a rig and a loop can follow."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from mirrorgaze.output import JsonOption, RigArgument, print_json, print_progress, print_table

if TYPE_CHECKING:
    from tracking.metrics.angular_speed import LargestSpeed

ARCS_DEG: tuple[tuple[Literal["azimuth", "elevation"], float, float], ...] = (
    ("azimuth", -60.0, 60.0),
    ("elevation", -40.0, 60.0),
)
"""Arcs that most rigs reach."""


def angular_speed(
    rig: RigArgument,
    variant: Annotated[str, typer.Option(help="Loops, with commas: default, paper, paper-literal.")] = "default",
    seeds: Annotated[int, typer.Option(help="Power-ons of the servos: seeds 0 to this less one.", min=1)] = 3,
    distance: Annotated[float, typer.Option(help="Of the target from the gaze mirror, metres.")] = 2.0,
    radius: Annotated[float, typer.Option(help="Of the ball, metres.")] = 0.1,
    rate: Annotated[float, typer.Option(help="Pictures a second.")] = 30.0,
    json: JsonOption = False,
) -> None:
    """Find how fast a target may pass before the loop loses it: around the robot, and over it.

    Pictures are drawn, not rendered: geometry, servos, latency and control count, water and light do not. A ball passes
    along an arc, level from right to left and from below to above the bow, faster and faster; it is followed when the
    detector never misses it in more than five pictures in a row.

    \b
    Example:
      mirrorgaze angular-speed aqua2 --variant default,paper
    """
    from mirrorgaze.loading import load_usable_rig
    from tracking.metrics.angular_speed import Arc, largest_angular_speed
    from tracking.offline import variant_named

    loaded = load_usable_rig(rig)
    variants = [variant_named(name.strip(), turning=True) for name in variant.split(",")]
    arcs = [
        Arc(axis=axis, from_deg=from_deg, to_deg=to_deg, distance_m=distance, radius_m=radius)
        for axis, from_deg, to_deg in ARCS_DEG
    ]
    found = []
    for each in variants:
        for arc in arcs:
            progress = partial(print_progress, f"{each.name}, {arc.axis}")
            speed = largest_angular_speed(loaded, each, arc, seeds=seeds, frame_rate_hz=rate, progress=progress)
            found.append((each.name, speed))
    if json:
        print_json([_data(name, speed) for name, speed in found])
        return
    head = ("loop", "axis", "largest speed, deg/s", "gaze error there, RMS deg")
    print_table([head, *(_row(name, speed) for name, speed in found)])


def _row(name: str, speed: LargestSpeed) -> tuple[str, ...]:
    from tracking.ensembles.tables import interval_text

    errors = [error for error in speed.errors_deg if error is not None]
    error = f"{max(errors):.3g}" if errors else "-"
    return (name, speed.arc.axis, interval_text(speed.interval), error)


def _data(name: str, speed: LargestSpeed) -> dict[str, Any]:
    from dataclasses import asdict

    return {"variant": name, **asdict(speed)}
