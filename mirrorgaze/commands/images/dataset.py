"""Data sets: many images with their ground truth."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Literal

import typer

from mirrorgaze.errors import FAILED
from mirrorgaze.interrupts import stopping_says
from mirrorgaze.options import JsonOption, LightOption, SchedulerOption, ShardOption, WorkersOption
from mirrorgaze.output import print_json, print_note, print_progress, print_step


def dataset(
    spec: Annotated[
        Path | None, typer.Argument(metavar="SPEC", help="Data-set file (TOML).", show_default=False)
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="Write into this folder.", show_default="out/NAME"),
    ] = None,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    shard: ShardOption = None,
    light: LightOption = "full",
    verify: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Verify a finished data set, or recorded episodes, instead.")
    ] = None,
    schema: Annotated[bool, typer.Option("--schema", help="Print the JSON Schema of data-set files instead.")] = False,
    json: JsonOption = False,
) -> None:
    """Render a data set, or verify one.

    Every sample is known by the file's seed and its number. It has an image, depth, normals, labels, instances and
    over which mirrors each pixel is seen as PNG, and a record (JSON) of joints, gaze, poses, camera and boxes;
    samples.parquet is the table of all, manifest.json has their digests. What is there is kept: the same command
    continues, and more samples may be added.

    \b
    Example:
      mirrorgaze dataset balls.toml -o out/balls
      mirrorgaze dataset balls.toml -o out/balls --shard 2/8
      mirrorgaze dataset --verify out/balls
    """
    if sum((spec is not None, verify is not None, schema)) != 1:
        raise typer.BadParameter("expected one of SPEC, --verify DIR and --schema")
    if schema:
        _print_schema()
    elif verify is not None:
        _verify(verify, json=json)
    else:
        assert spec is not None  # one of the three was given
        _make(spec, output, workers or os.cpu_count() or 1, scheduler, shard, light, json=json)


def _print_schema() -> None:
    from dives.datasets.specification import DatasetSpecification

    print_json(DatasetSpecification.model_json_schema())


def _verify(folder: Path, *, json: bool) -> None:
    from dives.datasets.check import check_dataset
    from dives.environment.recording_check import check_recording, is_recording

    if is_recording(folder):
        found = check_recording(folder)
    else:
        found = check_dataset(folder, progress=lambda done, total: print_progress("samples", done, total))
    if json:
        print_json(
            {
                "samples": found.samples,
                "files": found.files,
                "problems": list(found.problems),
                "notes": list(found.notes),
            }
        )
    else:
        order = f"{len(found.problems)} problems" if found.problems else "in order"
        typer.echo(f"{folder}: {found.samples} samples, {found.files} files read: {order}")
        for sentence in (*found.problems, *found.notes):
            print_note(sentence)
    if found.problems:
        raise typer.Exit(FAILED)


def _make(
    spec: Path,
    output: Path | None,
    workers: int,
    scheduler: str | None,
    shard: str | None,
    light: Literal["draft", "full"],
    *,
    json: bool,
) -> None:
    from dives.datasets.dataset import Dataset
    from dives.datasets.run import make_dataset
    from optics.workers.shards import Shard
    from scenes.baking.light_quality import LightQuality

    part = Shard.parsed(shard) if shard else None
    loaded = Dataset.load(spec, quality=LightQuality.named(light))
    folder = output or Path("out") / loaded.spec.name
    with stopping_says(f"{folder}: stopped; the same command continues from there"):
        made = make_dataset(
            loaded,
            folder,
            workers=workers,
            scheduler=scheduler,
            shard=part,
            progress=lambda done, total: print_progress("samples", done, total),
            log=print_step,
        )
    draft = " (draft, in rough light)" if light == "draft" else ""
    if json:
        print_json(made.as_dict())
    elif made.files:
        typer.echo(f"{folder}: {made.samples - len(made.failed)} samples, {', '.join(made.files)}{draft}")
    else:
        rest = "the same command without --shard finishes the set" if part else "the same command tries the rest again"
        typer.echo(f"{folder}: {made.done} of {made.samples} samples; {rest}")
    for sentence in (*made.failed.values(), *(f"{name}: {said}" for name, said in made.broken.items())):
        print_note(f"mirrorgaze: {folder}: {sentence}")
    if made.failed or made.broken:
        raise typer.Exit(FAILED)
