"""A part of many pieces of work, for those who start each part by themselves: a job array, or a loop in a shell.

Parts know nothing of each other. Which pieces a part has follows from all their names and its number, and what is done
is where the pieces write it; the manifest of a part tells it to who looks.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from optics.workers.run import Ended
from rigs.atomic_files import write_text

SHARD = re.compile(r"([1-9]\d{0,8})/([1-9]\d{0,8})")

TO_DO, DONE = "to do", "done"

Piece = TypeVar("Piece")


@dataclass(frozen=True)
class Shard:
    """A part of the work: its number, from 1, and how many there are."""

    number: int
    count: int

    @classmethod
    def parsed(cls, text: str) -> Shard:
        """Read ``2/8``.

        Raises
        ------
        ValueError
            When it is none.
        """
        found = SHARD.fullmatch(text)
        if found is None or int(found[1]) > int(found[2]):
            raise ValueError(f"--shard {text}: expected I/N with I from 1 to N, such as 2/8")
        return cls(int(found[1]), int(found[2]))

    def part(self, pieces: Sequence[Piece]) -> list[Piece]:
        """Every n-th piece: what takes long is often in a row."""
        return list(pieces[self.number - 1 :: self.count])

    @property
    def manifest_name(self) -> str:
        """Of the file that says what is done of it."""
        return f"shard-{self.number}-of-{self.count}.json"


class Manifest:
    """The file that says what is done of a shard, written again with each piece that ends.

    Parameters
    ----------
    folder : Path
    shard : Shard
    total : int
        Pieces of all shards together.
    done : mapping of str to bool
        The shard's pieces, and which of them were done before.
    """

    def __init__(self, folder: Path, shard: Shard, *, total: int, done: Mapping[str, bool]) -> None:
        self._file, self._shard, self._total = folder / shard.manifest_name, shard, total
        self._pieces = {name: DONE if is_done else TO_DO for name, is_done in done.items()}
        folder.mkdir(parents=True, exist_ok=True)
        self._write()

    def ended(self, ended: Ended) -> None:
        """A piece has ended."""
        self._pieces[ended.name] = DONE if ended.failure is None else f"failed: {ended.failure.sentence}"
        self._write()

    def _write(self) -> None:
        told = {"shard": self._shard.number, "of": self._shard.count, "all_pieces": self._total, "pieces": self._pieces}
        write_text(self._file, json.dumps(told, indent=1, ensure_ascii=False))
