"""Places all over triangles, as dense as asked for: what stands for a surface where distances are looked up."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray

Faces = NDArray[np.int64]


def lattice(vertices: FloatArray, faces: Faces, spacing: float) -> tuple[FloatArray, Faces]:
    """Places on triangles in rows along each one's longest side, corners included.

    Neighbours in a row and neighbouring rows are no further apart than the spacing, so that no place of a triangle is
    further from the lattice than spacing / sqrt(2).

    Returns
    -------
    places : array, shape (n, 3)
    owners : array, shape (n,)
        Whose triangle's they are.
    """
    corners = vertices[faces]
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    order = (sides.argmax(axis=1)[:, np.newaxis] + np.arange(3)) % 3
    a, b, tip = np.moveaxis(np.take_along_axis(corners, order[:, :, np.newaxis], axis=1), 1, 0)
    longest = sides.max(axis=1)
    height = np.linalg.norm(np.cross(b - a, tip - a), axis=1) / np.where(longest > 0, longest, 1)
    rows = np.ceil(height / spacing).astype(np.int64).clip(1)
    triangle, number = _repeated(rows + 1)
    up = number / rows[triangle]
    steps = np.ceil(longest[triangle] * (1 - up) / spacing).astype(np.int64)
    row, number = _repeated(steps + 1)
    along, up, triangle = number / steps.clip(1)[row], up[row], triangle[row]
    shares = np.stack([(1 - up) * (1 - along), (1 - up) * along, up])[:, :, np.newaxis]
    return shares[0] * a[triangle] + shares[1] * b[triangle] + shares[2] * tip[triangle], triangle


def _repeated(counts: Faces) -> tuple[Faces, Faces]:
    """Each position as often as counted, and which of its repetitions that is."""
    owners = np.repeat(np.arange(len(counts)), counts)
    return owners, np.arange(len(owners)) - np.repeat(np.cumsum(counts) - counts, counts)
