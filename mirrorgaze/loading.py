"""Rigs for the commands: read, validated, and physically possible."""

from __future__ import annotations

import typer

from optics.feasibility.feasibility import feasibility_problems
from rigs import Rig, RigError


def load_usable_rig(name_or_path: str) -> Rig:
    """Read a rig; `RigError` with every problem when it is invalid or physically impossible."""
    rig = Rig.load(name_or_path)
    problems = feasibility_problems(rig)
    if problems:
        raise RigError(name_or_path, problems)
    return rig


def print_hull_notes(rig: Rig) -> list[str]:
    """Print on stderr what had to be done to a hull's file, and return it; `ValueError` for an unusable file."""
    if rig.file_hull is None:
        return []
    # Reading meshes takes libraries that other hulls do not need.
    from cad.hulls.hull_mesh import hull_notes

    notes = hull_notes(rig)
    for note in notes:
        typer.echo(note, err=True)
    return notes
