"""STEP, which carries its unit: solids, shells and faces as triangles, and a closed and valid solid as itself."""

from __future__ import annotations

import io
import signal
import subprocess
import sys
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np

from cad.hulls.files.found import EXPORT_AGAIN, FoundHull, Piece, found_hull
from optics.kernels.cache import Arrays, load_or_make, result_key
from optics.kernels.child_programs import ENDS_WITH_US
from rigs.files import STEP_SUFFIXES

if TYPE_CHECKING:
    from build123d import Solid
    from numpy.typing import NDArray

TOLERANCE_MM = 0.2
"""As for every hull that is rendered."""

READ_VERSION = 2
"""Raised when something else is read of the same file."""

PROBLEM = 1
"""Exit status of the reader when it says what is wrong."""


def read_step(file: Path) -> FoundHull:
    """Triangles of all solids, and of the faces that bound none; raises `ValueError` when there are none."""
    read = _read(file, file.stat().st_mtime_ns)
    ends = np.cumsum([read["corners"], read["triangles"]], axis=1)
    vertices = np.split(read["vertices"], ends[0, :-1])
    faces = np.split(read["faces"], ends[1, :-1])
    pieces = [Piece(name="", vertices=v, faces=f) for v, f in zip(vertices, faces, strict=True)]
    return found_hull(file, pieces, unit_mm=1.0)


def is_one_solid(file: Path) -> bool:
    """Whether a file is STEP and holds one solid alone, closed and valid: the kernel can then work on it as it is."""
    if file.suffix.lower() not in STEP_SUFFIXES:
        return False
    try:
        return bool(_read(file, file.stat().st_mtime_ns)["solid"].size)
    except ValueError:
        return False


def step_shape(file: Path) -> Solid:
    """The solid of a file for which `is_one_solid` holds, millimetres; raises `ValueError` for another file."""
    from build123d import Solid  # noqa: PLC0415  (takes seconds to import)
    from OCP.BinTools import BinTools  # noqa: PLC0415
    from OCP.TopoDS import TopoDS, TopoDS_Shape  # noqa: PLC0415

    solid = _read(file, file.stat().st_mtime_ns)["solid"]
    if not solid.size:
        raise ValueError("expected one solid alone, closed and valid; another file is read as triangles")
    shape = TopoDS_Shape()
    BinTools.Read_s(shape, io.BytesIO(solid.tobytes()))
    return Solid(TopoDS.Solid(shape))


def named_planes(file: Path) -> dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Flat faces with a name in a STEP file: the middle of each, millimetres, and its outward normal, file's axes."""
    read = _read(file, file.stat().st_mtime_ns)
    return dict(zip(read["names"].tolist(), zip(read["points"], read["normals"], strict=True), strict=True))


@lru_cache(maxsize=1)
def _read(file: Path, changed_ns: int) -> Arrays:
    """What the reader finds in a file; of the same content that is found out once, but for what is wrong with it."""
    key = result_key("STEP", READ_VERSION, version("build123d"), file)
    return load_or_make("STEP", key, lambda: _read_apart(file), pack=lambda found: found, unpack=lambda kept: kept)


def _read_apart(file: Path) -> Arrays:
    reader = str(Path(__file__).with_name("step_reader.py"))
    with TemporaryDirectory() as folder:
        arguments = [*ENDS_WITH_US, sys.executable, "-P", reader, str(file), folder, str(TOLERANCE_MM)]
        ended = subprocess.run(arguments, capture_output=True, text=True, check=False)
        if ended.returncode:
            raise ValueError(_problem(ended))
        solid = Path(folder, "solid.brep")
        with np.load(Path(folder, "triangles.npz")) as stored:
            kept = np.frombuffer(solid.read_bytes() if solid.exists() else b"", dtype=np.uint8)
            return {**stored, "solid": kept}


def _problem(ended: subprocess.CompletedProcess[str]) -> str:
    said = ended.stderr.strip().splitlines()[-1:] or [f"status {ended.returncode}"]
    if ended.returncode == -signal.SIGKILL:
        return "expected to read it, but the system ended the reader, as it does when memory is short; free some"
    if ended.returncode < 0:
        found = f"a damaged one, on which OpenCascade fails (signal {-ended.returncode})"
        return f"expected a STEP file, got {found}; {EXPORT_AGAIN}"
    if ended.returncode == PROBLEM and said[0].startswith("expected"):
        return f"{said[0]}; {EXPORT_AGAIN}"
    return f"expected a STEP file, got what cannot be read as one ({said[0]}); {EXPORT_AGAIN}"
