"""Samples of the gaze mirror's corners over the joint values: what eq. 6 interpolates between, and their CSV."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from optics.kernels.arrays import FloatArray
from optics.kernels.tables import TextTable, finite_number, listed_problems
from rigs.atomic_files import csv_text, write_text
from tracking.perception.crop import runs_clockwise

CORNER_NAMES = ("top_left", "top_right", "bottom_right", "bottom_left")
"""The crop's order; clockwise in the image."""

JOINT_COLUMNS = ("q1_deg", "q2_deg")
CORNER_COLUMNS = tuple(f"{corner}_{axis}_px" for corner in CORNER_NAMES for axis in "uv")
COLUMNS = JOINT_COLUMNS + CORNER_COLUMNS

FEWEST_SAMPLES = 4
"""Both ends of both joints."""


@dataclass(frozen=True, kw_only=True)
class CornerSamples:
    """Where the mirror's corners were seen, at N pairs of joint values.

    Attributes
    ----------
    q : array, shape (n, 2)
        Pan and tilt, radians; no pair twice.
    corners_px : array, shape (n, 4, 2)
        Top left, top right, bottom right, bottom left of the crop: clockwise in the image, wherever the mirror turns.
    """

    q: FloatArray
    corners_px: FloatArray

    def __post_init__(self) -> None:
        q, corners = np.asarray(self.q, dtype=np.float64), np.asarray(self.corners_px, dtype=np.float64)
        if q.ndim != 2 or q.shape[1:] != (2,) or corners.shape != (len(q), 4, 2):
            raise ValueError(
                f"expected q of shape (n, 2) and corners_px of shape (n, 4, 2), got {q.shape} and {corners.shape}"
            )
        problems = _problems(q, corners, [f"sample {index}" for index in range(len(q))])
        if problems:
            raise ValueError(listed_problems("corner samples", problems))
        object.__setattr__(self, "q", q)
        object.__setattr__(self, "corners_px", corners)

    @classmethod
    def from_csv(cls, path: str | os.PathLike[str]) -> Self:
        """Read samples; # begins a comment, the first other line names the columns, in any order.

        Columns: q1_deg, q2_deg, and for each of top_left, top_right, bottom_right, bottom_left its _u_px and _v_px.

        Raises
        ------
        ValueError
            With everything that is wrong with the file, one problem a line.
        """
        table = TextTable.read(Path(path))
        problems = table.column_problems(COLUMNS)
        named = not problems
        rows = [(number, row) for number, row in _numbers(table, problems) if np.isfinite(list(row.values())).all()]
        if named:
            values = np.array([[row[name] for name in COLUMNS] for _, row in rows]).reshape(-1, len(COLUMNS))
            q, corners = np.radians(values[:, :2]), values[:, 2:].reshape(-1, 4, 2)
            problems += _problems(q, corners, [f"line {number}" for number, _ in rows], count=len(table.lines))
        table.check(problems)
        return cls(q=q, corners_px=corners)

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the samples, pixels exactly, angles to their last bit; the file appears whole or not at all."""
        rows = (
            [*(repr(math.degrees(angle)) for angle in q.tolist()), *map(repr, corners.ravel().tolist())]
            for q, corners in zip(self.q, self.corners_px, strict=True)
        )
        write_text(Path(path), csv_text([COLUMNS, *rows]))


def _problems(q: FloatArray, corners: FloatArray, places: Sequence[str], count: int | None = None) -> list[str]:
    """What is wrong with samples, each with its place; `count` of them with those that could not be read."""
    problems = []
    count = len(q) if count is None else count
    if count < FEWEST_SAMPLES:
        problems.append(f"expected at least {FEWEST_SAMPLES} samples, got {count}")
    finite = np.isfinite(q).all(axis=1) & np.isfinite(corners).all(axis=(1, 2))
    problems += [
        f"{places[index]}: expected finite numbers, got {_listed(q, corners, index)}" for index in _at(~finite)
    ]
    seen: dict[tuple[float, ...], str] = {}
    for index in _at(finite):
        place = tuple(q[index].tolist())
        if place in seen:
            problems.append(f"{places[index]}: expected joint values that are not those of {seen[place]} already")
        seen.setdefault(place, places[index])
    turned = finite & ~np.atleast_1d(runs_clockwise(corners))
    problems += [
        f"{places[index]}: expected {', '.join(CORNER_NAMES)} clockwise around a convex outline, "
        f"got {corners[index].tolist()}"
        for index in _at(turned)
    ]
    return problems


def _at(mask: ArrayLike) -> list[int]:
    return list(np.flatnonzero(mask).tolist())


def _listed(q: FloatArray, corners: FloatArray, index: int) -> str:
    return f"q = {q[index].tolist()}, corners_px = {corners[index].tolist()}"


def _numbers(table: TextTable, problems: list[str]) -> Iterator[tuple[int, dict[str, float]]]:
    """Line numbers and values by column; what is not a finite number is added to the problems."""
    for number, texts in table.rows(problems):
        values = {name: finite_number(text) for name, text in texts.items()}
        problems += [
            f"line {number}, column {name}: expected a finite number, got {texts[name]!r}"
            for name, value in values.items()
            if math.isnan(value)
        ]
        yield number, values
