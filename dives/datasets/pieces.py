"""Pieces of a data set: samples of one scene, which one process makes one after the other.

A piece is made from the set and the numbers of its samples alone, so that any process on any machine may make it, and
make it again: the bytes are the same.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from dives.datasets.dataset import Dataset, parse_dataset
from dives.datasets.drawing import NoRoomError, sample_of
from dives.datasets.files import is_done, write_failure, write_sample
from dives.datasets.rendering import rendered
from dives.datasets.scenes import DatasetScene, scene_of

SAMPLES_A_PIECE = 100
"""Half a minute of work: what a process that dies costs at most."""


@dataclass(frozen=True)
class Piece:
    """Samples of a scene.

    Attributes
    ----------
    scene : int
    indices : tuple of int
    """

    scene: int
    indices: tuple[int, ...]

    @property
    def name(self) -> str:
        """Such as ``scene 3, samples 12 to 480``."""
        return f"scene {self.scene}, samples {self.indices[0]} to {self.indices[-1]}"


@dataclass(frozen=True)
class Shard:
    """The i-th of n parts of a data set, counted from 1."""

    number: int
    of: int

    def __post_init__(self) -> None:
        if not 1 <= self.number <= self.of:
            raise ValueError(f"expected a shard from 1 of n to n of n, got {self.number}/{self.of}")

    @classmethod
    def parsed(cls, text: str) -> Shard:
        """Read ``2/8``; `ValueError` for what is no shard."""
        number, slash, of = text.partition("/")
        if not (slash and number.strip().isdecimal() and of.strip().isdecimal()):
            raise ValueError(f"expected a shard as i/n, such as 2/8, got {text!r}")
        return cls(int(number), int(of))


WHOLE = Shard(1, 1)


def pieces(dataset: Dataset, shard: Shard = WHOLE) -> list[Piece]:
    """Pieces of a part of the set: neighbours share their scene, so that a part has few of them to light."""
    scenes = dataset.grid.scene_of(np.arange(dataset.spec.samples))
    order = np.argsort(scenes, kind="stable")
    ends = np.searchsorted(scenes[order], np.arange(dataset.grid.scene_count + 1))
    found = [
        Piece(scene, tuple(order[start : min(start + SAMPLES_A_PIECE, last)].tolist()))
        for scene, (first, last) in enumerate(zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True))
        for start in range(first, last, SAMPLES_A_PIECE)
    ]
    begin, end = (len(found) * number // shard.of for number in (shard.number - 1, shard.number))
    return found[begin:end]


def left_of(folder: Path, piece: Piece) -> list[int]:
    """Samples of a piece that are not there yet."""
    return [index for index in piece.indices if not is_done(folder, index)]


def make_piece(
    dataset: Dataset, piece: Piece, folder: Path, *, made: Callable[[int], None] = lambda index: None
) -> None:
    """Make the samples of a piece that are not there; one that cannot be made is set aside with its reason.

    `made` is told the number of each.
    """
    left = left_of(folder, piece)
    if not left:
        return
    scene = _lit(dataset, piece.scene)
    for index in left:
        try:
            write_sample(folder, index, rendered(scene, sample_of(scene, index)))
        except NoRoomError as error:
            write_failure(folder, index, str(error))
        made(index)


def make_piece_of_text(text: str, source_folder: str, folder: str, scene: int, indices: Sequence[int]) -> None:
    """Same as `make_piece`, of plain values, for another process."""
    dataset = _parsed(text, source_folder)
    make_piece(dataset, Piece(scene, tuple(indices)), Path(folder))


@lru_cache(maxsize=1)
def _parsed(text: str, source_folder: str) -> Dataset:
    return parse_dataset(text, source="dataset", folder=Path(source_folder))


_LAST: list[DatasetScene] = []
"""The scene of the last piece: the next one is most often in the same."""


def _lit(dataset: Dataset, number: int) -> DatasetScene:
    if not (_LAST and _LAST[0].dataset is dataset and _LAST[0].number == number):
        _LAST[:] = [scene_of(dataset, number)]
    return _LAST[0]
