"""CSV files of a target's observations: one row a point and image."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from optics.kernels.tables import TextTable, finite_number
from rigs import Rig
from rigs.atomic_files import csv_text, write_text
from tracking.calibration.observations import TargetObservations, observation_problems

POSE_COLUMNS = ("q1_deg", "q2_deg")
PIXEL_COLUMNS = ("u_px", "v_px")
BODY_COLUMNS = ("body_x_mm", "body_y_mm", "body_z_mm")
"""A point whose place is known."""

BOARD_COLUMNS = ("board_x_mm", "board_y_mm")
"""A point on a board whose pose is not known; the column `board` names it when there are several."""

ONLY_BOARD = "board"


def read_observations(path: str | os.PathLike[str], rig: Rig) -> TargetObservations:
    """Read observations; # begins a comment, the first other line names the columns, in any order.

    Columns: q1_deg, q2_deg (both empty where the camera looked at the point directly, past the mirrors), u_px, v_px,
    and either body_x_mm, body_y_mm, body_z_mm or board_x_mm, board_y_mm and, with more than one board, board.

    Raises
    ------
    ValueError
        With everything that is wrong with the file, one problem a line.
    """
    table = TextTable.read(Path(path))
    problems = _column_problems(table)
    table.check(problems)
    rows = [(number, row) for number, texts in table.rows(problems) if (row := _row(number, texts, problems))]
    observations = _observations([row for _, row in rows], known=BODY_COLUMNS[0] in table.names)
    problems += observation_problems(rig, observations, [f"line {number}" for number, _ in rows])
    table.check(problems)
    return observations


def write_observations(path: str | os.PathLike[str], observations: TargetObservations) -> None:
    """Write observations so that `read_observations` reads them; the file appears whole or not at all."""
    place = ("board", *BOARD_COLUMNS) if observations.boards else BODY_COLUMNS
    rows = [[*POSE_COLUMNS, *place, *PIXEL_COLUMNS]]
    columns = (observations.q, observations.points_m, observations.pixels, observations.board)
    for q, point, pixel, board in zip(*columns, strict=True):
        angles = ["" if math.isnan(angle) else repr(math.degrees(angle)) for angle in q.tolist()]
        millimetres = [repr(1000 * x) for x in point.tolist()]
        where = [observations.boards[board], *millimetres[:2]] if observations.boards else millimetres
        rows.append([*angles, *where, *map(repr, pixel.tolist())])
    write_text(Path(path), csv_text(rows))


def _observations(rows: Sequence[dict[str, float | str]], *, known: bool) -> TargetObservations:
    def column(name: str) -> list[float]:
        return [float(row[name]) for row in rows]

    q = np.radians(np.array([column(name) for name in POSE_COLUMNS])).T.reshape(-1, 2)
    place = np.array([column(name) for name in (BODY_COLUMNS if known else BOARD_COLUMNS)]).T / 1000
    pixels = np.array([column(name) for name in PIXEL_COLUMNS]).T.reshape(-1, 2)
    if known:
        return TargetObservations.in_body(q, place.reshape(-1, 3), pixels)
    named = [str(row.get("board", ONLY_BOARD)) for row in rows]
    boards = tuple(dict.fromkeys(named))
    points = np.zeros((len(rows), 3))
    points[:, :2] = place.reshape(-1, 2)
    index = np.array([boards.index(name) for name in named], dtype=np.intp)
    return TargetObservations(q=q, points_m=points, pixels=pixels, boards=boards, board=index)


def _column_problems(table: TextTable) -> list[str]:
    places = [columns for columns in (BODY_COLUMNS, BOARD_COLUMNS) if set(columns) & set(table.names)]
    needed = (*POSE_COLUMNS, *PIXEL_COLUMNS, *(places[0] if len(places) == 1 else ()))
    problems = table.column_problems(needed, (*BODY_COLUMNS, *BOARD_COLUMNS, "board"))
    if len(places) != 1:
        problems.append(f"expected columns {', '.join(BODY_COLUMNS)} or {', '.join(BOARD_COLUMNS)}, either or")
    if "board" in table.names and BODY_COLUMNS[0] in table.names:
        problems.append(f"expected no column board with {', '.join(BODY_COLUMNS)}, which say where a point is")
    return problems


def _row(number: int, texts: dict[str, str], problems: list[str]) -> dict[str, float | str]:
    """Numbers of a line, empty when it has a bad one, which is added to the problems."""
    directly = not any(texts[name] for name in POSE_COLUMNS)
    row: dict[str, float | str] = {}
    for name, text in texts.items():
        unused = directly and name in POSE_COLUMNS
        row[name] = text if name == "board" else finite_number(text)
        if not unused and name != "board" and math.isnan(finite_number(text)):
            problems.append(f"line {number}, column {name}: expected a finite number, got {text!r}")
            return {}
    return row
