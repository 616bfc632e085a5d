"""What takes long to compute, kept on disk under a name that says what it was computed from."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
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
