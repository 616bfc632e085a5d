"""Radiance fields kept on disk, addressed by content: by everything they are computed from, the code included."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


def cache_folder() -> Path:
    """Where fields are kept: $MIRRORGAZE_CACHE, or `mirrorgaze` in the user's cache folder."""
    own = os.environ.get("MIRRORGAZE_CACHE")
    if own:
        return Path(own)
    shared = os.environ.get("XDG_CACHE_HOME")
    return (Path(shared) if shared else Path.home() / ".cache") / "mirrorgaze"


def content_key(numbers: Iterable[ArrayLike]) -> str:
    """Hash of numbers, of their shapes, and of the modules of this package."""
    digest = hashlib.sha256()
    for number in numbers:
        array = np.ascontiguousarray(number, dtype=np.float64)
        digest.update(f"{array.shape} ".encode())
        digest.update(array.tobytes())
    for source in sorted(Path(__file__).parent.glob("*.py")):
        content = source.read_bytes()
        digest.update(f"{source.name} {len(content)} ".encode())
        digest.update(content)
    return digest.hexdigest()


def save_arrays(path: Path, arrays: Mapping[str, FloatArray]) -> None:
    """Write arrays beside their place, then rename: a reader never sees half a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=path.parent, suffix=".partial") as folder:
        partial = Path(folder) / path.name
        np.savez(partial, allow_pickle=False, **arrays)
        partial.replace(path)


def load_arrays(path: Path) -> dict[str, FloatArray]:
    """Read what `save_arrays` wrote."""
    # NumPy leaves a file that it opened itself and could not read unclosed.
    with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
        return {name: stored[name] for name in stored.files}
