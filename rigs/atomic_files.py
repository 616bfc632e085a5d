"""Files that appear whole or not at all: written beside their place, synced to the disk, then renamed."""

from __future__ import annotations

import csv
import io
import os
import secrets
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any


@contextmanager
def atomic_file(path: Path, *, shared: bool = False) -> Iterator[Path]:
    """Give a hidden place beside a file, of the same ending, to write to; at the end what is there becomes the file.

    When the block fails nothing changes. What a program leaves there that is killed, the next one overwrites; a file
    that is `shared`, which several programs may write at once, has a place for each, and the last one's is kept.
    """
    own = f".{secrets.token_hex(4)}" if shared else ""
    partial = path.with_name(f".{path.stem}{own}.partial{path.suffix}")
    try:
        yield partial
        sync(partial)
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


@contextmanager
def atomic_files(folder: Path) -> Iterator[Path]:
    """Give a scratch folder, whose files move into a folder, which is made, when all of them are written.

    Files of the same names are replaced, others stay. When the block fails nothing changes.
    """
    # In the folder if it is there: its parent may be on another disk, or not ours.
    place = folder if folder.is_dir() else folder.parent
    place.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=place, prefix=f".{folder.name}.", suffix=".partial") as name:
        scratch = Path(name)
        yield scratch
        folders = [path for path in scratch.rglob("*") if path.is_dir()]
        files = sorted(path for path in scratch.rglob("*") if path.is_file())
        for path in files:
            sync(path)
        for path in (scratch, *folders):
            (folder / path.relative_to(scratch)).mkdir(parents=True, exist_ok=True)
        for path in files:
            path.replace(folder / path.relative_to(scratch))


def csv_text(rows: Iterable[Iterable[Any]]) -> str:
    """Rows as CSV; the first names the columns."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all."""
    write_bytes(path, text.encode())


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file, whole or not at all."""
    with atomic_file(path) as partial:
        partial.write_bytes(content)


def sync(path: Path) -> None:
    """Wait until a file's content is on the disk; a full one says so here at the latest."""
    with path.open("rb+") as file:
        os.fsync(file.fileno())
