"""What a hull's file holds, as its format says it: nothing is repaired, turned or scaled."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray

Faces = NDArray[np.int64]
Corners = NDArray[np.floating[Any]]
FURTHEST = 1e12
"""Coordinate of a corner in whatever unit; of what is beyond, areas and volumes are no numbers any more."""
EXPORT_AGAIN = "export it again from the program that made it, as STL, GLB or STEP"


@contextmanager
def reading(what: str) -> Iterator[None]:
    """Turn whatever a library raises while it reads a broken file into a sentence: `ValueError`."""
    try:
        yield
    except Exception as error:
        # Readers of broken files fail in as many ways as files are broken.
        said = " ".join(str(error).split()) or type(error).__name__
        raise ValueError(f"expected {what}, got what cannot be read as one ({said}); {EXPORT_AGAIN}") from None


@dataclass(frozen=True, kw_only=True)
class FoundBody:
    """A part that the file keeps apart from others.

    Attributes
    ----------
    name : str
        Its name in the file; empty when it has none.
    triangles : int
        How many triangles it has.
    """

    name: str
    triangles: int


@dataclass(frozen=True, kw_only=True)
class FoundCamera:
    """A link or sensor that is called a camera.

    Attributes
    ----------
    name : str
        Its name in the file.
    position_mm : array, shape (3,)
        Its origin in the file's frame.
    look, top : array, shape (3,)
        Unit vectors in the file's frame: where it looks, and what is up in its image.
    """

    name: str
    position_mm: FloatArray
    look: FloatArray
    top: FloatArray


@dataclass(frozen=True, kw_only=True)
class FoundHull:
    """What a hull's file holds.

    Attributes
    ----------
    file : Path
        The file.
    vertices : array, shape (n, 3)
        Corners in the file's own numbers and axes.
    faces : array, shape (m, 3)
        Indices into them.
    bodies : tuple of FoundBody
        The file's parts in the order of the faces.
    unit_mm : float or None
        Millimetres in one of the file's numbers; None when the file does not say.
    up, forward : str or None
        Axis of the file, such as ``+z``, that its format says is up or forward.
    has_frame : bool
        Whether the file's origin is that of the robot, as a URDF's base link is.
    mass_kg : float or None
        Mass of all links together.
    cameras : tuple of FoundCamera
    files : tuple of Path
        All that was read: the file and those it names.
    """

    file: Path
    vertices: Corners
    faces: Faces
    bodies: tuple[FoundBody, ...]
    unit_mm: float | None = None
    up: str | None = None
    forward: str | None = None
    has_frame: bool = False
    mass_kg: float | None = None
    cameras: tuple[FoundCamera, ...] = ()
    files: tuple[Path, ...] = ()

    def faces_of(self, name: str) -> Faces:
        """Faces of the bodies of one name, shape (k, 3); none when there is no such body."""
        owners = np.repeat(np.arange(len(self.bodies)), [body.triangles for body in self.bodies])
        return self.faces[np.isin(owners, [index for index, body in enumerate(self.bodies) if body.name == name])]

    @cached_property
    def size(self) -> FloatArray:
        """Sides of the box around what the triangles use, in the file's numbers, shape (3,)."""
        return np.asarray(np.diff(self.box, axis=0)[0])

    @cached_property
    def box(self) -> FloatArray:
        """Lowest and highest coordinates of the corners that triangles use, in the file's numbers, shape (2, 3)."""
        used = np.zeros(len(self.vertices), dtype=bool)
        used[self.faces.reshape(-1)] = True
        corners = self.vertices[used]
        return np.array([corners.min(axis=0), corners.max(axis=0)], dtype=np.float64)


@dataclass(frozen=True, kw_only=True)
class Piece:
    """Triangles of one name, before they are put together.

    Attributes
    ----------
    name : str
    vertices : array, shape (n, 3)
    faces : array, shape (m, 3)
    """

    name: str
    vertices: Corners
    faces: Faces


def found_hull(file: Path, pieces: Sequence[Piece], **says: Any) -> FoundHull:
    """Put pieces together, and see that they are triangles in space.

    Parameters
    ----------
    file : Path
    pieces : sequence of Piece
    **says : Any
        What else the file says: fields of `FoundHull`.

    Raises
    ------
    ValueError
        When there are no triangles, corners are not three numbers, or triangles name corners that are not there; the
        message says all of it, without the file's name.
    """
    kept = [piece for piece in pieces if len(piece.faces)]
    if not kept:
        raise ValueError(f"expected triangles, got none; {EXPORT_AGAIN}")
    problems = [problem for piece in kept for problem in _problems(piece)]
    if problems:
        raise ValueError(f"{'; '.join(problems)}; {EXPORT_AGAIN}")
    starts = np.cumsum([0, *(len(piece.vertices) for piece in kept[:-1])])
    one = len(kept) == 1
    vertices = kept[0].vertices if one else np.concatenate([piece.vertices for piece in kept])
    faces = kept[0].faces if one else np.concatenate([p.faces + s for p, s in zip(kept, starts, strict=True)])
    bodies = tuple(FoundBody(name=piece.name, triangles=len(piece.faces)) for piece in kept)
    return FoundHull(file=file, vertices=vertices, faces=faces, bodies=bodies, **({"files": (file,)} | says))


def _problems(piece: Piece) -> list[str]:
    where = f" in {piece.name!r}" if piece.name else ""
    if piece.vertices.ndim != 2 or piece.vertices.shape[1] != 3:
        return [f"expected corners of three coordinates{where}, got an array of {piece.vertices.shape}"]
    problems = []
    # Sums are not finite where a number is not, and take no array of their own.
    if not np.isfinite(piece.vertices.sum(dtype=np.float64)):
        wrong = int((~np.isfinite(piece.vertices)).any(axis=1).sum())
        if wrong:
            of_all = f"{wrong} of {len(piece.vertices)}"
            problems.append(f"expected finite corners{where}, got {of_all} that are not a number or infinite")
    if not problems and len(piece.vertices) and (furthest := float(np.abs(piece.vertices).max())) > FURTHEST:
        problems.append(f"expected corners within {FURTHEST:g} of the origin{where}, got one at {furthest:.3g}")
    low, high = int(piece.faces.min()), int(piece.faces.max())
    if low < 0 or high >= len(piece.vertices):
        wrong = int(((piece.faces < 0) | (piece.faces >= len(piece.vertices))).any(axis=1).sum())
        problems.append(
            f"expected triangles of the corners 0 to {len(piece.vertices) - 1}{where}, "
            f"got {wrong} of {len(piece.faces)} with others, {low} to {high}"
        )
    return problems
