"""The page of two rigs side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from reports.pages import content, page

DIFFERENCE = "Directions that one sees, the other, both"
CAPTIONS = {"rig": "beside its hull", "coverage": "what it sees"}


def comparison_page(numbers: Mapping[str, Any], images: Sequence[str], folder: Path) -> str:
    """Page of `DesignComparison.numbers` as HTML, with the images that lie in its folder embedded."""
    first, second = numbers["rigs"]
    names = {"a": first, "b": second}
    both = [image for image in images if image == "coverage_of_both.png"]
    sections: list[content.Block] = [
        content.Title(name=f"{first} and {second}"),
        content.section(
            "Numbers", content.table(["", "", first, second, "change"], figure_rows(numbers), numbers=[2, 3, 4])
        ),
        content.section("Keys that differ", content.table(["key", first, second], key_rows(numbers))),
        *_problems(numbers),
        *(
            content.section(
                f"{heading[0].upper()}{heading[1:]}",
                content.gallery(
                    content.figure(folder / image, f"{names[image[0]]}, {heading}")
                    for image in images
                    if image.endswith(f"_{kind}.png")
                ),
            )
            for kind, heading in CAPTIONS.items()
        ),
        *(content.section("What only one sees", content.figure(folder / image, DIFFERENCE)) for image in both),
        content.footer("Made by mirrorgaze compare-designs."),
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


def _problems(numbers: Mapping[str, Any]) -> list[content.Section]:
    return [
        content.section(f"What is wrong with {name}", content.bullets(problems))
        for name, problems in zip(numbers["rigs"], numbers["problems"], strict=True)
        if problems
    ]
