"""What takes long to compute, kept on disk under a key that says what it was computed from.

A key is of the kind of a result, of its version, and of all its inputs. No source file is in it: a version is a number
beside the code that makes the result, raised when that code gives another result for the same inputs.

The cache costs and saves time, never a result: what cannot be read is made again, and what cannot be kept is not kept.
"""

from __future__ import annotations

import fcntl
import functools
import hashlib
import io
import logging
import math
import os
import time
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.lib.format import read_array_header_1_0, read_array_header_2_0, read_magic
from numpy.typing import NDArray

from optics.kernels.arrays import aligned_room
from optics.kernels.cache_contents import entry_path, evict, limit_bytes
from optics.kernels.clock import CLOCK, last_time
from rigs.atomic_files import atomic_file

LOG = logging.getLogger(__name__)

LONGEST_HEADER = 1 << 16
"""Bytes within which the header of an array ends: a few hundred, where it names no fields."""

PIECE_BYTES = 1 << 18
"""Read at a time: what fits a processor's cache is copied twice as fast."""

Arrays = Mapping[str, NDArray[Any]]
Result = TypeVar("Result")


def result_key(kind: str, version: int, *inputs: Any) -> str:
    """Key of a result: equal only for the same kind, version and inputs.

    Parameters
    ----------
    kind : str
        What the result is.
    version : int
        Of the code that makes it.
    inputs
        All that the result depends on: numbers and arrays count by shape, type and values, a path by the content of its
        file, mappings and sequences item by item.

    Raises
    ------
    TypeError
        For an input whose content is not known.
    """
    digest = hashlib.sha256()
    for part in _parts([kind, version, *inputs]):
        digest.update(part)
    return digest.hexdigest()


def load_or_make(
    kind: str,
    key: str,
    make: Callable[[], Result],
    *,
    pack: Callable[[Result], Arrays],
    unpack: Callable[[dict[str, NDArray[Any]]], Result],
    told: bool = True,
) -> Result:
    """Result from the cache, or made and kept.

    Parameters
    ----------
    kind : str
        What the result is: a folder of the cache.
    key : str
        As `result_key` gives it.
    make : callable
        Computes the result; what it raises is raised.
    pack, unpack : callable
        From the result to named arrays, and back.
    told : bool
        Whether clock and log know it by its kind; else it is a piece of what they are told.
    """
    path, limit = entry_path(kind, key), limit_bytes()
    found = _found(path, unpack)
    if found:
        return found[0]
    with CLOCK.inside(kind) if told else nullcontext(), _alone(path) if limit else nullcontext():
        found = _found(path, unpack)
        if found:  # somebody has just made it
            return found[0]
        if told and (known := last_time(kind)):
            LOG.info("%s%s ...", kind, known)
        made = make()
        try:
            _save(path, pack(made))
            evict(limit)
        except OSError as error:
            _warn(f"{path.parent}: results cannot be kept for the next time ({error.strerror or error})")
    return made


def _found(path: Path, unpack: Callable[[dict[str, NDArray[Any]]], Result]) -> tuple[Result] | tuple[()]:
    """Result of an entry; nothing where there is none that can be read."""
    try:
        return (unpack(_load(path)),)
    except (FileNotFoundError, NotADirectoryError):
        pass
    except Exception as error:
        # A file fails in as many ways as it can be damaged: those of zip, of NumPy, of `unpack`, of the disk.
        _warn(f"{path}: cannot be read and is made again ({type(error).__name__}: {error})")
    return ()


@contextmanager
def _alone(path: Path) -> Iterator[None]:
    """Let others that want the same result wait until it is made, on all machines that share the folder.

    The system ends the wait when the other one dies. Where a folder may not be written, or knows no locks, everybody
    makes what is missing.
    """
    lock = path.with_name(f".{path.stem}.lock")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        held = os.open(lock, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
    except OSError:
        yield
        return
    try:
        try:
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            LOG.info("%s: another process is making it ...", path.parent.name)
            fcntl.flock(held, fcntl.LOCK_EX)
        except OSError:
            pass
        yield
    finally:
        # Who waits holds a file without a name from here on, and finds the result.
        lock.unlink(missing_ok=True)
        os.close(held)


def _load(path: Path) -> dict[str, NDArray[Any]]:
    with zipfile.ZipFile(path) as archive:
        arrays = {info.filename.removesuffix(".npy"): _array(archive, info) for info in archive.infolist()}
    # The time of the last use; that of the last change stays. A cache that may only be read is still one.
    with suppress(OSError):
        os.utime(path, ns=(time.time_ns(), path.stat().st_mtime_ns))
    return arrays


def _array(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> NDArray[Any]:
    """Array of a file in an archive, in the memory that it was read to: it begins where a cache line does."""
    content = aligned_room(info.file_size, np.uint8)
    with archive.open(info) as file:
        # Each file is read to its end before NumPy sees it, which reads no further than an array's header says: what
        # was not read has not been compared with the checksum.
        start = 0
        while piece := file.read(PIECE_BYTES):
            content[start : start + len(piece)] = np.frombuffer(piece, dtype=np.uint8)
            start += len(piece)
    header = io.BytesIO(content[:LONGEST_HEADER].tobytes())
    read_header = {(1, 0): read_array_header_1_0, (2, 0): read_array_header_2_0}[read_magic(header)]
    shape, by_columns, dtype = read_header(header)
    if dtype.hasobject:
        raise ValueError(f"{info.filename}: expected numbers or words, got {dtype}")
    values = np.frombuffer(content, dtype=dtype, count=math.prod(shape), offset=header.tell())
    return values.reshape(shape, order="F" if by_columns else "C")


def _save(path: Path, arrays: Arrays) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_file(path) as partial:
        np.savez(partial, allow_pickle=False, **arrays)


@functools.cache
def _warn(sentence: str) -> None:
    """Say so, once in a program's life."""
    LOG.warning(sentence)


def _parts(value: Any) -> Iterator[bytes]:
    """Content of an input as bytes, each piece behind its type and length: no two inputs give the same."""
    match value:
        case None | bool() | int() | str():
            yield from _part(type(value).__name__, str(value).encode())
        case bytes():
            yield from _part("bytes", value)
        case float() | np.ndarray() | np.generic():
            array = np.asarray(value, order="C")
            if array.dtype.hasobject:
                raise TypeError(f"expected an array of numbers or words, got one of {array.dtype}")
            yield from _part(f"array {array.shape} {array.dtype.str}", array.tobytes())
        case Path():
            with value.open("rb") as file:
                yield from _part("file", hashlib.file_digest(file, "sha256").digest())
        case Mapping():
            yield from _part("mapping", str(len(value)).encode())
            for name in sorted(value):
                yield from _parts(name)
                yield from _parts(value[name])
        case Sequence():
            yield from _part("sequence", str(len(value)).encode())
            for each in value:
                yield from _parts(each)
        case _:
            raise TypeError(f"expected numbers, words, arrays, paths, mappings or sequences, got {type(value)}")


def _part(kind: str, content: bytes) -> tuple[bytes, bytes]:
    return f"{kind} {len(content)}:".encode(), content
