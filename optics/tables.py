"""Tables of sourced data: CSV whose comment lines carry the source."""

from __future__ import annotations

import csv
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


@cache
def read_table(path: Path) -> dict[str, NDArray[np.float64]]:
    """Columns of a CSV by name; lines that begin with # are comments, the first other line names the columns."""
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    names, *rows = csv.reader(lines)
    values = np.array(rows, dtype=np.float64)
    return dict(zip(names, values.T, strict=True))
