"""3MF, which carries its unit; read by lib3mf, the 3MF consortium's own library."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cad.hulls.files.found import FoundHull, Piece, found_hull, reading

UNITS_MM = {"MicroMeter": 1e-3, "MilliMeter": 1.0, "CentiMeter": 10.0, "Inch": 25.4, "Foot": 304.8, "Meter": 1000.0}


def read_3mf(file: Path) -> FoundHull:
    """Triangles of what a 3MF file would build, z up as on the printer; raises `ValueError` when there are none."""
    import lib3mf  # noqa: PLC0415  (the only format that needs it)

    with reading("3MF"):
        model = lib3mf.get_wrapper().CreateModel()
        model.QueryReader("3mf").ReadFromFile(str(file))
        pieces: list[Piece] = []
        items = model.GetBuildItems()
        while items.MoveNext():
            item = items.GetCurrent()
            pieces += _pieces(item.GetObjectResource(), _matrix(item.GetObjectTransform()))
        unit_mm = UNITS_MM[lib3mf.ModelUnit(model.GetUnit()).name]
    return found_hull(file, pieces, unit_mm=unit_mm, up="+z")


def _pieces(thing: Any, pose: NDArray[np.float64]) -> list[Piece]:
    """Triangles of an object, or of all that it is put together from."""
    if thing.IsComponentsObject():
        parts = [thing.GetComponent(index) for index in range(thing.GetComponentCount())]
        return [
            piece for part in parts for piece in _pieces(part.GetObjectResource(), _matrix(part.GetTransform()) @ pose)
        ]
    vertices = np.array([tuple(place.Coordinates) for place in thing.GetVertices()], dtype=np.float64).reshape(-1, 3)
    faces = np.array([tuple(each.Indices) for each in thing.GetTriangleIndices()], dtype=np.int64).reshape(-1, 3)
    return [Piece(name=thing.GetName(), vertices=np.c_[vertices, np.ones(len(vertices))] @ pose[:, :3], faces=faces)]


def _matrix(transform: Any) -> NDArray[np.float64]:
    """Rows of a 3MF transform, which multiplies (x, y, z, 1) from the right, and the last column for another."""
    rows = np.array([tuple(row) for row in transform.Fields], dtype=np.float64)
    return np.asarray(np.c_[rows, [0.0, 0.0, 0.0, 1.0]])
