"""What takes long to compute, kept on disk under a key that says what it was computed from.

A key is of the kind of a result, of its version, and of all its inputs. No source file is in it: a version is a number
beside the code that makes the result, raised when that code gives another result for the same inputs.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

MOST_BYTES = 2 * 2**30
"""What was not used for longest is removed when there is more."""


def cache_folder() -> Path:
    """Where things are kept: $MIRRORGAZE_CACHE, or `mirrorgaze` in the user's cache folder."""
    own = os.environ.get("MIRRORGAZE_CACHE")
    if own:
        return Path(own)
    shared = os.environ.get("XDG_CACHE_HOME")
    return (Path(shared) if shared else Path.home() / ".cache") / "mirrorgaze"


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


def save_arrays(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write arrays beside their place, then rename: a reader never sees half a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=path.parent, suffix=".partial") as folder:
        partial = Path(folder) / path.name
        np.savez(partial, allow_pickle=False, **arrays)
        partial.replace(path)
    remove_oldest(path.parent, MOST_BYTES)


def load_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Read what `save_arrays` wrote, and note that it was used."""
    # NumPy leaves a file that it opened itself and could not read unclosed.
    with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
        arrays = {name: stored[name] for name in stored.files}
    # A cache that may only be read is still one.
    with suppress(OSError):
        os.utime(path)
    return arrays


def remove_oldest(folder: Path, most_bytes: int) -> None:
    """Remove the stored arrays of a folder that were not used for longest, until no more than so much is left."""
    kept = 0
    found = []
    for path in folder.glob("*.npz"):
        # Another process may be quicker.
        with suppress(OSError):
            facts = path.stat()
            found.append((facts.st_mtime, facts.st_size, path))
    for _, size, path in sorted(found, reverse=True):
        kept += size
        if kept > most_bytes:
            path.unlink(missing_ok=True)


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
