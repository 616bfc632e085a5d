"""How large the mirrors have to be for a window and a range of gazes, on a report's page."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from reports.pages import content


@dataclass(frozen=True, kw_only=True)
class SizedMirror:
    """A mirror as it is and as the view asks for, width x height in millimetres with its outline; None for none."""

    name: str
    present: str
    needed: str | None


@dataclass(frozen=True, kw_only=True)
class SizingResults:
    """What the mirrors of a rig would have to be.

    Attributes
    ----------
    view : str
        Window and range of gazes, in words.
    passed_fraction : float
        Of that, what the present mirrors pass, without margins.
    mirrors : tuple of SizedMirror
    drivers : tuple of str
        Which gaze and pixel drive each side, in sentences.
    obstacles : tuple of str
        What keeps the view from being met, in sentences.
    purchase : str
        What to buy for it; empty where it cannot be met.
    figure : str
        Named from the report's folder.
    """

    view: str
    passed_fraction: float
    mirrors: tuple[SizedMirror, ...]
    drivers: tuple[str, ...]
    obstacles: tuple[str, ...]
    purchase: str
    figure: str


def sizing_section(found: SizingResults, folder: Path) -> content.Section:
    """Section on the mirrors' sizes, whose figure lies in a report's folder."""
    return content.section(
        "Mirror sizes",
        content.paragraph(
            f"For {found.view}: the present mirrors pass {found.passed_fraction:.1%} of it, without margins."
        ),
        content.table(
            ["Mirror", "Present (mm)", "Needed (mm)"],
            [[each.name, each.present, each.needed or "no finite mirror"] for each in found.mirrors],
        ),
        content.figure(folder / found.figure, "What the view needs of each mirror, in its own axes"),
        content.bullets([*found.drivers, *(f"Cannot be met: {each}" for each in found.obstacles)]),
        *([content.paragraph(f"To buy for it: {found.purchase}.")] if found.purchase else []),
    )
