"""What a design search found: the rig as it is, members of the front that can be built, and those that cannot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from optics.search.objectives import Objective

COLUMNS = {"coverage": "{:.3f}", "area": "{:.0f}", "swept-volume": "{:.2f}", "resolution": "{:.0f}"}
HEADER = (
    "design",
    "d1 mm",
    "d2 mm",
    "M1 mm",
    "M2 mm",
    "coverage of the sphere",
    "area cm2",
    "swept l",
    "gaze px",
    "binding",
)


@dataclass(frozen=True, kw_only=True)
class SearchedDesign:
    """A design with what is known of it.

    Attributes
    ----------
    file : str, optional
        Rig file of a chosen one, in the search's folder.
    design_mm : dict of str to float
        Its numbers by their keys in the rig file.
    base_anchor_mm : list of float
    scores : dict of str to float or None
        By the objectives that were searched by; None for one that shows nothing.
    binding : list of str
        What keeps it from being better.
    figures : dict of str to float or None, optional
        By every objective there is, of the rig as it is and of chosen ones.
    problem : str, optional
        First thing wrong with the mount of one that was thrown out.
    """

    file: str | None = None
    design_mm: dict[str, float]
    base_anchor_mm: list[float]
    scores: dict[str, float | None]
    binding: list[str]
    figures: dict[str, float | None] | None = None
    problem: str | None = None

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON, of what is known."""
        return {name: value for name, value in asdict(self).items() if value is not None}


@dataclass(frozen=True, kw_only=True)
class SearchResults:
    """What was searched, and what was found.

    Attributes
    ----------
    rig : str
    objectives : sequence of Objective
    designs, seed : int
    bounds_mm : dict of str to list of float
        Least and largest value of each number.
    possible, front : int
        Designs that violate no condition; that no other beats.
    rejected : dict of str to int
        Designs by the condition that they violate.
    pixels_per_degree : float
        In the water in the middle of the image, whatever the mirrors.
    own : SearchedDesign
        The rig as it is.
    chosen, thrown_out : list of SearchedDesign
        Members of the front whose mounts can be built, and cannot.
    """

    rig: str
    objectives: Sequence[Objective]
    designs: int
    seed: int
    bounds_mm: dict[str, list[float]]
    possible: int
    rejected: dict[str, int]
    front: int
    pixels_per_degree: float
    own: SearchedDesign
    chosen: list[SearchedDesign]
    thrown_out: list[SearchedDesign]

    def as_dict(self) -> dict[str, Any]:
        """What `summary.json` holds."""
        return vars(self) | {
            "objectives": [
                {"name": each.name, "unit": each.unit, "larger_is_better": each.larger_is_better}
                for each in self.objectives
            ],
            "own": self.own.as_dict(),
            "chosen": [each.as_dict() for each in self.chosen],
            "thrown_out": [each.as_dict() for each in self.thrown_out],
        }

    def table(self) -> list[tuple[str, ...]]:
        """The rig and the chosen designs, each figure with what it is more than the rig's; the head first."""
        rows = [_row(str(number), each, self.own) for number, each in enumerate(self.chosen, start=1)]
        return [HEADER, _row("this rig", self.own, self.own), *rows]

    def problems_by_place(self) -> dict[str, tuple[int, str]]:
        """How many designs failed at each key of the rig file or part, and the first that did; most first."""
        places: dict[str, tuple[int, str]] = {}
        for each in self.thrown_out:
            place, _, rest = (each.problem or "").partition(" = ")
            count, example = places.get(place, (0, rest))
            places[place] = (count + 1, example)
        return dict(sorted(places.items(), key=lambda entry: -entry[1][0]))


def _row(label: str, design: SearchedDesign, own: SearchedDesign) -> tuple[str, ...]:
    names, numbers = ("fold_mirror", "gaze_mirror"), design.design_mm
    cells = [f"{numbers[f'{name}.distance_mm']:g}" for name in names]
    cells += [f"{numbers[f'{name}.width_mm']:g} x {numbers[f'{name}.height_mm']:g}" for name in names]
    figures, present = design.figures or {}, own.figures or {}
    for name, shown in COLUMNS.items():
        value, before = figures[name], present[name]
        if value is None:
            cells.append("-")
            continue
        more = "" if design is own or before is None else f" ({value / before - 1:+.0%})"
        cells.append(shown.format(value) + more)
    return (label, *cells, "; ".join(design.binding))
