"""Rigs for the commands: read, validated, and physically possible."""

from __future__ import annotations

from optics.feasibility import feasibility_problems
from rigs import Rig, RigError


def load_usable_rig(name_or_path: str) -> Rig:
    """Read a rig; `RigError` with every problem when it is invalid or physically impossible."""
    rig = Rig.load(name_or_path)
    problems = feasibility_problems(rig)
    if problems:
        raise RigError(name_or_path, problems)
    return rig
