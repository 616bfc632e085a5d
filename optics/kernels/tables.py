"""Tables of sourced data: CSV whose comment lines carry the source."""

from __future__ import annotations

import csv
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


@cache
def read_table(path: Path) -> dict[str, NDArray[np.float64]]:
    """Columns of a CSV by name; lines that begin with # are comments, the first other line names the columns.

    An empty cell, a value that the source does not give, is NaN.
    """
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    names, *rows = csv.reader(lines)
    values = np.array([[cell or "nan" for cell in row] for row in rows], dtype=np.float64)
    return dict(zip(names, values.T, strict=True))
