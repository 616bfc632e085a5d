"""Make a data set: pieces that are not there, then its tables and formats."""

from __future__ import annotations

import json
import traceback
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from cad.export.drawings.manifest import rig_text
from dives.datasets.dataset import Dataset
from dives.datasets.files import IDENTITY, SPECIFICATION, is_done
from dives.datasets.finishing import finish
from dives.datasets.pieces import FailedSamplesError, Piece, left_of, make_piece, make_piece_of_text, pieces
from optics.workers.run import SET_ASIDE, Ended, Failure, Workers, all_ended, open_workers
from optics.workers.shards import Manifest, Shard
from rigs.atomic_files import write_text

Progress = Callable[[int, int], None]
"""Takes the samples that are there and all of the shard's."""


@dataclass(frozen=True, kw_only=True)
class DatasetResult:
    """What became of a data set.

    Attributes
    ----------
    folder : Path
    done, samples : int
        Samples that are there, or set aside, and all.
    failed : dict of int to str
        Sentences on samples that have no room; known when the set is whole.
    broken : dict of str to str
        Sentences on pieces that could not be made, by name; the same command tries them again.
    files : tuple of str
        Tables and formats that were written; none while samples are missing.
    """

    folder: Path
    done: int
    samples: int
    failed: dict[int, str]
    broken: dict[str, str]
    files: tuple[str, ...]

    @property
    def is_whole(self) -> bool:
        """Whether every sample is there, or set aside."""
        return self.done == self.samples

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        return {
            "folder": str(self.folder),
            "done": self.done,
            "samples": self.samples,
            "failed": {str(index): sentence for index, sentence in self.failed.items()},
            "broken": self.broken,
            "files": list(self.files),
        }


def make_dataset(
    dataset: Dataset,
    folder: Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    shard: Shard | None = None,
    progress: Progress = lambda done, of: None,
    log: Callable[[str], None] = lambda line: None,
) -> DatasetResult:
    """Make what is not there of a data set, or of a shard of it; with every sample there, write tables and formats.

    It may be killed at any time and called again: what is written stays, and the same bytes come out, however many
    workers make it.

    Parameters
    ----------
    dataset : Dataset
    folder : Path
    workers : int
        Processes of this machine; one is this process.
    scheduler : str, optional
        Address of a dask cluster that works instead; `folder` and what the file names are on a disk that its workers
        share.
    shard : Shard, optional
        Make this part alone, and write a manifest of it.
    progress, log : callable
        Told of samples, and of what else is done.

    Raises
    ------
    ValueError
        When the folder holds samples of another set.
    OSError
        When this process cannot write them.
    """
    begin(dataset, folder)
    mine = pieces(dataset, shard)
    left = {piece: len(left_of(folder, piece)) for piece in mine}
    count = _Count(sum(len(piece.indices) for piece in mine), sum(left.values()), progress)
    waiting = [piece for piece in mine if left[piece]]
    if waiting:
        log("samples ...")
    ended: Told = lambda end: None  # noqa: E731
    if shard is not None:
        total = len(pieces(dataset))
        ended = Manifest(folder, shard, total=total, done={each.name: not left[each] for each in mine}).ended
    if workers == 1 and scheduler is None:
        broken = _made_here(dataset, folder, waiting, count, ended)
    else:
        broken = _made_by_workers(dataset, folder, waiting, count, ended, workers=workers, scheduler=scheduler)
    samples = dataset.spec.samples
    there = sum(is_done(folder, index) for index in range(samples))
    failed, files = finish(dataset, folder, log=log) if there == samples and shard is None else ({}, ())
    return DatasetResult(folder=folder, done=there, samples=samples, failed=failed, broken=broken, files=files)


Told = Callable[[Ended], None]


class _Count:
    """How many samples of the whole are there, told as it grows."""

    def __init__(self, total: int, left: int, progress: Progress) -> None:
        self._total, self._done, self._progress = total, total - left, progress
        self.add(0)

    def add(self, samples: int) -> None:
        self._done += samples
        self._progress(self._done, self._total)


def _made_here(dataset: Dataset, folder: Path, waiting: Sequence[Piece], count: _Count, told: Told) -> dict[str, str]:
    """Make pieces in this process; sentences on those that could not be made whole."""
    broken = {}
    for piece in waiting:
        failure = None
        try:
            make_piece(dataset, piece, folder, made=lambda index: count.add(1))
        except FailedSamplesError as error:
            broken[piece.name] = str(error)
            failure = Failure(sentence=str(error), trace=traceback.format_exc())
        told(Ended(name=piece.name, value=None, failure=failure))
    return broken


def _made_by_workers(
    dataset: Dataset,
    folder: Path,
    waiting: Sequence[Piece],
    count: _Count,
    told: Told,
    *,
    workers: int,
    scheduler: str | None,
) -> dict[str, str]:
    """Make pieces on workers; of a piece that killed some, the samples that are left are tried one by one."""
    left = {piece.name: (piece, len(left_of(folder, piece))) for piece in waiting}

    def counted(end: Ended) -> None:
        piece, before = left[end.name]
        count.add(before - (0 if end.failure is None else len(left_of(folder, piece))))

    def all_made(opened: Workers, chosen: Iterable[Piece]) -> dict[str, Failure]:
        arguments = (dataset.text, str(dataset.folder.absolute()), str(folder.absolute()))
        make = partial(make_piece_of_text, quality=dataset.quality)
        jobs = {piece.name: (*arguments, piece.scene, piece.indices) for piece in chosen}
        return all_ended(opened.run(make, jobs), counted, told)

    if not waiting:
        return {}
    with open_workers(workers=workers, scheduler=scheduler) as opened:
        failures = all_made(opened, waiting)
        deadly = [left[name][0] for name, failure in failures.items() if failure.sentence == SET_ASIDE]
        alone = [each for piece in deadly for each in piece.apart(left_of(folder, piece))]
        left |= {piece.name: (piece, 1) for piece in alone}
        failures = {name: failure for name, failure in failures.items() if failure.sentence != SET_ASIDE}
        failures |= all_made(opened, alone)
    return {name: failure.sentence for name, failure in failures.items()}


def begin(dataset: Dataset, folder: Path) -> None:
    """Make the folder of a set, or see that it is this one's; `ValueError` when it holds another's samples."""
    identity = folder / IDENTITY
    if identity.is_file():
        try:
            known = json.loads(identity.read_text(encoding="utf-8"))["identity"]
        except (ValueError, KeyError, TypeError):
            raise ValueError(f"{identity}: expected the identity of a data set; take a new folder") from None
        if known != dataset.identity:
            raise ValueError(f"{folder}: expected the same data set as before or a new folder; another one is in it")
    elif folder.exists() and any(folder.iterdir()):
        raise ValueError(f"{folder}: expected a new folder or one of a data set; there are other files in it")
    folder.mkdir(parents=True, exist_ok=True)
    write_text(identity, json.dumps({"identity": dataset.identity}) + "\n")
    write_text(folder / SPECIFICATION, dataset.text)
    (folder / "rigs").mkdir(exist_ok=True)
    for rig in dataset.rigs.values():
        write_text(folder / "rigs" / f"{rig.name}.toml", rig_text(rig))
