"""The arena: dives that nobody wrote."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from mirrorgaze.errors import FAILED
from mirrorgaze.interrupts import stopping_says
from mirrorgaze.options import JsonOption, OpenOption, SchedulerOption, ShardOption, WorkersOption
from mirrorgaze.output import open_page, print_json, print_step, print_table


def arena(
    seeds: Annotated[
        int, typer.Option(metavar="N", help="Number of dives of each loop, one for each seed.", min=1, max=1000)
    ] = 100,
    first_seed: Annotated[
        int, typer.Option(metavar="N", help="First seed; those from 1000 on are held out for final tables.", min=0)
    ] = 0,
    variant: Annotated[
        str, typer.Option(metavar="NAMES", help="Variants of the loop, separated by commas.")
    ] = "default",
    ablate: Annotated[
        bool,
        typer.Option("--ablate", help="Dive the default loop without one of its parts as well, for each of them."),
    ] = False,
    worst: Annotated[
        int, typer.Option(metavar="N", help="Number of worst dives of each loop to draw images of.", min=0)
    ] = 10,
    worst_videos: Annotated[
        bool, typer.Option("--worst-videos", help="Write those of the first loop as videos, too.")
    ] = False,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    shard: ShardOption = None,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="DIR", help="Write into this folder.")] = Path(
        "out/arena"
    ),
    browse: OpenOption = False,
    json: JsonOption = False,
) -> None:
    """Judge a loop on dives that are drawn at random.

    Draws a dive for each seed (world, water, rig, path, speed, sway, target's size, start bearing, decoys, a ball in
    the way), dives it without video, and says how often and when the target was acquired, which share of the time in
    which it could be seen it was held, and what else was followed, with 95 % confidence intervals and by factor. Writes
    dives.csv, summary.csv, arena.json and report.html with images of the worst dives. Finished dives are kept: the same
    command continues, and more seeds or loops may be added.

    --ablate adds the default loop without its contrast, without its waiting, and so on (their names may be given to
    --variant, too), and reports how far each differs from the default on the same dives.

    \b
    Example:
      mirrorgaze arena -o out/arena --worst-videos
      mirrorgaze arena --seeds 20 --variant default,paper -o out/loops
      mirrorgaze arena --ablate -o out/ablation
    """
    from dives.arena.run import run_arena
    from optics.workers.shards import Shard
    from reports.studies.arena_report import write_arena_report
    from tracking.loop.ablations import ABLATIONS, DEFAULT

    variants = [name.strip() for name in variant.split(",")]
    if ablate and variants[0] != DEFAULT.name:
        raise ValueError(f"--ablate: expected {DEFAULT.name} as the first --variant, got {variants[0]}")
    variants = list(dict.fromkeys([*variants, *(ABLATIONS if ablate else ())]))
    at_a_time = workers or os.cpu_count() or 1
    part = Shard.parsed(shard) if shard else None
    with stopping_says(f"{output}: stopped; the same command continues from there"):
        print_step("dives ...")
        outcomes = run_arena(
            range(first_seed, first_seed + seeds),
            variants,
            output,
            workers=at_a_time,
            scheduler=scheduler,
            shard=part,
            log=print_step,
        )
        if part is None:
            print_step("report ...")
            found = write_arena_report(
                outcomes,
                output,
                worst=worst,
                videos=worst_videos,
                workers=at_a_time,
                scheduler=scheduler,
                log=print_step,
            )
    if part is not None:
        dives = seeds * len(variants)
        typer.echo(f"{output}: {part.manifest_name}, a folder for each of {len(outcomes)} dives of {dives}")
    elif json:
        print_json(found.as_dict())
    else:
        print_table(found.table())
        if len(variants) > 1:
            typer.echo()
            print_table(found.difference_table())
        typer.echo(f"{output}: report.html, arena.json, dives.csv, summary.csv, a folder for each dive")
    if browse and part is None:
        open_page(output / "report.html")
    failed = [outcome for outcome in outcomes if outcome.failure is not None]
    for outcome in failed:
        assert outcome.failure is not None
        typer.echo(f"mirrorgaze: {outcome.folder}: {outcome.failure.sentence}", err=True)
    if failed:
        raise typer.Exit(FAILED)
