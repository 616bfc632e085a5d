"""Files of the cache, damaged: the result is the same as without one, read or made again."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.attack.mutations import damaged_bytes
from benchmarks.attack.verdicts import LostError

NAME = "caches"
GOAL = 100_000

KIND, VERSION = "attack", 1


def prepare(folder: Path) -> Callable[[random.Random], None]:
    """What the cases share: a result of several kinds of array, and its entry in a cache of its own."""
    from optics.kernels.cache import _warn, load_or_make, result_key
    from optics.kernels.cache_contents import entry_path

    drawn = np.random.default_rng(0)
    arrays = {
        "table": drawn.normal(size=(5, 7, 3)),
        "by_columns": np.asfortranarray(drawn.normal(size=(6, 4)).astype(np.float32)),
        "names": np.array(["fold", "gaze", "µ"]),
        "count": np.array(3),
        "none": np.empty((0, 3)),
    }
    key = result_key(KIND, VERSION, 1)
    path = entry_path(KIND, key)

    def found() -> dict[str, np.ndarray]:
        return load_or_make(KIND, key, lambda: dict(arrays), pack=dict, unpack=_unpacked)

    found()
    whole = path.read_bytes()

    def case(rng: random.Random) -> None:
        path.write_bytes(damaged_bytes(whole, rng))
        result = found()
        if result.keys() != arrays.keys() or not all(_same(result[name], arrays[name]) for name in arrays):
            raise LostError(f"another result from a damaged file: {result}")
        _warn.cache_clear()

    return case


def _unpacked(stored: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {name: stored[name] for name in ("table", "by_columns", "names", "count", "none")}


def _same(first: np.ndarray, second: np.ndarray) -> bool:
    return first.dtype == second.dtype and first.shape == second.shape and bool(np.array_equal(first, second))
