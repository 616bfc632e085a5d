"""Placement: where camera, mirrors and anchors go on the robot's hull."""

from __future__ import annotations

import typer

from mirrorgaze.options import JsonOption, RigArgument
from mirrorgaze.output import print_json, print_step, print_table


def place(rig: RigArgument, json: JsonOption = False) -> None:
    """Place camera, mirrors and anchors on the hull.

    Decides the keys of a rig file that carry the comment "# placed", writes them into it, and says why each has its
    value and what was rejected. A key without that comment is pinned: take the comment away to keep a value, put it
    there to have it decided. What does not fit is said, and nothing is written then.

    \b
    Example:
      mirrorgaze place my-auv.toml
    """
    from reports.studies.placement import place_rig_file, placement_rows

    placement = place_rig_file(rig, log=print_step)
    rows = placement_rows(placement)
    if json:
        placed = [{"key": key, "value": value, "reason": reason} for key, value, reason in rows]
        print_json({"placed": placed, "rejected": list(placement.rejected)})
        return
    typer.echo(f"{rig}: placed")
    print_table((f"  {key}", value, reason) for key, value, reason in rows)
    for sentence in placement.rejected[:5]:
        typer.echo(f"  rejected, {sentence}")
    typer.echo(f"next: mirrorgaze check {rig} --cad")
