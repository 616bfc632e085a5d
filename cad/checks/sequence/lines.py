"""How far a body can go straight before it hits others: lines in its direction, a tenth of a millimetre apart.

A body that moves along a line hits what has a face over one of its own faces. Faces are laid on a raster of lines
along the direction, so the length is exact however far it is; only between the lines is it sampled.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter
from scipy.spatial.transform import Rotation

from optics.kernels.arrays import FloatArray

LINE_MM = 0.1
"""Between two lines, as long as their number is below `MOST_LINES`."""
MOST_LINES = 250_000
"""On more the lines are further apart: beside a hull a contact is some millimetres wide."""
CONTACT_LINES = 3
"""A contact counts when it is this many lines wide both ways: meshes of round fits cross by less than 0.05 mm."""
SEAT_MM = 0.05
"""What a face may be behind the one that it lies on, and still hits it: the tolerance of two meshes."""
_FIRST = 0.5382
"""Of the pitch, from the box's rim to the first line: no line runs in the middle of anything, where edges are."""


@dataclass(frozen=True, kw_only=True)
class Surface:
    """Triangles of one or several bodies, millimetres: vertices, shape (n, 3), and faces, shape (m, 3)."""

    vertices_mm: FloatArray
    faces: NDArray[np.int64]

    @classmethod
    def joined(cls, surfaces: list[Surface]) -> Surface:
        """Several as one."""
        starts = np.cumsum([0, *(len(surface.vertices_mm) for surface in surfaces)])
        return cls(
            vertices_mm=np.vstack([surface.vertices_mm for surface in surfaces]),
            faces=np.vstack([surface.faces + start for surface, start in zip(surfaces, starts, strict=False)]),
        )

    def moved(self, shift_mm: FloatArray) -> Surface:
        """The same elsewhere."""
        return Surface(vertices_mm=self.vertices_mm + shift_mm, faces=self.faces)


@dataclass(frozen=True)
class _Raster:
    """Lines at ``low + (index + _FIRST) * pitch`` in the two directions across."""

    low: FloatArray
    count: NDArray[np.int64]
    pitch: float


def free_travel_mm(moving: Surface, still: Surface, direction: FloatArray, *, line_mm: float = LINE_MM) -> float:
    """How far a body can go along a direction until it hits others; infinite when it hits none.

    Parameters
    ----------
    moving, still : Surface
        Closed surfaces, outside counter-clockwise. Where they share volume at the start, the length is that of the
        faces in front alone.
    direction : array, shape (3,)
        Unit vector.
    line_mm : float
        Between the lines; contacts narrower than `CONTACT_LINES` of them do not count.
    """
    turn = _along_z(direction)
    ours, theirs = moving.vertices_mm @ turn.T, still.vertices_mm @ turn.T
    low = np.maximum(ours.min(axis=0), theirs.min(axis=0))[:2]
    high = np.minimum(ours.max(axis=0), theirs.max(axis=0))[:2]
    if (high <= low).any() or theirs[:, 2].max() < ours[:, 2].min():
        return np.inf
    pitch = max(line_mm, float(np.sqrt(np.prod(high - low) / MOST_LINES)))
    raster = _Raster(low=low, count=np.ceil((high - low) / pitch).astype(np.int64), pitch=pitch)
    fronts = _faces_on(raster, ours, moving.faces, front=True)
    backs = _faces_on(raster, theirs, still.faces, front=False)
    return _first_contact(raster, fronts, backs)


def _first_contact(
    raster: _Raster, fronts: tuple[NDArray[np.int64], FloatArray], backs: tuple[NDArray[np.int64], FloatArray]
) -> float:
    """Smallest gap from a front of the moving body to the next back of the others, over contacts that are wide."""
    line = np.concatenate([fronts[0], backs[0]])
    level = np.concatenate([fronts[1] - SEAT_MM, backs[1]])
    still = np.concatenate([np.zeros(len(fronts[0]), dtype=bool), np.ones(len(backs[0]), dtype=bool)])
    order = np.lexsort((level, line))
    line, level, still = line[order], level[order], still[order]
    follows = ~still[:-1] & still[1:] & (line[:-1] == line[1:])
    gaps = np.full(int(np.prod(raster.count)), np.inf)
    np.minimum.at(gaps, line[:-1][follows], (level[1:] - level[:-1])[follows] - SEAT_MM)
    widest = maximum_filter(gaps.reshape(raster.count), CONTACT_LINES, mode="constant", cval=np.inf)
    return max(float(widest.min(initial=np.inf)), 0.0)


