"""The way of the tilt servo's cable: along the yoke to the pan axis, over with slack, and down the base to the hull.

The cable leaves the tilt servo outside the yoke's arm, runs in a groove under the yoke's plate towards the pan axis and
is tied there. Its next tie is on the foot of the gimbal's base, towards the column; the length between the two must
reach at both ends of the pan range.
"""

from __future__ import annotations

from math import cos, hypot, radians, sqrt

import numpy as np
from build123d import Part

from cad.parts.gimbal_dimensions import PAN_BUSHING, GimbalDimensions
from cad.shapes import box

CABLE_MM = 4.0
"""Diameter of the cable that there is room for; servo cables are 3 to 4 mm wide."""
GROOVE_DEPTH_MM = 1.5
TIE_SLOT_MM = (1.8, 3.5)
"""For cable ties of 2.5 mm: thickness and width with room for the fingers' lack of aim."""
TIE_STEP_MM = 45.0
TIE_EDGE_MM = 5.0
PAN_STEPS = 181


def yoke_tie_mm(dimensions: GimbalDimensions) -> float:
    """Distance from the pan axis of the yoke's inner tie: outside the pan bushing, or where a narrow yoke has room."""
    return min(PAN_BUSHING.flange_mm / 2 + 6, dimensions.servo_arm_inner_mm - TIE_SLOT_MM[1])


def yoke_cable_cuts(dimensions: GimbalDimensions) -> list[Part]:
    """Groove in the underside of the yoke's plate, in the pan frame, with a pair of slots for a tie at each end."""
    d = dimensions
    inner, outer, bottom = yoke_tie_mm(d), d.servo_arm_outer_mm, d.yoke_bottom_mm
    half = CABLE_MM / 2
    cuts = [box((-half, half), (inner - TIE_EDGE_MM, outer + 1), (bottom - 1, bottom + GROOVE_DEPTH_MM))]
    ties = [inner, d.servo_arm_inner_mm - 2 * TIE_EDGE_MM]
    # On a narrow yoke the two ties are one.
    for y in ties if ties[1] - ties[0] > 2 * TIE_EDGE_MM else ties[:1]:
        for side in (-1, 1):
            x = side * (half + TIE_SLOT_MM[0])
            limits = (y - TIE_SLOT_MM[1] / 2, y + TIE_SLOT_MM[1] / 2)
            thickness = TIE_SLOT_MM[0] / 2
            cuts.append(box((x - thickness, x + thickness), limits, (bottom - 1, d.yoke_floor_mm + 1)))
    return cuts


def tie_slot(x: float, z: float, half_width: float, *, upright: bool) -> Part:
    """Slot for a tie across the base's beam or column, along y; upright along a column, level along a beam."""
    thickness, width = TIE_SLOT_MM[0] / 2, TIE_SLOT_MM[1] / 2
    dx, dz = (thickness, width) if upright else (width, thickness)
    return box((x - dx, x + dx), (-half_width - 1, half_width + 1), (z - dz, z + dz))


def free_cable_mm(dimensions: GimbalDimensions, base_tie_mm: float, pan_deg: tuple[float, float]) -> float:
    """Least length of cable between the yoke's tie and the base's, so that it reaches over the whole pan range.

    Parameters
    ----------
    dimensions : GimbalDimensions
        Of the gimbal.
    base_tie_mm : float
        Distance of the base's tie from the pan axis.
    pan_deg : tuple of two floats
        Range of the pan angle, degrees, counted from where the tilt servo is a quarter turn from the column.

    Returns
    -------
    float
        The largest distance between the ties, millimetres: by the law of cosines across the pan axis, and from the
        underside of the yoke down to the top of the foot.
    """
    yoke = yoke_tie_mm(dimensions)
    height = dimensions.yoke_bottom_mm - dimensions.foot_top_mm
    angles = np.linspace(*pan_deg, PAN_STEPS)
    level = [sqrt(yoke**2 + base_tie_mm**2 - 2 * yoke * base_tie_mm * cos(radians(90 - a))) for a in angles]
    return hypot(max(level), height)
