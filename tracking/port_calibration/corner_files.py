"""CSV files of boards' points in images: one row a point and image."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from optics.kernels.tables import TextTable, finite_number
from rigs.atomic_files import csv_text, write_text
from tracking.port_calibration.observations import MEDIA, BoardObservations

POINT_COLUMNS = ("image", "u_px", "v_px", "board_x_mm", "board_y_mm")
SIZE_COLUMNS = ("width_px", "height_px")
HEIGHT_COLUMN = "board_z_mm"
OPTIONAL_COLUMNS = ("camera", "medium", HEIGHT_COLUMN, *SIZE_COLUMNS)

PLACE_COLUMNS = ("board_x_mm", "board_y_mm", HEIGHT_COLUMN)

ONLY_CAMERA = "camera"
USUAL_MEDIUM = "water"
NUMBERS = ("u_px", "v_px", "board_x_mm", "board_y_mm", HEIGHT_COLUMN, *SIZE_COLUMNS)


def read_corners(path: str | os.PathLike[str], *, size_px: tuple[int, int] | None = None) -> BoardObservations:
    """Read points of boards; # begins a comment, the first other line names the columns, in any order.

    Columns: image, u_px, v_px, board_x_mm, board_y_mm, and board_z_mm of a target that is not flat; camera, where there
    are several; medium (`MEDIA`), where it is
    not water; width_px and height_px, unless `size_px` says how large all images are.

    Raises
    ------
    ValueError
        With everything that is wrong with the file, one problem a line.
    """
    table = TextTable.read(Path(path))
    sizes = () if size_px is not None else SIZE_COLUMNS
    problems = table.column_problems((*POINT_COLUMNS, *sizes), OPTIONAL_COLUMNS)
    table.check(problems)
    rows = [row for number, texts in table.rows(problems) if (row := _row(number, texts, problems))]
    if not rows and not problems:
        problems.append("expected points, got none")
    names = tuple(dict.fromkeys(str(row["camera"]) for row in rows))
    found = [_size(name, rows, size_px, problems) for name in names]
    table.check(problems)
    return _observations(rows, names, tuple(found))


def write_corners(path: str | os.PathLike[str], seen: BoardObservations) -> None:
    """Write points so that `read_corners` reads them; the file appears whole or not at all."""
    height = () if seen.is_flat else (HEIGHT_COLUMN,)
    rows: list[list[str]] = [["camera", "medium", *SIZE_COLUMNS, *POINT_COLUMNS, *height]]
    places = seen.board_m[:, :2] if seen.is_flat else seen.places_m
    columns = (seen.camera, seen.medium, seen.image, seen.pixels, places)
    for camera, medium, image, pixel, place in zip(*columns, strict=True):
        size = [str(side) for side in seen.sizes_px[camera]]
        numbers = [*(f"{value:.4f}" for value in pixel), *(f"{1000 * value:.10g}" for value in place)]
        rows.append([seen.cameras[camera], MEDIA[medium], *size, seen.images[image], *numbers])
    write_text(Path(path), csv_text(rows))


def _row(number: int, texts: dict[str, str], problems: list[str]) -> dict[str, float | str]:
    """Fields of a line, empty when it has a bad one, which is added to the problems."""
    medium = texts.get("medium", USUAL_MEDIUM)
    bad = [] if medium in MEDIA else [f"line {number}, column medium: expected {', '.join(MEDIA)}, got {medium!r}"]
    for name in (name for name in NUMBERS if name in texts):
        if math.isnan(finite_number(texts[name])):
            bad.append(f"line {number}, column {name}: expected a finite number, got {texts[name]!r}")
    problems += bad
    if bad:
        return {}
    values: dict[str, float | str] = {name: float(texts[name]) for name in NUMBERS if name in texts}
    return values | {"medium": medium, "image": texts["image"], "camera": texts.get("camera", ONLY_CAMERA)}


def _size(
    name: str, rows: Sequence[dict[str, float | str]], size_px: tuple[int, int] | None, problems: list[str]
) -> tuple[int, int]:
    if size_px is not None:
        return size_px
    of_camera = [row for row in rows if row["camera"] == name]
    sizes = list(dict.fromkeys((int(float(row["width_px"])), int(float(row["height_px"]))) for row in of_camera))
    if len(sizes) > 1:
        told = ", ".join(f"{width} x {height}" for width, height in sizes)
        problems.append(f"camera {name}: expected images of one size, got {told}")
    if min(sizes[0]) < 1:
        problems.append(f"camera {name}: expected width_px and height_px of at least 1, got {sizes[0]}")
    return sizes[0]


def _observations(
    rows: Sequence[dict[str, float | str]], cameras: tuple[str, ...], sizes: tuple[tuple[int, int], ...]
) -> BoardObservations:
    images = tuple(dict.fromkeys(str(row["image"]) for row in rows))
    media: NDArray[np.intp] = np.array([MEDIA.index(str(row["medium"])) for row in rows], dtype=np.intp)
    place = {name: index for index, name in enumerate(images)}
    return BoardObservations(
        cameras=cameras,
        sizes_px=sizes,
        images=images,
        camera=np.array([cameras.index(str(row["camera"])) for row in rows], dtype=np.intp),
        image=np.array([place[str(row["image"])] for row in rows], dtype=np.intp),
        medium=media,
        board_m=np.array([[row.get(name, 0.0) for name in PLACE_COLUMNS] for row in rows], dtype=np.float64) / 1000,
        pixels=np.array([[row["u_px"], row["v_px"]] for row in rows], dtype=np.float64),
    )
