"""STEP, which carries its unit: any number of solids, shells and faces as triangles."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from cad.hulls.files.found import EXPORT_AGAIN, FoundHull, Piece, found_hull, reading
from optics.kernels.cache import load_or_make, result_key
from optics.kernels.child_programs import ENDS_WITH_US
from rigs.files import STEP_SUFFIXES

TOLERANCE_MM = 0.2
"""As for every hull that is rendered."""

TRIAL_VERSION = 1
"""Raised when the trial does something else with a file."""


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

    _try_first(file)
    with reading("a STEP file"), without_messages():
        shape = import_step(file)
    if not shape.faces():
        raise ValueError(f"expected a STEP file with solids or faces, got none; {EXPORT_AGAIN}")
    return shape


def _try_first(file: Path) -> None:
    """Refuse a file on which OpenCascade ends its process; of the same content that is found out once."""
    key = result_key("STEP trial", TRIAL_VERSION, version("build123d"), file)
    status = load_or_make(
        "STEP trial",
        key,
        lambda: _trial_status(file),
        pack=lambda found: {"status": np.array(found)},
        unpack=lambda stored: int(stored["status"]),
    )
    if status < 0:
        raise ValueError(
            f"expected a STEP file, got a damaged one, on which OpenCascade fails (signal {-status}); {EXPORT_AGAIN}"
        )


def _trial_status(file: Path) -> int:
    trial = str(Path(__file__).with_name("step_trial.py"))
    arguments = [*ENDS_WITH_US, sys.executable, "-P", trial, str(file), str(TOLERANCE_MM)]
    return subprocess.run(arguments, capture_output=True, check=False).returncode


def _piece(shape: Any) -> Piece:
    try:
        corners, triangles = shape.tessellate(TOLERANCE_MM)
    except AttributeError:
        # OpenCascade has no triangles for one of its faces, which build123d does not foresee.
        raise ValueError(f"expected a STEP file, got one with a face that has no triangles; {EXPORT_AGAIN}") from None
    vertices = np.array([tuple(corner) for corner in corners], dtype=np.float64).reshape(-1, 3)
    faces = np.array(triangles, dtype=np.int64).reshape(-1, 3)
    return Piece(name=str(shape.label or ""), vertices=vertices, faces=faces)