def _faces_on(
    raster: _Raster, vertices: FloatArray, faces: NDArray[np.int64], *, front: bool
) -> tuple[NDArray[np.int64], FloatArray]:
    """Lines that faces which look along z (or against it) are on, and their levels there."""
    faces = faces[_over(raster, vertices, faces)]
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    up = normals[:, 2] if front else -normals[:, 2]
    # Faces along the lines have no front.
    chosen = up > 1e-6 * np.linalg.norm(normals, axis=1)
    corners, normals = corners[chosen], normals[chosen]
    face, row = _rows(raster, corners[:, :, 1])
    at = raster.low[1] + (row + _FIRST) * raster.pitch
    start, end = _chord(corners[face], at)
    origin = raster.low[0] + _FIRST * raster.pitch
    left = np.clip(np.ceil((start - origin) / raster.pitch), 0, raster.count[0]).astype(np.int64)
    right = np.clip(np.ceil((end - origin) / raster.pitch), 0, raster.count[0]).astype(np.int64)
    piece, column = _spread(left, right)
    face, row = face[piece], row[piece]
    x, y = origin + column * raster.pitch, at[piece]
    corner, normal = corners[face, 0], normals[face]
    level = corner[:, 2] - (normal[:, 0] * (x - corner[:, 0]) + normal[:, 1] * (y - corner[:, 1])) / normal[:, 2]
    return column * raster.count[1] + row, level


def _over(raster: _Raster, vertices: FloatArray, faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which triangles have their boxes over the raster: of a hull few, so that is asked of all before anything else."""
    reach = raster.low + raster.count * raster.pitch
    inside = np.ones(len(faces), dtype=bool)
    for axis in (0, 1):
        first, second, third = vertices[:, axis][faces].T
        inside &= np.maximum(np.maximum(first, second), third) > raster.low[axis]
        inside &= np.minimum(np.minimum(first, second), third) < reach[axis]
    return inside


def _rows(raster: _Raster, y: FloatArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Each triangle, as often as there are rows of lines through it, and the row; `y` of its corners, shape (m, 3)."""
    origin = raster.low[1] + _FIRST * raster.pitch
    low = np.clip(np.ceil((y.min(axis=1) - origin) / raster.pitch), 0, raster.count[1]).astype(np.int64)
    high = np.clip(np.ceil((y.max(axis=1) - origin) / raster.pitch), 0, raster.count[1]).astype(np.int64)
    return _spread(low, high)


def _spread(low: NDArray[np.int64], high: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Index of each range ``low <= i < high`` as often as it is long, and the numbers in it."""
    count = np.maximum(high - low, 0)
    index = np.repeat(np.arange(len(count)), count)
    return index, np.arange(len(index)) - np.repeat(np.cumsum(count) - count, count) + low[index]


def _chord(corners: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Where a row at `y` enters and leaves triangles, shape (k, 3, 3), along x."""
    start, end = np.full(len(y), np.inf), np.full(len(y), -np.inf)
    for first, second in ((0, 1), (1, 2), (2, 0)):
        a, b = corners[:, first], corners[:, second]
        # The same arithmetic for both triangles of an edge: no line is lost between them.
        swapped = a[:, 1] > b[:, 1]
        lower, upper = np.where(swapped[:, None], b, a), np.where(swapped[:, None], a, b)
        crosses = (lower[:, 1] <= y) & (y < upper[:, 1])
        rise = np.where(crosses, upper[:, 1] - lower[:, 1], 1.0)
        x = lower[:, 0] + (upper[:, 0] - lower[:, 0]) * (y - lower[:, 1]) / rise
        start, end = np.where(crosses, np.minimum(start, x), start), np.where(crosses, np.maximum(end, x), end)
    return start, end


def _along_z(direction: FloatArray) -> FloatArray:
    """Rotation, shape (3, 3), that turns a direction to z."""
    return np.asarray(Rotation.align_vectors([[0.0, 0.0, 1.0]], [direction])[0].as_matrix())
