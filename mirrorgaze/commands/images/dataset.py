"""Data sets: many images with their ground truth."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mirrorgaze.errors import FAILED
from mirrorgaze.options import JsonOption
from mirrorgaze.output import print_json, print_note, print_progress, print_step


def dataset(
    spec: Annotated[
        Path | None, typer.Argument(metavar="SPEC", help="Data-set file (TOML).", show_default=False)
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="Write into this folder.", show_default="out/NAME"),
    ] = None,
    shard: Annotated[str, typer.Option(metavar="I/N", help="Make the I-th of N parts only.")] = "1/1",
    check: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Check a finished data set instead: counts, digests, files.")
    ] = None,
    schema: Annotated[bool, typer.Option("--schema", help="Print the JSON Schema of data-set files instead.")] = False,
    json: JsonOption = False,
) -> None:
    """Render a data set, or check one.

    Every sample is known by the file's seed and its number. It has an image, depth, normals, labels, instances and
    over which mirrors each pixel is seen as PNG, and a record (JSON) of joints, gaze, poses, camera and boxes;
    samples.parquet is the table of all, manifest.json has their digests. What is there is kept: the same command
    continues, and more samples may be added.

    \b
    Example:
      mirrorgaze dataset balls.toml -o out/balls
      mirrorgaze dataset balls.toml -o out/balls --shard 2/8
      mirrorgaze dataset --check out/balls
    """
    if sum((spec is not None, check is not None, schema)) != 1:
        raise typer.BadParameter("expected one of SPEC, --check DIR and --schema")
    if schema:
        _print_schema()
    elif check is not None:
        _check(check, json=json)
    else:
        assert spec is not None  # one of the three was given
        _make(spec, output, shard, json=json)


def _print_schema() -> None:
    from dives.datasets.specification import DatasetSpecification

    print_json(DatasetSpecification.model_json_schema())


def _check(folder: Path, *, json: bool) -> None:
    from dives.datasets.check import check_dataset

    found = check_dataset(folder, progress=lambda done, total: print_progress("samples", done, total))
    if json:
        print_json({"samples": found.samples, "files": found.files, "problems": list(found.problems)})
    else:
        order = f"{len(found.problems)} problems" if found.problems else "in order"
        typer.echo(f"{folder}: {found.samples} samples, {found.files} files read: {order}")
        for problem in found.problems:
            print_note(problem)
    if found.problems:
        raise typer.Exit(FAILED)


def _make(spec: Path, output: Path | None, shard: str, *, json: bool) -> None:
    from dives.datasets.dataset import Dataset
    from dives.datasets.pieces import Shard
    from dives.datasets.run import make_dataset

    part = Shard.parsed(shard)
    loaded = Dataset.load(spec)
    folder = output or Path("out") / loaded.spec.name
    try:
        made = make_dataset(
            loaded,
            folder,
            shard=part,
            progress=lambda done, total: print_progress("samples", done, total),
            log=print_step,
        )
    except KeyboardInterrupt:
        print_note(f"mirrorgaze: {folder}: stopped; the same command continues from there")
        raise
    if json:
        print_json(made.as_dict())
    elif made.is_whole:
        typer.echo(f"{folder}: {made.samples - len(made.failed)} samples, {', '.join(made.files)}")
    else:
        typer.echo(
            f"{folder}: {made.done} of {made.samples} samples; without --shard the last command finishes the set"
        )
    for sentence in made.failed.values():
        print_note(f"mirrorgaze: {folder}: {sentence}")
    if made.failed:
        raise typer.Exit(FAILED)
