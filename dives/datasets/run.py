"""Make a data set: pieces that are not there, then its tables and formats."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cad.export.drawings.manifest import rig_text
from dives.datasets.dataset import Dataset
from dives.datasets.files import IDENTITY, SPECIFICATION, is_done
from dives.datasets.finishing import finish
from dives.datasets.pieces import WHOLE, Shard, left_of, make_piece, pieces
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
        Sentences on samples that cannot be made; known when the set is whole.
    files : tuple of str
        Tables and formats that were written; none while samples are missing.
    """

    folder: Path
    done: int
    samples: int
    failed: dict[int, str]
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
            "files": list(self.files),
        }


def make_dataset(
    dataset: Dataset,
    folder: Path,
    *,
    shard: Shard = WHOLE,
    progress: Progress = lambda done, of: None,
    log: Callable[[str], None] = lambda line: None,
) -> DatasetResult:
    """Make what is not there of a data set, or of a shard of it; with every sample there, write tables and formats.

    It may be killed at any time and called again: what is written stays, and the same bytes come out.

    Raises
    ------
    ValueError
        When the folder holds samples of another set.
    OSError
        When they cannot be written.
    """
    begin(dataset, folder)
    mine = pieces(dataset, shard)
    total = sum(len(piece.indices) for piece in mine)
    left = {piece: len(left_of(folder, piece)) for piece in mine}
    done = total - sum(left.values())
    progress(done, total)

    def made(index: int) -> None:
        nonlocal done
        done += 1
        progress(done, total)

    for piece in mine:
        if left[piece]:
            make_piece(dataset, piece, folder, made=made)
    samples = dataset.spec.samples
    there = done if shard == WHOLE else sum(is_done(folder, index) for index in range(samples))
    if there < samples:
        return DatasetResult(folder=folder, done=there, samples=samples, failed={}, files=())
    failed, files = finish(dataset, folder, log=log)
    return DatasetResult(folder=folder, done=there, samples=samples, failed=failed, files=files)


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
