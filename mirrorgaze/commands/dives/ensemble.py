"""Many rendered dives: over seeds and settings, with intervals and comparisons."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mirrorgaze.errors import FAILED
from mirrorgaze.interrupts import stopping_says
from mirrorgaze.options import DiveArgument, JsonOption, SchedulerOption, ShardOption, WorkersOption
from mirrorgaze.output import print_json, print_step, print_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dives.ensembles.results import EnsembleResults
    from dives.ensembles.run import Outcome


def ensemble(
    dive: DiveArgument,
    seeds: Annotated[
        int, typer.Option(metavar="N", help="Number of dives of each setting, with seeds from 0.", min=1, max=10_000)
    ] = 8,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=VALUES",
            help="Vary a key of the dive file over values a,b or a range low..high; repeat for all combinations.",
        ),
    ] = None,
    points: Annotated[
        int, typer.Option(metavar="N", help="Number of random points of the ranges (Latin hypercube).", min=0)
    ] = 0,
    points_seed: Annotated[int, typer.Option(metavar="N", help="Random seed of these points.", min=0)] = 0,
    compare: Annotated[
        str | None,
        typer.Option(
            metavar="KEY", help="Compare the values of this key in pairs.", show_default="the first that is varied"
        ),
    ] = None,
    grid: Annotated[
        bool,
        typer.Option(
            "--grid", help="Compute what each key, and each pair of keys, does to the metrics: tables and figures."
        ),
    ] = False,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    shard: ShardOption = None,
    no_video: Annotated[
        bool, typer.Option("--no-video", help="Write no videos; render only what the loop looks at.")
    ] = False,
    require: Annotated[bool, typer.Option("--require", help="Exit with 1 when a dive fails.")] = False,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="Write into this folder.", show_default="out/DIVE-ensemble"),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Repeat a dive over seeds and settings, and compare.

    Each dive is written to a folder of its own; finished ones are kept, so that the same command continues where it was
    stopped, and more seeds or settings may be added. dives.csv has one line per dive, summary.csv and summary.md every
    setting's metrics with 95 % confidence intervals, differences.csv and differences.md those between the values of a
    key, over pairs of the same seed; ensemble.json has all of it. With --grid, effects.csv has the share of what varies
    that each key has and each two together, levels.csv their means, and a figure for each metric shows them. Keys that
    begin with rig. are those of the rig's file.

    \b
    Example:
      mirrorgaze ensemble spiral --seeds 8 --vary variant=default,paper -o out/loops
      mirrorgaze ensemble spiral --seeds 4 --vary depth_m=3..12 --points 10 --no-video -o out/depths
      mirrorgaze ensemble spiral --grid --vary jerlov_type=IB,II,III --vary target.diameter_m=0.1,0.2 --no-video
    """
    from dives.ensembles.members import Choice, members, parsed_variation
    from dives.ensembles.run import run_ensemble
    from optics.workers.shards import Shard

    variations = [parsed_variation(text) for text in vary or []]
    choices = [varied.key for varied in variations if isinstance(varied, Choice) and len(varied.values) > 1]
    if compare is not None and compare not in choices:
        raise ValueError(
            f"--compare {compare}: expected a key with two values or more ({', '.join(choices) or 'none'})"
        )
    if grid and (points or not choices):
        got = ", ".join(vary or []) or "none"
        raise ValueError(f"--grid: expected --vary KEY=VALUE,VALUE, two values or more and no ranges, got {got}")
    chosen = members(variations, seeds=range(seeds), points=points, points_seed=points_seed)
    folder = output or Path("out") / f"{Path(dive).stem}-ensemble"
    part = Shard.parsed(shard) if shard else None
    with stopping_says(f"{folder}: stopped; the same command continues from there"):
        print_step("dives ...")
        outcomes = run_ensemble(
            dive,
            chosen,
            folder,
            workers=workers or os.cpu_count() or 1,
            scheduler=scheduler,
            shard=part,
            log=print_step,
            video=not no_video,
        )
    failed = [outcome for outcome in outcomes if outcome.failure is not None]
    if part is None:
        _tell(outcomes, compare or (choices[0] if choices else None), folder, grid=grid, json=json)
    else:
        typer.echo(f"{folder}: {part.manifest_name}, a folder for each of {len(outcomes)} dives of {len(chosen)}")
    for outcome in failed:
        assert outcome.failure is not None
        typer.echo(f"mirrorgaze: {outcome.folder}: {outcome.failure.sentence}", err=True)
    if failed or (require and not all(outcome.metrics and outcome.metrics["passed"] for outcome in outcomes)):
        raise typer.Exit(FAILED)


def _tell(outcomes: Sequence[Outcome], compare: str | None, folder: Path, *, grid: bool, json: bool) -> None:
    from dives.ensembles.results import ensemble_results, write_results

    results = ensemble_results(outcomes, compare, grid=grid)
    files = write_results(results, folder)
    if grid:
        from reports.figures.factors import write_factors

        files += write_factors(results.effects, folder)
    if json:
        print_json(results.as_dict())
    else:
        _print(results)
        typer.echo(f"{folder}: {', '.join(files)}, a folder for each dive")
        for outcome in outcomes:
            if outcome.metrics and not outcome.metrics["passed"]:
                typer.echo(f"{outcome.member.name}: {outcome.metrics['verdict']}")


def _print(results: EnsembleResults) -> None:
    from dives.ensembles.factors import effects_table
    from dives.ensembles.tables import differences_table, summary_table

    print_table(summary_table(results.summary))
    if results.differences:
        typer.echo()
        print_table(differences_table(results.differences))
    if results.effects:
        typer.echo()
        print_table(effects_table(results.effects))
