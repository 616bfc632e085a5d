"""Kernel: what the robot keeps from a line of sight through the water, between the nodes of a table."""

from __future__ import annotations

from typing import Any

import numpy as np

from optics.backend import Float32, UInt32, dr
from scenes.packing import between
from scenes.powers import decay

AZIMUTHS, ELEVATIONS = 48, 25
"""Nodes by direction: azimuths all around, elevations from pole to pole."""

LENGTHS = 7
LENGTH_SCALE_M = 0.8
"""Nodes by length, evenly in ``1 - exp(-r / LENGTH_SCALE_M)``; the last stands for any length."""

ROW = 8
"""Three channels at a node, and at the next length."""


def kept_from_water(table: Any, eye: Any, direction: Any, length: Any) -> list[Any]:
    """Kernel: share by channel of open water's radiance that is missing in a line of sight.

    `eye` counts the places where lines begin, `direction` is in the body frame.
    """
    turn = dr.atan2(direction.y, direction.x) * (AZIMUTHS / (2 * np.pi))
    turn = dr.select(turn < 0, turn + AZIMUTHS, turn)
    rise = (dr.safe_asin(direction.z) / np.pi + 0.5) * (ELEVATIONS - 1)
    reach = (1 - decay(length / LENGTH_SCALE_M)) * (LENGTHS - 1)
    column = dr.minimum(UInt32(turn), AZIMUTHS - 1)
    line = dr.minimum(UInt32(rise), ELEVATIONS - 2)
    node = dr.minimum(UInt32(reach), LENGTHS - 2)
    next_column = dr.select(column == AZIMUTHS - 1, 0, column + 1)
    across, up, along = turn - Float32(column), rise - Float32(line), reach - Float32(node)
    total = [Float32(0)] * 3
    for step in (0, 1):
        for beside, share in ((column, 1 - across), (next_column, across)):
            place = (eye * ELEVATIONS + line + step) * AZIMUTHS + beside
            values = between(table, place * LENGTHS + node, along, ROW)
            weight = share * (up if step else 1 - up)
            total = [dr.fma(v, weight, t) for v, t in zip(values[:3], total, strict=True)]
    return total
