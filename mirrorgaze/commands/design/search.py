"""Design search: mirrors that are the best compromise between what they show and what they cost."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from mirrorgaze.options import JsonOption, RigArgument, SeedOption
from mirrorgaze.output import print_json, print_note, print_table


def search(
    rig: RigArgument,
    objective: Annotated[
        str, typer.Option(help="Two or more of coverage, area, swept-volume and resolution, separated by commas.")
    ] = "coverage,area,swept-volume,resolution",
    designs: Annotated[
        int, typer.Option(metavar="N", help="Number of designs to evaluate.", min=1, max=1_000_000)
    ] = 10_000,
    seed: SeedOption = 0,
    factor: Annotated[
        float, typer.Option(help="Vary each number between the rig's divided by and multiplied by this.")
    ] = 1.5,
    rigs: Annotated[
        int, typer.Option(metavar="N", help="Number of designs of the front to write as rig files.", min=1, max=60)
    ] = 12,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="Write into this folder.", show_default="out/RIG-search"),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Search for mirrors that no other design beats.

    Varies distances and sizes, and writes the Pareto front (front.csv, search.png), some of its members as rig files
    whose mounts can be built, and summary.json. An interrupted search continues where it stopped.

    \b
    Example:
      mirrorgaze search aqua2 --objective coverage,area,resolution --designs 10000 -o out/search
    """
    from mirrorgaze.loading import load_usable_rig
    from reports.studies.design_search import Wanted, search_into
    from rigs.files import find_rig

    wanted = Wanted(objectives=tuple(objective.split(",")), designs=designs, seed=seed, factor=factor, count=rigs)
    loaded = load_usable_rig(rig)
    folder = output or Path("out") / f"{loaded.name}-search"
    found = search_into(loaded, find_rig(rig), folder, wanted, log=print_note)
    if json:
        print_json(found)
        return
    typer.echo(f"{found['designs']} designs, {found['possible']} possible, {found['front']} on the front")
    for name, count in found["rejected"].items():
        typer.echo(f"  rejected by {name}: {count}")
    if found["thrown_out"]:
        looked = len(found["thrown_out"]) + len(found["chosen"])
        typer.echo(f"  of {looked} mounts built and moved, {len(found['thrown_out'])} rejected:")
        for place, (count, example) in _by_place(found["thrown_out"]).items():
            typer.echo(f"    {place}: {count}, such as {example}")
    names = [item["name"] for item in found["objectives"]]
    rows = [("", *names, "binding"), _row("this rig", found["own"], names)]
    print_table(rows + [_row(item["file"], item, names) for item in found["chosen"]])
    typer.echo(f"{folder}: front.csv, search.png, summary.json, {len(found['chosen'])} rig files")


def _by_place(thrown_out: list[dict[str, Any]]) -> dict[str, tuple[int, str]]:
    """How many designs failed at each key of the rig file or part, and the first that did."""
    places: dict[str, tuple[int, str]] = {}
    for item in thrown_out:
        place, _, rest = item["problem"].partition(" = ")
        count, example = places.get(place, (0, rest))
        places[place] = (count + 1, example)
    return dict(sorted(places.items(), key=lambda entry: -entry[1][0]))


def _row(label: str, item: dict[str, Any], names: list[str]) -> tuple[str, ...]:
    scores = ("-" if item["scores"][name] is None else f"{item['scores'][name]:.4g}" for name in names)
    return (label, *scores, "; ".join(item["binding"]))
