"""The triangles of a hull's file in millimetres, whatever its format."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from cad.hulls.files.units import MILLIMETRES
from cad.hulls.mesh_repair import welded
from optics.kernels.arrays import FloatArray

STL_HEADER = 80
"""Bytes before the number of triangles in a binary STL."""

Faces = NDArray[np.int64]


def read_triangles(file: Path, unit: str | None) -> tuple[FloatArray, Faces]:
    """Triangles of a file as they are: they may be open, double, or face any way.

    Parameters
    ----------
    file : Path
        STL, OBJ or PLY.
    unit : str or None
        One of `MILLIMETRES`; None when the file says itself what its numbers mean.

    Returns
    -------
    vertices_mm : array, shape (n, 3)
        In the file's axes; corners in one place are one.
    faces : array, shape (m, 3)
        Indices into them, each of three different ones.

    Raises
    ------
    ValueError
        When there are none; the message says "expected ..., got ...", without the file's name.
    """
    vertices, faces = _read(file)
    return welded(vertices, faces, scale=1.0 if unit is None else MILLIMETRES[unit])


def _read(file: Path) -> tuple[NDArray[np.floating[Any]], Faces]:
    corners = _binary_stl(file)
    if corners is not None:
        return corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)
    try:
        mesh = trimesh.load_mesh(file, process=False)
    except Exception as error:
        # Readers of broken files fail in as many ways as files are broken.
        raise ValueError(f"expected a mesh, got what cannot be read as one ({error})") from None
    vertices, faces = np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)
    if not len(faces):
        raise ValueError("expected triangles, got none")
    return vertices, faces


def _binary_stl(file: Path) -> NDArray[np.float32] | None:
    """Corners of a binary STL, shape (m, 3, 3); None when it is none.

    They are used where they lie in the file: of five million triangles trimesh makes objects of 2 GB.
    """
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    size = file.stat().st_size
    if file.suffix.lower() != ".stl" or size < STL_HEADER + 4 + record.itemsize:
        return None
    with file.open("rb") as opened:
        opened.seek(STL_HEADER)
        count = int.from_bytes(opened.read(4), "little")
    if size != STL_HEADER + 4 + count * record.itemsize:
        return None
    return np.array(np.memmap(file, dtype=record, mode="r", offset=STL_HEADER + 4, shape=(count,))["corners"])
