"""Boards by name, and Kalibr's target files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from optics.kernels.tables import listed_problems
from tracking.port_calibration.boards import DICTIONARIES, AprilGrid, Board, Charuco, Chessboard
from tracking.port_calibration.yaml_files import read_yaml

BOARDS = ("chessboard", "charuco", "aprilgrid")


def board_of(
    kind: str,
    *,
    columns: int,
    rows: int,
    square_m: float,
    marker_m: float = 0.0,
    dictionary: str = "DICT_5X5_100",
    spacing: float = 0.3,
) -> Board:
    """Board of a kind among `BOARDS`; a `ValueError` with all that is wrong, one problem a line."""
    problems = _problems(kind, columns, rows, square_m)
    if kind == "charuco" and not 0 < marker_m < square_m:
        problems.append(f"expected --marker-mm between 0 and --square-mm, got {1000 * marker_m:g}")
    if kind == "charuco" and dictionary not in DICTIONARIES:
        problems.append(f"expected --dictionary to be one of {', '.join(DICTIONARIES)}, got {dictionary!r}")
    if kind == "aprilgrid" and not spacing > 0:
        problems.append(f"expected --spacing > 0, got {spacing:g}")
    if problems:
        raise ValueError("\n".join(problems))
    if kind == "chessboard":
        return Chessboard(columns=columns, rows=rows, square_m=square_m)
    if kind == "charuco":
        return Charuco(columns=columns, rows=rows, square_m=square_m, marker_m=marker_m, dictionary=dictionary)
    return AprilGrid(columns=columns, rows=rows, tag_m=square_m, spacing=spacing)


def read_target(path: Path) -> Board:
    """Board of Kalibr's target file (YAML): an aprilgrid or a checkerboard."""
    target = read_yaml(path)
    try:
        return _of_target(target)
    except (KeyError, TypeError, ValueError) as error:
        told = f"a key {error}" if isinstance(error, KeyError) else str(error)
        raise ValueError(listed_problems(str(path), [f"expected a target file of Kalibr; {told}"])) from None


def _of_target(target: dict[str, Any]) -> Board:
    kind = target["target_type"]
    if kind == "aprilgrid":
        columns, rows = int(target["tagCols"]), int(target["tagRows"])
        side, spacing = float(target["tagSize"]), float(target["tagSpacing"])
        return board_of(kind, columns=columns, rows=rows, square_m=side, spacing=spacing)
    if kind == "checkerboard":
        columns, rows = int(target["targetCols"]), int(target["targetRows"])
        sides = {float(target[name]) for name in ("rowSpacingMeters", "colSpacingMeters")}
        if len(sides) > 1:
            raise ValueError(f"expected squares, got sides of {sorted(sides)} m")
        return board_of("chessboard", columns=columns, rows=rows, square_m=sides.pop())
    raise ValueError(f"expected target_type aprilgrid or checkerboard, got {kind!r}")


def _problems(kind: str, columns: int, rows: int, square_m: float) -> list[str]:
    problems = [] if kind in BOARDS else [f"expected --board {', '.join(BOARDS)}, got {kind!r}"]
    fewest = 1 if kind == "aprilgrid" else 3
    sides = {"--columns": columns, "--rows": rows}
    problems += [f"expected {name} of at least {fewest}, got {side}" for name, side in sides.items() if side < fewest]
    if not square_m > 0:
        problems.append(f"expected --square-mm > 0, got {1000 * square_m:g}")
    return problems
