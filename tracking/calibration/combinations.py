"""Combinations of parameters that data say nothing of: a basis that can be read, and its words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import qr

from optics.kernels.arrays import FloatArray


def sparse_basis(rows: FloatArray) -> FloatArray:
    """Other combinations that span the same, each with 1 at a parameter of its own that the others lack.

    Parameters
    ----------
    rows : array, shape (j, k)
        Independent combinations; j may be 0.
    """
    if not len(rows):
        return rows
    own = qr(rows, mode="r", pivoting=True)[1][: len(rows)]
    return np.asarray(np.linalg.solve(rows[:, own], rows))


def in_words(
    row: FloatArray, names: Sequence[str], units: Sequence[str], per_unit: FloatArray, *, least_share: float
) -> str:
    """A combination in words: its largest parameter alone, or by how much the others change with one unit of it.

    Parameters
    ----------
    row : array, shape (k,)
    names, units : sequences of str, length k
    per_unit : array, shape (k,)
        What 1 in the row is of each parameter in its unit.
    least_share : float
        Of the largest part, below which a parameter is left out.
    """
    leader = int(np.argmax(np.abs(row)))
    parts = [i for i in np.argsort(-np.abs(row)).tolist() if abs(row[i]) > least_share * abs(row[leader])]
    if len(parts) == 1:
        return names[leader]
    shown = per_unit * row
    shown = shown / shown[leader]
    return ", ".join(f"{names[i]} {shown[i]:+.3g} {units[i]}".rstrip() for i in parts)
