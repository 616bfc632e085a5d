"""Design search: mirrors that are the best compromise between what they show and what they cost."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import Annotated

import typer

from mirrorgaze.interrupts import stopping_says
from mirrorgaze.options import JsonOption, RigArgument, SchedulerOption, SeedOption
from mirrorgaze.output import print_json, print_step, print_table


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
    apply: Annotated[
        int | None,
        typer.Option(metavar="N", help="Write design N of the table into the rig file.", min=1, show_default=False),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(metavar="N", help="Number of processes on this machine.", show_default="this one alone", min=1),
    ] = None,
    scheduler: SchedulerOption = None,
    json: JsonOption = False,
) -> None:
    """Search for mirrors that no other design beats.

    Varies distances and sizes, and writes the Pareto front (front.csv, search.png), some of its members as rig files
    whose mounts can be built, and summary.json. Prints these members beside the rig as it is; the same command with
    --apply N then writes one of them into the rig file. An interrupted search continues where it stopped, and finds the
    same with any number of processes.

    \b
    Example:
      mirrorgaze search aqua2 --objective coverage,area,resolution --designs 10000 -o out/search
    """
    from mirrorgaze.loading import load_usable_rig, own_rig_file
    from optics.workers.run import open_workers
    from reports.studies.searching.design_search import Wanted, apply_design, search_into
    from rigs.files import find_rig

    if apply is not None:
        own_rig_file(rig)
        if apply > rigs:
            raise ValueError(f"--apply {apply}: expected at most {rigs}, the number of designs that become rig files")
    wanted = Wanted(objectives=tuple(objective.split(",")), designs=designs, seed=seed, factor=factor, count=rigs)
    loaded = load_usable_rig(rig)
    folder = output or Path("out") / f"{loaded.name}-search"
    many = workers is not None or scheduler is not None
    with (
        stopping_says(f"{folder}: stopped; the same command continues from there"),
        open_workers(workers=workers or 1, scheduler=scheduler) if many else nullcontext() as opened,
    ):
        found = search_into(loaded, find_rig(rig), folder, wanted, workers=opened, log=print_step)
    if apply is not None:
        apply_design(found, apply, own_rig_file(rig))
    if json:
        print_json(found.as_dict())
        return
    typer.echo(f"{found.designs} designs, {found.possible} possible, {found.front} on the front")
    for name, count in found.rejected.items():
        typer.echo(f"  rejected by {name}: {count}")
    if found.thrown_out:
        looked = len(found.thrown_out) + len(found.chosen)
        typer.echo(f"  of {looked} mounts built and moved, {len(found.thrown_out)} rejected:")
        for place, (count, example) in found.problems_by_place().items():
            typer.echo(f"    {place}: {count}, such as {example}")
    print_table(found.table())
    typer.echo(f"{found.pixels_per_degree:.2f} px per degree in the middle of the image, whatever the mirrors")
    typer.echo(f"{folder}: front.csv, search.png, summary.json, {len(found.chosen)} rig files")
    if apply is not None:
        file = own_rig_file(rig)
        typer.echo(f"{file}: design {apply} written; check that the mount fits: mirrorgaze check {file} --cad")
    elif found.chosen:
        typer.echo("the same with --apply N writes design N into the rig file")
