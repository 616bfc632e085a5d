"""Kernel: what the robot keeps from a line of sight through the water, between the nodes of a table."""

from __future__ import annotations

from typing import Any

import numpy as np

from optics.backend import Float32, UInt32, dr
from scenes.packing import row_of

AZIMUTHS, ELEVATIONS = 48, 25
"""Nodes by direction: azimuths all around, elevations from pole to pole."""

LENGTHS = 7
LENGTH_SCALE_M = 0.8
"""Nodes by length, evenly in ``1 - exp(-r / LENGTH_SCALE_M)``; the last stands for any length."""

ROW = 4


def kept_from_water(table: Any, eye: Any, direction: Any, length: Any) -> list[Any]:
    """Kernel: share by channel of open water's radiance that is missing in a line of sight.

    `eye` counts the places where lines begin, `direction` is in the body frame.
    """
    turn = dr.atan2(direction.y, direction.x) * (AZIMUTHS / (2 * np.pi))
    turn = dr.select(turn < 0, turn + AZIMUTHS, turn)
    rise = (dr.safe_asin(direction.z) / np.pi + 0.5) * (ELEVATIONS - 1)
    reach = (1 - dr.exp(-length / LENGTH_SCALE_M)) * (LENGTHS - 1)
    column = dr.minimum(UInt32(turn), AZIMUTHS - 1)
    line = dr.minimum(UInt32(rise), ELEVATIONS - 2)
    node = dr.minimum(UInt32(reach), LENGTHS - 2)
    next_column = dr.select(column == AZIMUTHS - 1, 0, column + 1)
    shares = (turn - Float32(column), rise - Float32(line), reach - Float32(node))
    total = [Float32(0)] * 3
    for across, up, along in np.ndindex(2, 2, 2):
        place = (eye * ELEVATIONS + line + up) * AZIMUTHS + (next_column if across else column)
        values = row_of(table, place * LENGTHS + node + along, ROW)
        weight = Float32(1)
        for step, share in zip((across, up, along), shares, strict=True):
            weight = weight * (share if step else 1 - share)
        total = [dr.fma(v, weight, t) for v, t in zip(values[:3], total, strict=True)]
    return total
