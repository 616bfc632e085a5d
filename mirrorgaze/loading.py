"""Rigs and waters for the commands: read, validated, and physically possible."""

from __future__ import annotations

from pathlib import Path
from typing import cast, get_args

import typer

from optics.feasibility.feasibility import feasibility_problems
from rigs import JerlovType, Rig, RigError, Water, WaterSource
from rigs.files import PRESETS, find_rig
from rigs.water import TYPES_OF_SOURCE, check_type_of_source


def load_usable_rig(name_or_path: str) -> Rig:
    """Read a rig; `RigError` with every problem when it is invalid or physically impossible."""
    rig = Rig.load(name_or_path)
    problems = feasibility_problems(rig)
    if problems:
        raise RigError(name_or_path, problems)
    return rig


def own_rig_file(name_or_path: str) -> Path:
    """The user's rig file, to be written with --apply; `ValueError` for a preset."""
    file = find_rig(name_or_path)
    if _is_preset(file):
        raise ValueError(
            f"--apply: {name_or_path!r} is a preset; copy it first: mirrorgaze new my-rig --from {file.stem}"
        )
    return file


def how_to_apply(name_or_path: str) -> str:
    """How sizes that were printed come into a rig file."""
    file = find_rig(name_or_path)
    if _is_preset(file):
        return f"to use them: mirrorgaze new my-rig --from {file.stem}, then the same with my-rig.toml and --apply"
    return f"the same with --apply writes them into {name_or_path}"


def _is_preset(file: Path) -> bool:
    return file.resolve().parent == PRESETS.resolve()


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


def load_water(of: str, source: str | None) -> Water:
    """Water of a rig, of a Jerlov type, or pure; by a source of coefficients other than its own when one is named."""
    if source is not None and source not in TYPES_OF_SOURCE:
        raise ValueError(f"--source {source}: expected {' or '.join(TYPES_OF_SOURCE)}")
    if of == "pure":
        if source is not None:
            raise ValueError(f"--source {source}: expected with a Jerlov type only, got pure water")
        return Water(source="pure")
    named = cast("WaterSource | None", source)
    if of in get_args(JerlovType):
        check_type_of_source(of, source or "williamson-hollins")
        return Water().of_type(cast("JerlovType", of), named)
    own = load_usable_rig(of).water
    if named is None:
        return own
    if own.iop_file is not None or own.source == "pure":
        raise ValueError(f"--source {source}: expected a rig whose water is a Jerlov type, got {own.label}")
    return own.of_type(own.jerlov_type, named)
