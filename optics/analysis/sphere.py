"""A sphere of directions in cells of equal solid angle: the cylindrical equal-area map (Lambert 1772).

Columns are equal steps of azimuth from -pi (behind) over 0 (the body's x) and pi/2 (left) to pi; rows are equal steps
of the sine of the elevation from -1 (nadir) to 1 (zenith). A direction belongs to the cell it lies in.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from optics.arrays import FloatArray
from optics.backend import Float32, Int32, UInt32, dr


def cell_of(direction: Any, columns: Any, rows: Any) -> Any:
    """Kernel: number of the cell, row by row, of unit vectors in the body frame."""
    azimuth = dr.atan2(Float32(direction.y), Float32(direction.x))
    column = Int32(dr.floor((azimuth / dr.two_pi + 0.5) * Float32(columns)))
    row = Int32(dr.floor((Float32(direction.z) + 1) * 0.5 * Float32(rows)))
    # Rounding may put the last azimuth and the zenith one cell too far.
    column = dr.clip(column, 0, Int32(columns) - 1)
    row = dr.clip(row, 0, Int32(rows) - 1)
    return UInt32(row) * UInt32(columns) + UInt32(column)


def cell_centres(columns: int, rows: int) -> tuple[FloatArray, FloatArray]:
    """Azimuths of the columns and elevations of the rows, radians, at the cells' centres."""
    azimuth = ((np.arange(columns) + 0.5) / columns - 0.5) * 2 * np.pi
    elevation = np.arcsin((np.arange(rows) + 0.5) / rows * 2 - 1)
    return azimuth, elevation


def cell_solid_angle_sr(columns: int, rows: int) -> float:
    """Solid angle of each cell."""
    return 4 * np.pi / (columns * rows)
