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
from optics.workers.shards import Shard
from scenes.baking.light_quality import LightQuality

SAMPLES_A_PIECE = 50
"""A quarter of a minute of work: what a process that dies costs at most."""


class FailedSamplesError(RuntimeError):
    """Samples of a piece that could not be made though there is room in them; the others are there."""


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
        last = "" if len(self.indices) == 1 else f" to {self.indices[-1]}"
        return f"scene {self.scene}, sample{'s' if last else ''} {self.indices[0]}{last}"

    def apart(self, indices: Sequence[int]) -> list[Piece]:
        """Some of its samples, each a piece by itself."""
        return [Piece(self.scene, (index,)) for index in indices]


def pieces(dataset: Dataset, shard: Shard | None = None) -> list[Piece]:
    """Pieces of a part of the set: neighbours share their scene, so that a part has few of them to light."""
    scenes = dataset.grid.scene_of(np.arange(dataset.spec.samples) // dataset.spec.clip.frames)
    order = np.argsort(scenes, kind="stable")
    ends = np.searchsorted(scenes[order], np.arange(dataset.grid.scene_count + 1))
    found = [
        Piece(scene, tuple(order[start : min(start + SAMPLES_A_PIECE, last)].tolist()))
        for scene, (first, last) in enumerate(zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True))
        for start in range(first, last, SAMPLES_A_PIECE)
    ]
    if shard is None:
        return found
    begin, end = (len(found) * number // shard.count for number in (shard.number - 1, shard.number))
    return found[begin:end]


def left_of(folder: Path, piece: Piece) -> list[int]:
    """Samples of a piece that are not there yet."""
    return [index for index in piece.indices if not is_done(folder, index)]


def make_piece(
    dataset: Dataset, piece: Piece, folder: Path, *, made: Callable[[int], None] = lambda index: None
) -> None:
    """Make the samples of a piece that are not there; one without room is set aside with its reason.

    `made` is called with the number of each.

    Raises
    ------
    FailedSamplesError
        After all others are made, with the samples that raised.
    OSError
        At once, when files cannot be written.
    """
    left = left_of(folder, piece)
    if not left:
        return
    scene = _lit(dataset, piece.scene)
    wrong: list[str] = []
    first: Exception | None = None
    for index in left:
        try:
            _make_sample(scene, index, folder)
        except OSError:
            raise
        except Exception as error:
            wrong.append(f"sample {index}: {type(error).__name__}: {error}")
            first = first or error
        made(index)
    if wrong:
        # With the first one's traceback, which says where: a sample that raises is a fault of ours.
        raise FailedSamplesError("; ".join(wrong)) from first


def _make_sample(scene: DatasetScene, index: int, folder: Path) -> None:
    try:
        sample = sample_of(scene, index)
    except NoRoomError as error:
        write_failure(folder, index, str(error))
    else:
        write_sample(folder, index, rendered(scene, sample))


def make_piece_of_text(
    text: str,
    source_folder: str,
    folder: str,
    scene: int,
    indices: Sequence[int],
    *,
    quality: LightQuality | None = None,
) -> None:
    """Same as `make_piece`, of plain values, for another process."""
    make_piece(_parsed(text, source_folder, quality), Piece(scene, tuple(indices)), Path(folder))


@lru_cache(maxsize=1)
def _parsed(text: str, source_folder: str, quality: LightQuality | None) -> Dataset:
    return parse_dataset(text, source="dataset", folder=Path(source_folder), quality=quality)


_LAST: list[DatasetScene] = []
"""The scene of the last piece: the next one is most often in the same."""


def _lit(dataset: Dataset, number: int) -> DatasetScene:
    if not (_LAST and _LAST[0].dataset is dataset and _LAST[0].number == number):
        _LAST[:] = [scene_of(dataset, number)]
    return _LAST[0]
