"""Files that appear whole or not at all: written beside their place, synced to the disk, then renamed.

The place beside has a name that nobody can foresee, is made new, so that no link is followed, and is locked while it is
written. What a program left there that was killed nobody holds: the next one that writes into the folder removes it.
"""

from __future__ import annotations

import csv
import errno
import fcntl
import functools
import hashlib
import io
import os
import re
import secrets
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

PARTIAL = re.compile(r"\..+\.[a-z0-9_]{8}\.partial(\.\w+)?")
"""Names of files and folders that are being written, of this module alone."""

_UNFINISHED: set[Path] = set()
"""What this program is writing."""


@contextmanager
def atomic_file(path: Path) -> Iterator[Path]:
    """Give a hidden place beside a file, of the same ending, to write to; at the end what is there becomes the file.

    When the block fails nothing changes. Several programs may write a file at once: the last one's is kept.
    """
    _remove_left_behind(path.parent)
    partial, held = _new_file(path)
    _UNFINISHED.add(partial)
    try:
        yield partial
        sync(partial)
        partial.replace(path)
    except OSError as error:
        if error.errno != errno.ENOSPC or error.filename is not None:
            raise
        raise OSError(error.errno, error.strerror, str(path)) from None
    finally:
        partial.unlink(missing_ok=True)
        os.close(held)
        _UNFINISHED.discard(partial)


@contextmanager
def atomic_files(folder: Path) -> Iterator[Path]:
    """Give a scratch folder, whose files move into a folder, which is made, when all of them are written.

    Files of the same names are replaced, others stay. When the block fails nothing changes.
    """
    # In the folder if it is there: its parent may be on another disk, or not ours.
    place = folder if folder.is_dir() else folder.parent
    with scratch_folder(place, folder.name) as scratch:
        yield scratch
        folders = [path for path in scratch.rglob("*") if path.is_dir()]
        files = sorted(path for path in scratch.rglob("*") if path.is_file())
        for path in files:
            sync(path)
        for path in (scratch, *folders):
            (folder / path.relative_to(scratch)).mkdir(parents=True, exist_ok=True)
        for path in files:
            path.replace(folder / path.relative_to(scratch))


@contextmanager
def scratch_folder(place: Path, name: str) -> Iterator[Path]:
    """Give a hidden folder in a place, which is made, for what will be called `name`; at the end it is removed."""
    place.mkdir(parents=True, exist_ok=True)
    _remove_left_behind(place)
    with tempfile.TemporaryDirectory(dir=place, prefix=f".{name}.", suffix=".partial") as made:
        scratch = Path(made)
        held = _held(scratch)
        _UNFINISHED.add(scratch)
        try:
            yield scratch
        finally:
            if held is not None:
                os.close(held)
            _UNFINISHED.discard(scratch)


def remove_unfinished() -> None:
    """Remove all that this program is writing: it ends now, without another word."""
    for path in list(_UNFINISHED):
        with suppress(OSError):
            if path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)


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


def digest_of(path: Path) -> str:
    """SHA-256 of a file's content."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def as_digests_say(folder: Path, digests: Mapping[str, str]) -> bool:
    """Whether the files of a folder are there, and hold what they held when their digests were taken."""
    return all((folder / name).is_file() and digest_of(folder / name) == digest for name, digest in digests.items())


def sync(path: Path) -> None:
    """Wait until a file's content is on the disk; a full one says so here at the latest."""
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def _new_file(path: Path) -> tuple[Path, int]:
    """Empty file beside another, and what holds it."""
    while True:
        partial = path.with_name(f".{path.stem}.{secrets.token_hex(4)}.partial{path.suffix}")
        try:
            held = os.open(partial, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o666)
        except FileExistsError:
            continue
        except OSError as error:
            # People know the file by the name that it was to have.
            raise type(error)(error.errno, error.strerror, str(path)) from None
        _lock(held)
        if partial.exists():
            return partial, held
        os.close(held)  # another program took it for left behind before it was locked


def _held(path: Path) -> int | None:
    """Descriptor that holds a file or folder until it is closed; None when it is held already, or gone."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW)
    except OSError:
        return None
    if _lock(descriptor):
        return descriptor
    os.close(descriptor)
    return None


def _lock(descriptor: int) -> bool:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


@functools.cache
def _remove_left_behind(folder: Path) -> None:
    """Remove what killed programs left in a folder, once in a program's life."""
    with suppress(OSError):
        for entry in [entry for entry in os.scandir(folder) if PARTIAL.fullmatch(entry.name)]:
            held = _held(Path(entry.path))
            if held is None:
                continue
            if entry.is_dir(follow_symlinks=False):
                shutil.rmtree(entry.path, ignore_errors=True)
            else:
                Path(entry.path).unlink()
            os.close(held)
