"""Two rigs side by side."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mirrorgaze.options import JsonOption, OpenOption
from mirrorgaze.output import open_page, print_json, print_note, print_step, print_table

if TYPE_CHECKING:
    from reports.studies.compare_designs import DesignComparison


def compare_designs(
    first: Annotated[str, typer.Argument(metavar="A", help="Preset name or rig file.")],
    second: Annotated[str, typer.Argument(metavar="B", help="Preset name or rig file.")],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="Write a page with images and maps into this folder."),
    ] = None,
    browse: OpenOption = False,
    json: JsonOption = False,
) -> None:
    """Compare two rigs: their keys, numbers and views.

    Prints the keys of the rig files that differ, what is wrong with each rig, and the numbers of both: coverage, field
    of view, resolution, mirrors, mass, trim and servos. With --output also maps of what each sees and of what only one
    does, images of both beside their hulls, and a page of it all (compare.html).

    \b
    Example:
      mirrorgaze compare-designs aqua2 my-auv.toml -o out/compare
    """
    from reports.studies.compare_designs import compare_designs as compared
    from rigs import Rig

    if browse and output is None:
        raise ValueError("--open: expected --output DIR beside it, where the page is written")
    comparison = compared(Rig.load(first), Rig.load(second), log=print_step)
    files = [] if output is None else comparison.write(output)
    if browse:
        open_page(next(file for file in files if file.suffix == ".html"))
    if json:
        print_json({**comparison.numbers, "files": [str(file) for file in files]})
        return
    _print(comparison)
    for file in files:
        print_note(str(file))


def _print(comparison: DesignComparison) -> None:
    from reports.pages.design_comparison import figure_rows, key_rows

    numbers = comparison.numbers
    names = numbers["rigs"]
    print_table([("", "", *names, "change"), *figure_rows(numbers)])
    typer.echo()
    if numbers["keys"]:
        print_table([("key", *names), *key_rows(numbers)])
    else:
        typer.echo("no key differs")
    for name, problems in zip(names, numbers["problems"], strict=True):
        for problem in problems:
            typer.echo(f"{name}: {problem}")
