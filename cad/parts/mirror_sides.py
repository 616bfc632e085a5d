"""How small a mirror may be for its cell: asked for sizes as well, which need no solids."""

from __future__ import annotations

from rigs.gaze import FlatMirror

BOND_HOLE_DIAMETER_MM = 8.0
SMALLEST_SIDE_MM = 2 * (BOND_HOLE_DIAMETER_MM + 2.0)
"""Of a plate: its bonding holes are half a side apart, and 2 mm of floor stay between them."""
SMALLEST_CUT_SIDE_MM = 30.0
"""Of a plate without corners: below, the bonding holes come out from under it."""


def smallest_side_mm(mirror: FlatMirror) -> float:
    """Least width and height of a mirror whose cell can be made."""
    return SMALLEST_SIDE_MM if mirror.outline == "rectangle" else SMALLEST_CUT_SIDE_MM
