"""STEP, which carries its unit: any number of solids, shells and faces as triangles."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from cad.hulls.files.found import EXPORT_AGAIN, FoundHull, Piece, found_hull, reading
from rigs.files import STEP_SUFFIXES

TOLERANCE_MM = 0.2
"""As for every hull that is rendered."""


def read_step(file: Path) -> FoundHull:
    """Triangles of all solids, and of the faces that bound none; raises `ValueError` when there are none."""
    shape = step_shape(file)
    solids = list(shape.solids())
    bounding = {face for solid in solids for face in solid.faces()}
    loose = [face for face in shape.faces() if face not in bounding]
    return found_hull(file, [_piece(each) for each in (*solids, *loose)], unit_mm=1.0)


def step_shape(file: Path) -> Any:
    """What a STEP file holds, millimetres; raises `ValueError` when it cannot be read or holds nothing."""
    return _shape(file, file.stat().st_mtime_ns)


def is_one_solid(file: Path) -> bool:
    """Whether a file is STEP and holds one solid and nothing else: the kernel can then work on it as it is."""
    if file.suffix.lower() not in STEP_SUFFIXES:
        return False
    try:
        shape = step_shape(file)
    except ValueError:
        return False
    solids = shape.solids()
    return len(solids) == 1 and len(shape.faces()) == len(solids[0].faces())


@contextmanager
def without_messages() -> Iterator[None]:
    """Within it OpenCascade writes nothing on the terminal: what is wrong with a file is ours to say."""
    from OCP.Message import Message  # noqa: PLC0415  (comes with build123d)

    messenger = Message.DefaultMessenger_s()
    printers = list(messenger.Printers())
    for printer in printers:
        messenger.RemovePrinter(printer)
    try:
        yield
    finally:
        for printer in printers:
            messenger.AddPrinter(printer)


@lru_cache(maxsize=1)
def _shape(file: Path, changed_ns: int) -> Any:
    from build123d import import_step  # noqa: PLC0415  (takes seconds to import)

    with reading("a STEP file"), without_messages():
        shape = import_step(file)
    if not shape.faces():
        raise ValueError(f"expected a STEP file with solids or faces, got none; {EXPORT_AGAIN}")
    return shape


def _piece(shape: Any) -> Piece:
    corners, triangles = shape.tessellate(TOLERANCE_MM)
    vertices = np.array([tuple(corner) for corner in corners], dtype=np.float64).reshape(-1, 3)
    faces = np.array(triangles, dtype=np.int64).reshape(-1, 3)
    return Piece(name=str(shape.label or ""), vertices=vertices, faces=faces)
