"""The key of what is made of a hull's file, found without Mitsuba, which helps to make it.

A process that has the key may still be copied (`cad.assembly.building_process`).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version

from cad.hulls.files.triangles import hull_files
from optics.kernels.cache import result_key
from rigs import FileHull

HULL_MESH_VERSION = 5
"""Raised when reading, repair or simplification make another surface, solid or other notes of the same file."""


def hull_mesh_key(hull: FileHull) -> str:
    """Key of what is made of a hull's file: what it and those it names hold, how they are read, by which libraries.

    Raises
    ------
    ValueError
        When the file, or one that it names, cannot be found or read; the message names it.
    """
    libraries = [version(name) for name in ("trimesh", "manifold3d", "fast-simplification", "libigl")]
    with named(hull):
        files = hull_files(hull.file)
    how = hull.file.suffix.lower(), hull.unit, hull.keep
    return result_key("hull mesh", HULL_MESH_VERSION, *files, how, libraries)


@contextmanager
def named(hull: FileHull) -> Iterator[None]:
    """Begin the sentence of what is wrong with the file's name."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"hull.file = {hull.file.name!r}: {error}") from None
