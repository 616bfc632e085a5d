"""The page of two rigs side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from reports.pages import page

DIFFERENCE = "Directions that one sees, the other, both"
CAPTIONS = {"rig": "beside its hull", "coverage": "what it sees"}


def comparison_page(numbers: Mapping[str, Any], pictures: Sequence[str], folder: Path) -> str:
    """Page of `DesignComparison.numbers` as HTML, with the pictures that lie in its folder embedded."""
    first, second = numbers["rigs"]
    names = {"a": first, "b": second}
    both = [picture for picture in pictures if picture == "coverage_of_both.png"]
    sections = [
        f"<h1>{page.text(first)} and {page.text(second)}</h1>",
        page.section("Numbers", page.table(["", "", first, second, "change"], figure_rows(numbers), numbers=[2, 3, 4])),
        page.section("Keys that differ", page.table(["key", first, second], key_rows(numbers))),
        *_problems(numbers),
        *(
            page.section(
                f"{heading[0].upper()}{heading[1:]}",
                page.gallery(
                    page.image(folder / picture, f"{names[picture[0]]}, {heading}")
                    for picture in pictures
                    if picture.endswith(f"_{kind}.png")
                ),
            )
            for kind, heading in CAPTIONS.items()
        ),
        *(page.section("What only one sees", page.image(folder / picture, DIFFERENCE)) for picture in both),
        "<footer>Made by mirrorgaze compare-designs.</footer>",
    ]
    return page.page(f"{first} and {second}", sections)


def figure_rows(numbers: Mapping[str, Any]) -> list[list[str]]:
    """Rows of name, unit, both values and their difference."""
    rows = []
    for each in numbers["figures"]:
        digits = DIGITS.get(each["unit"], 2)
        values = ["-" if each[key] is None else f"{each[key]:.{digits}f}" for key in ("first", "second")]
        rows.append([each["name"], each["unit"], *values, f"{each['change']:+.{digits}f}" if each["change"] else ""])
    return rows


def key_rows(numbers: Mapping[str, Any]) -> list[list[str]]:
    """Rows of key and both values."""
    return [
        [each["key"], *("-" if each[key] is None else str(each[key]) for key in ("first", "second"))]
        for each in numbers["keys"]
    ]


DIGITS = {"%": 1, "msr": 0, "g": 0, "cm3": 0, "mm": 1, "deg": 1, "times": 1}
"""Of a figure, by its unit."""


def _problems(numbers: Mapping[str, Any]) -> list[str]:
    return [
        page.section(f"What is wrong with {name}", page.bullets(problems))
        for name, problems in zip(numbers["rigs"], numbers["problems"], strict=True)
        if problems
    ]
