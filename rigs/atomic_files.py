"""Files that appear whole or not at all: written beside their place, synced to the disk, then renamed."""

from __future__ import annotations

import os
import secrets
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def atomic_file(path: Path) -> Iterator[Path]:
    """Give a hidden place beside a file, of the same ending, to write to; at the end what is there becomes the file.

    When the block fails nothing changes. Several programs may write the same file at once: the last one's is kept.
    """
    partial = path.with_name(f".{path.stem}.{secrets.token_hex(4)}.partial{path.suffix}")
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
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder, prefix=".", suffix=".partial") as name:
        scratch = Path(name)
        yield scratch
        names = sorted(path.relative_to(scratch) for path in scratch.rglob("*") if path.is_file())
        for file in names:
            sync(scratch / file)
        for file in names:
            (folder / file).parent.mkdir(parents=True, exist_ok=True)
            (scratch / file).replace(folder / file)


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
