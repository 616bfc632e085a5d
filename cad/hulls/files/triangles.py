"""A hull's file, whatever its format: what it holds, and its triangles in millimetres."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from cad.hulls.files.collada import read_collada
from cad.hulls.files.found import EXPORT_AGAIN, Faces, FoundHull
from cad.hulls.files.links import mesh_uris
from cad.hulls.files.meshes import gltf_buffers, read_gltf, read_mesh
from cad.hulls.files.sdf import read_sdf, sdf_model
from cad.hulls.files.step import read_step
from cad.hulls.files.three_mf import read_3mf
from cad.hulls.files.units import MILLIMETRES
from cad.hulls.files.urdf import read_urdf, urdf_root
from cad.hulls.files.uris import find_file
from cad.hulls.mesh_repair import welded
from optics.kernels.arrays import FloatArray
from rigs import Unit
from rigs.files import ROBOT_SUFFIXES, STEP_SUFFIXES

MESHES: Mapping[str, Callable[[Path], FoundHull]] = {
    ".stl": read_mesh,
    ".obj": read_mesh,
    ".ply": read_mesh,
    ".dae": read_collada,
    ".glb": read_gltf,
    ".gltf": read_gltf,
    ".3mf": read_3mf,
}
HEAD = 200
"""Bytes by which a file is known that was never a mesh."""
NO_MESH = {
    b"version https://git-lfs": "a pointer of Git LFS; fetch the file itself with: git lfs pull",
    b"<!doctype html": "a web page; download the file itself (on GitHub: raw)",
    b"<html": "a web page; download the file itself (on GitHub: raw)",
}
READERS: Mapping[str, Callable[[Path], FoundHull]] = {
    **MESHES,
    **dict.fromkeys(STEP_SUFFIXES, read_step),
    ".sdf": lambda file: read_sdf(file, read_named_mesh),
    **dict.fromkeys((".urdf", ".xacro"), lambda file: read_urdf(file, read_named_mesh)),
}


def read_hull_file(file: str | Path) -> FoundHull:
    """What a hull's file holds, in its own numbers and axes.

    Parameters
    ----------
    file : str or Path
        STEP, STL, OBJ, PLY, 3MF, GLB, glTF, COLLADA, URDF (with xacro's macros where xacro is installed) or SDF.

    Raises
    ------
    ValueError
        When it cannot be used; the message names it and says what is wrong and what to do.
    FileNotFoundError
        When there is no such file.
    """
    path = Path(file)
    if not path.is_file():
        raise FileNotFoundError(f"{path}: expected a file, found {'a folder' if path.is_dir() else 'nothing'}")
    try:
        return _read(path)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def read_triangles(file: Path, unit: Unit | None) -> tuple[FloatArray, Faces]:
    """Triangles of a file as they are: they may be open, double, or face any way.

    Parameters
    ----------
    file : Path
        As for `read_hull_file`.
    unit : Unit or None
        One of `MILLIMETRES`, which overrules what the file says; None when the file says itself what its numbers mean.

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
    found = _read(file)
    unit_mm = found.unit_mm if unit is None else MILLIMETRES[unit]
    if unit_mm is None:
        raise ValueError(f"expected a unit ({', '.join(MILLIMETRES)}), got none; the file does not say")
    return welded(found.vertices, found.faces, scale=unit_mm)


def hull_files(file: Path) -> tuple[Path, ...]:
    """A hull's file and those that it names, without their triangles: all that its shape comes from."""
    suffix = file.suffix.lower()
    if suffix == ".gltf":
        return (file, *gltf_buffers(file))
    if suffix not in ROBOT_SUFFIXES:
        return (file,)
    root = sdf_model(file) if suffix == ".sdf" else urdf_root(file)
    named = [path for uri in mesh_uris(root) if (path := find_file(uri, file)) is not None]
    return tuple(dict.fromkeys([file, *(below for path in named for below in hull_files(path))]))


def read_named_mesh(file: Path) -> FoundHull:
    """A mesh that a robot's description names; raises `ValueError`."""
    return _read(file, MESHES)


def _read(file: Path, readers: Mapping[str, Callable[[Path], FoundHull]] | None = None) -> FoundHull:
    readers = readers or READERS
    reader = readers.get(file.suffix.lower())
    if reader is None:
        raise ValueError(f"expected a file that ends in {', '.join(readers)}")
    with file.open("rb") as opened:
        head = opened.read(HEAD).lstrip().lower()
    for start, what in NO_MESH.items():
        if head.startswith(start):
            raise ValueError(f"expected a mesh, got {what}")
    if not head:
        raise ValueError(f"expected a mesh, got an empty file; {EXPORT_AGAIN}")
    return reader(file)
