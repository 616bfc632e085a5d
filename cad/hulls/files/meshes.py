"""Meshes that trimesh reads: STL, OBJ and PLY, which say nothing about themselves, and GLB and glTF."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from cad.hulls.files.found import EXPORT_AGAIN, FoundHull, Piece, found_hull, reading

SURFACES = "as MeshLab does by screened Poisson reconstruction"
STL_HEADER = 80
"""Bytes before the number of triangles in a binary STL."""
STL_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read_mesh(file: Path) -> FoundHull:
    """Triangles of an STL, OBJ or PLY file; raises `ValueError` when there are none."""
    corners = _binary_stl(file)
    if corners is not None:
        faces = np.arange(3 * len(corners)).reshape(-1, 3)
        return found_hull(file, [Piece(name="", vertices=corners.reshape(-1, 3), faces=faces)])
    return found_hull(file, _pieces(file))


def read_gltf(file: Path) -> FoundHull:
    """Triangles of a GLB or glTF file, which are metres and y up by their standard; raises `ValueError`."""
    files = (file, *gltf_buffers(file))
    return found_hull(file, _pieces(file), unit_mm=1000.0, up="+y", files=files)


def gltf_buffers(file: Path) -> list[Path]:
    """Files that a glTF file keeps its numbers in; a GLB has none."""
    if file.suffix.lower() != ".gltf":
        return []
    try:
        buffers = json.loads(file.read_text(encoding="utf-8")).get("buffers", [])
        names = [str(buffer["uri"]) for buffer in buffers if not str(buffer["uri"]).startswith("data:")]
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"expected glTF, got what cannot be read as one ({error}); {EXPORT_AGAIN}") from None
    missing = [name for name in names if not (file.parent / name).is_file()]
    if missing:
        raise ValueError(f"expected the files it names beside it, missing: {', '.join(missing)}; put them there")
    return [file.parent / name for name in names]


def _pieces(file: Path) -> list[Piece]:
    with reading("a mesh"):
        scene = trimesh.load_scene(file, process=False)
        placed = [(*scene.graph[node], str(node)) for node in sorted(scene.graph.nodes_geometry)]
        pieces = [_piece(scene.geometry[key], pose, "" if name == file.name else name) for pose, key, name in placed]
    points = sum(len(each.vertices) for each in scene.geometry.values() if isinstance(each, trimesh.PointCloud))
    if points and not any(len(piece.faces) for piece in pieces):
        raise ValueError(
            f"expected triangles, got a cloud of {points:,} points; make a surface of it first, {SURFACES}"
        )
    return pieces


def _piece(geometry: Any, pose: NDArray[np.float64], name: str) -> Piece:
    """A mesh where the file's scene puts it; points and curves hold no triangles."""
    if not isinstance(geometry, trimesh.Trimesh):
        return Piece(name=name, vertices=np.zeros((0, 3)), faces=np.zeros((0, 3), dtype=np.int64))
    vertices = np.asarray(geometry.vertices, dtype=np.float64)
    if not np.array_equal(pose, np.eye(4)):
        vertices = vertices @ pose[:3, :3].T + pose[:3, 3]
    return Piece(name=name, vertices=vertices, faces=np.asarray(geometry.faces, dtype=np.int64))


def _binary_stl(file: Path) -> NDArray[np.float32] | None:
    """Corners of a binary STL, shape (m, 3, 3); None when it is none.

    They are used where they lie in the file: of five million triangles trimesh makes objects of 2 GB.

    Raises
    ------
    ValueError
        When the file ends before its last triangle.
    """
    size = file.stat().st_size
    if file.suffix.lower() != ".stl" or size < STL_HEADER + 4:
        return None
    with file.open("rb") as opened:
        header = opened.read(STL_HEADER)
        count = int.from_bytes(opened.read(4), "little")
    expected = STL_HEADER + 4 + count * STL_RECORD.itemsize
    is_text = header.lstrip().startswith(b"solid") and size != expected
    if is_text or not count:
        return None
    if size < expected:
        whole = (size - STL_HEADER - 4) // STL_RECORD.itemsize
        cut = f"expected {count:,} triangles in a binary STL, got {whole:,}: the file is cut off or no STL"
        raise ValueError(f"{cut}; {EXPORT_AGAIN}")
    return np.array(np.memmap(file, dtype=STL_RECORD, mode="r", offset=STL_HEADER + 4, shape=(count,))["corners"])
