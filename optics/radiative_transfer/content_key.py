"""Name of a radiance field in the cache: everything it is computed from, the code included."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike


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
