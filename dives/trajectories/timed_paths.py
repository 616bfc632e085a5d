"""Paths from a file: rows of time, place and, where it has them, attitude, as loggers and simulators write them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation, Slerp

from optics.kernels.arrays import FloatArray
from optics.kernels.tables import TextTable, finite_number
from rigs.documents.problems import Problem

TIME, PLACE = "time_s", ("x_m", "y_m", "z_m")
QUATERNION, ANGLES = ("qx", "qy", "qz", "qw"), ("yaw_deg", "pitch_deg", "roll_deg")

FEWEST_ROWS = 2

UNIT_WITHIN = 0.01
"""A quaternion's length may differ from one by so much: loggers write few digits."""

MOST_PROBLEMS = 20
"""Of a file's problems; a column in another unit is wrong in every line."""

FASTEST_OVER_MEAN = 3.0
"""A monotone cubic is nowhere steeper than three times its mean between the two rows (Fritsch & Carlson 1980)."""


class TimedPathError(ValueError):
    """A file that holds no path; `problems` says where and why, all of them."""

    def __init__(self, problems: Sequence[Problem]):
        self.problems = tuple(problems)
        super().__init__("; ".join(map(str, problems)))


@dataclass(frozen=True, kw_only=True, eq=False)
class TimedPath:
    """Places, and attitudes if the file has them, at times.

    Attributes
    ----------
    times_s : array, shape (n,)
        Rising.
    points_m : array, shape (n, 3)
        In a level frame, z up.
    attitude : Rotation, optional
        Of n: from the axes of what moves (x forward, y left, z up) to the frame's.
    """

    times_s: FloatArray
    points_m: FloatArray
    attitude: Rotation | None

    def places(self, times_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Places, metres, and velocities, m/s, both of shape (n, 3).

        Before the first row and after the last one the place is that row's; so is the velocity, which says where it
        heads. Between rows each coordinate is a monotone piecewise cubic (Fritsch & Carlson 1980): it never leaves the
        range of its two rows, and its velocity does not jump.
        """
        inside = np.clip(times_s, *self.times_s[[0, -1]])
        return self._cubic(inside), self._cubic(inside, 1)

    def attitudes(self, times_s: FloatArray) -> Rotation | None:
        """Attitudes of shape (n,), between rows by slerp: at an even rate about one axis."""
        if self.attitude is None:
            return None
        return Slerp(self.times_s, self.attitude)(np.clip(times_s, *self.times_s[[0, -1]]))

    @property
    def fastest_m_per_s(self) -> float:
        """Speed that is nowhere exceeded, m/s."""
        mean = np.linalg.norm(np.diff(self.points_m, axis=0), axis=1) / np.diff(self.times_s)
        return float(FASTEST_OVER_MEAN * mean.max())

    @cached_property
    def _cubic(self) -> PchipInterpolator:
        return PchipInterpolator(self.times_s, self.points_m)


def timed_path(file: str | Path) -> TimedPath:
    """Read a CSV file: time_s, x_m, y_m, z_m, and qx, qy, qz, qw or yaw_deg, pitch_deg, roll_deg.

    Other columns are not looked at. Yaw counts to the left, pitch upwards, roll clockwise as seen from behind; roll
    applies first, then pitch, then yaw.

    Raises
    ------
    TimedPathError
        With every problem of the file, by line.
    """
    path = Path(file)
    if not path.is_file():
        raise TimedPathError([Problem(place="", value=str(file), expected="a file that is there")])
    return _read(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=64)
def _read(path: Path, changed_ns: int) -> TimedPath:
    try:
        table = TextTable.read(path)
    except ValueError as error:
        place, _, expected = str(error).removeprefix(f"{path}: ").rpartition("expected ")
        raise TimedPathError([Problem(place=place.rstrip(": "), value=None, expected=expected)]) from None
    wanted, problems = _wanted(table.names)
    if problems:
        raise TimedPathError(problems)
    columns = [table.names.index(name) for name in wanted]
    numbers = np.array([[_number(row, column) for column in columns] for _, row in table.lines])
    numbers = numbers.reshape(-1, len(wanted))
    problems = list(_problems(table.lines, wanted, columns, numbers))
    if problems:
        first = problems[:MOST_PROBLEMS]
        if len(problems) > MOST_PROBLEMS:
            first.append(
                Problem(place="", value=None, expected=f"{len(problems) - MOST_PROBLEMS} more lines to be right")
            )
        raise TimedPathError(first)
    return TimedPath(times_s=numbers[:, 0], points_m=numbers[:, 1:4], attitude=_attitude(numbers[:, 4:]))


def _wanted(header: Sequence[str]) -> tuple[list[str], list[Problem]]:
    """Columns that are read, and what is wrong with the head of the file."""
    wanted = [TIME, *PLACE]
    has_quaternion, has_angles = (any(name in header for name in names) for names in (QUATERNION, ANGLES))
    problems = []
    if has_quaternion and has_angles:
        expected = f"one of {', '.join(QUATERNION)} and {', '.join(ANGLES)}"
        problems.append(Problem(place="column names", value=None, expected=expected))
    elif has_quaternion or has_angles:
        wanted += QUATERNION if has_quaternion else ANGLES
    lacking = [name for name in wanted if name not in header]
    if lacking:
        expected = f"{', '.join(lacking)} among them"
        problems.append(Problem(place="column names", value=",".join(header), expected=expected))
    twice = sorted({name for name in wanted if header.count(name) > 1})
    if twice:
        problems.append(Problem(place="column names", value=None, expected=f"{', '.join(twice)} once"))
    return wanted, problems


def _problems(
    lines: Sequence[tuple[int, Sequence[str]]], names: Sequence[str], columns: Sequence[int], numbers: FloatArray
) -> Iterator[Problem]:
    if len(lines) < FEWEST_ROWS:
        yield Problem(place="", value=None, expected=f"{FEWEST_ROWS} rows or more under the names, got {len(lines)}")
    latest = float("-inf")
    for (line, row), found in zip(lines, numbers, strict=True):
        for name, column, number in zip(names, columns, found.tolist(), strict=True):
            if not np.isfinite(number):
                cell = row[column] if column < len(row) else ""
                yield Problem(place=f"line {line}, {name}", value=cell, expected="a finite number")
        if found[0] <= latest:
            yield Problem(place=f"line {line}, {TIME}", value=float(found[0]), expected=f"a time after {latest:g} s")
        latest = float(np.fmax(latest, found[0]))
        length = float(np.linalg.norm(found[4:])) if len(found) == 8 else 1.0
        if np.isfinite(length) and abs(length - 1) > UNIT_WITHIN:
            yield Problem(
                place=f"line {line}, {', '.join(QUATERNION)}",
                value=found[4:].tolist(),
                expected=f"a quaternion of length 1, got {length:.3g}",
            )


def _number(row: Sequence[str], column: int) -> float:
    return finite_number(row[column]) if column < len(row) else float("nan")


def _attitude(numbers: FloatArray) -> Rotation | None:
    if numbers.shape[1] == 0:
        return None
    if numbers.shape[1] == len(QUATERNION):
        return Rotation.from_quat(numbers)
    # Pitch upwards is a turn about the axis to the right.
    return Rotation.from_euler("ZYX", numbers * [1.0, -1.0, 1.0], degrees=True)
