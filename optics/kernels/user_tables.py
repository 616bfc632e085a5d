"""Tables that a user brings: spectra as CSV, checked before they are used."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from optics.kernels.arrays import FloatArray

FEWEST_ROWS = 2


def read_spectra(path: Path, *, required: Sequence[str], optional: Sequence[str] = ()) -> dict[str, FloatArray]:
    """Columns of a CSV whose first is ``wavelength_nm``, ascending; all others are not negative. # begins a comment.

    Raises
    ------
    ValueError
        With everything that is wrong with the file, one problem a line.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: expected text in UTF-8, got something else at byte {error.start}") from None
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if not lines:
        raise ValueError(f"{path}: expected a line of column names, got nothing")
    names = [name.strip() for name in next(csv.reader([lines[0][1]]))]
    problems = _name_problems(names, ["wavelength_nm", *required], optional)
    rows = [_row(number, line, len(names), problems) for number, line in lines[1:]]
    if problems:
        raise ValueError("\n  ".join([f"{path}: {len(problems)} problem{'s' if len(problems) > 1 else ''}", *problems]))
    if len(rows) < FEWEST_ROWS:
        raise ValueError(f"{path}: expected at least {FEWEST_ROWS} wavelengths, got {len(rows)}")
    columns = dict(zip(names, np.array(rows).T, strict=True))
    if (np.diff(columns["wavelength_nm"]) <= 0).any():
        raise ValueError(f"{path}: expected wavelength_nm in ascending order, each once")
    return columns


def _name_problems(names: list[str], required: Sequence[str], optional: Sequence[str]) -> list[str]:
    problems = [f"expected a column {name}; the file has {', '.join(names)}" for name in required if name not in names]
    known = (*required, *optional)
    problems += [f"column {name!r}: expected one of {', '.join(known)}" for name in names if name not in known]
    problems += [
        f"column {name}: expected once, got it again" for name in sorted({n for n in names if names.count(n) > 1})
    ]
    return problems


def _row(number: int, line: str, columns: int, problems: list[str]) -> list[float]:
    """Numbers of a line; what is wrong with it is added to the problems."""
    fields = next(csv.reader([line]))
    if len(fields) != columns:
        problems.append(f"line {number}: expected {columns} numbers, got {len(fields)}")
        return []
    values = []
    for field in fields:
        try:
            value = float(field)
        except ValueError:
            value = np.nan
        if not (np.isfinite(value) and value >= 0):
            problems.append(f"line {number}: expected a number of at least 0, got {field.strip()!r}")
        values.append(value)
    return values
