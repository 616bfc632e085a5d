"""Placement: where camera, mirrors and anchors go on the robot's hull."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from mirrorgaze.options import JsonOption, RigArgument
from mirrorgaze.output import print_json, print_step, print_table

if TYPE_CHECKING:
    from cad.placement.placement import Placement


MOST_REJECTED = 5
"""Sentences on what was rejected; the most frequent come first."""


def print_placement(placement: Placement) -> None:
    """Print what was decided, why, and what was rejected."""
    from reports.studies.placement import placement_rows

    print_table((f"  {key}", value, reason) for key, value, reason in placement_rows(placement))
    for sentence in placement.rejected[:MOST_REJECTED]:
        typer.echo(f"  rejected, {sentence}")


def place(rig: RigArgument, json: JsonOption = False) -> None:
    """Place camera, mirrors and anchors on the hull.

    Decides the keys of a rig file that carry the comment "# placed", writes them into it, and says why each has its
    value and what was rejected. A key without that comment is pinned: take the comment away to keep a value, put it
    there to have it decided. When nothing fits, the command says what is in the way and writes nothing.

    \b
    Example:
      mirrorgaze place my-auv.toml
    """
    from reports.studies.placement import place_rig_file, placement_rows

    placement = place_rig_file(rig, log=print_step)
    if json:
        placed = [{"key": key, "value": value, "reason": reason} for key, value, reason in placement_rows(placement)]
        print_json({"placed": placed, "rejected": list(placement.rejected)})
        return
    typer.echo(f"{rig}: placed")
    print_placement(placement)
    typer.echo(f"next: mirrorgaze check {rig} --cad")
