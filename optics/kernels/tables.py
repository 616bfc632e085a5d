"""Tables in CSV files: sourced data, and what a user brings, which is read with every problem of the file at once."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from optics.kernels.arrays import FloatArray

FEWEST_ROWS = 2
MOST_COLUMNS = 1000


@dataclass(frozen=True, kw_only=True)
class TextTable:
    """The text of a CSV; # begins a comment, the first other line names the columns, in any order.

    Attributes
    ----------
    path : Path
    names : tuple of str
        Of the columns.
    lines : tuple of (int, list of str)
        Number of each line in the file, and its fields.
    """

    path: Path
    names: tuple[str, ...]
    lines: tuple[tuple[int, list[str]], ...]

    @classmethod
    def read(cls, path: Path) -> TextTable:
        """Read a file; a `ValueError` for one that is not text or has no line."""
        lines = [
            (number, fields)
            for number, line in enumerate(read_text(path).splitlines(), 1)
            # Spreadsheets end a table with lines of commas alone.
            if not line.startswith("#") and any(fields := _fields(path, number, line))
        ]
        if not lines:
            raise ValueError(f"{path}: expected a line of column names, got nothing")
        if len(lines[0][1]) > MOST_COLUMNS:
            raise ValueError(f"{path}: expected at most {MOST_COLUMNS} columns, got {len(lines[0][1]):,}")
        return cls(path=path, names=tuple(lines[0][1]), lines=tuple(lines[1:]))

    def column_problems(self, required: Sequence[str], optional: Sequence[str] = ()) -> list[str]:
        """Columns that are missing, unknown, or there twice."""
        known = tuple(dict.fromkeys((*required, *optional)))
        missing = [name for name in required if name not in self.names]
        repeated = sorted({name for name in self.names if self.names.count(name) > 1})
        return [
            *(f"expected a column {name}; the file has {', '.join(self.names)}" for name in missing),
            *(f"column {name!r}: expected one of {', '.join(known)}" for name in self.names if name not in known),
            *(f"column {name}: expected once, got it again" for name in repeated),
        ]

    def rows(self, problems: list[str]) -> Iterator[tuple[int, dict[str, str]]]:
        """Line numbers and texts by column; lines of another length are added to the problems."""
        for number, fields in self.lines:
            if len(fields) == len(self.names):
                yield number, dict(zip(self.names, fields, strict=True))
            else:
                problems.append(f"line {number}: expected {len(self.names)} values, got {len(fields)}")

    def check(self, problems: Sequence[str]) -> None:
        """Raise a `ValueError` that says all problems, if there are any."""
        if problems:
            raise ValueError(listed_problems(str(self.path), problems))


def _fields(path: Path, number: int, line: str) -> list[str]:
    try:
        return [field.strip() for field in next(csv.reader([line]), [])]
    except csv.Error as error:
        raise ValueError(f"{path}: line {number}: expected fields separated by commas, got {error}") from None


def read_text(path: Path) -> str:
    """Text of a file in UTF-8, with or without a byte order mark; a `ValueError` for anything else."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: expected text in UTF-8, got something else at byte {error.start}") from None


def listed_problems(place: str, problems: Sequence[str]) -> str:
    """One problem a line, under where they are and how many."""
    return "\n  ".join([f"{place}: {len(problems)} problem{'s' if len(problems) > 1 else ''}", *problems])


def finite_number(text: str) -> float:
    """Number of a field, nan for what is not a finite number."""
    try:
        value = float(text)
    except ValueError:
        return math.nan
    return value if math.isfinite(value) else math.nan


@cache
def read_table(path: Path) -> dict[str, FloatArray]:
    """Columns of a table of sourced data by name; its comments carry the source.

    An empty cell, a value that the source does not give, is NaN.
    """
    table = TextTable.read(path)
    values = np.array([[field or "nan" for field in fields] for _, fields in table.lines], dtype=np.float64)
    return dict(zip(table.names, values.T, strict=True))


def read_spectra(path: Path, *, required: Sequence[str], optional: Sequence[str] = ()) -> dict[str, FloatArray]:
    """Columns of a CSV with ``wavelength_nm``, ascending; all others are not negative.

    Raises
    ------
    ValueError
        With everything that is wrong with the file, one problem a line.
    """
    table = TextTable.read(path)
    problems = table.column_problems(["wavelength_nm", *required], optional)
    rows = []
    for number, row in table.rows(problems):
        values = [finite_number(text) for text in row.values()]
        problems += [
            f"line {number}: expected a number of at least 0, got {text!r}"
            for text, value in zip(row.values(), values, strict=True)
            if not value >= 0
        ]
        rows.append(values)
    table.check(problems)
    if len(rows) < FEWEST_ROWS:
        raise ValueError(f"{path}: expected at least {FEWEST_ROWS} wavelengths, got {len(rows)}")
    columns = dict(zip(table.names, np.array(rows).T, strict=True))
    if (np.diff(columns["wavelength_nm"]) <= 0).any():
        raise ValueError(f"{path}: expected wavelength_nm in ascending order, each once")
    return columns
