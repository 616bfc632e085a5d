"""What is wrong with a rig before any mount is made for it: its numbers, its hull, and the window in that."""

from __future__ import annotations

from optics.feasibility.feasibility import feasibility_problems
from rigs import Problem, Rig


def rig_problems(rig: Rig) -> list[Problem]:
    """Everything that makes a rig impossible or useless, its hull looked at whatever its kind.

    Raises
    ------
    ValueError
        When the file of a hull cannot be used.
    """
    hull = rig.file_hull
    if hull is None:
        return feasibility_problems(rig)
    # Hulls from files take libraries that others do not need.
    from cad.assembly.hull_surface import file_hull_distance  # noqa: PLC0415
    from cad.checks.file_hull_window import window_problems  # noqa: PLC0415

    problems = feasibility_problems(rig, file_hull_distance(rig))
    if not any(problem.place.startswith(("camera.", "port.")) for problem in problems):
        # A port inside the hull, or nowhere near it, has no window there.
        problems += window_problems(rig, hull)
    return problems
