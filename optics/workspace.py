"""The gaze's workspace, figure 7 of the paper: which directions the joints reach at all.

This is the axis of the virtual camera, M2's face and the joints' limits alone; what mirrors and mount leave of the view
there is the matter of `optics.analysis`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from optics.arrays import FloatArray, check_points
from optics.layout import ROUNDING_DEG, Layout
from rigs import Joint

TURN = 2 * np.pi


def reached(layout: Layout, directions: ArrayLike) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Which directions, shape (n, 3), body frame, of any length, the optical axis reaches; shape (n,)."""
    x, y, z = layout.body_from_gimbal.rotation.inv().apply(check_points("directions", directions, 3)).T
    azimuth, elevation = np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))
    front = _reaches(layout.pan, azimuth) & _reaches(layout.tilt, elevation / 2)
    over = _reaches(layout.pan, azimuth + np.pi) & _reaches(layout.tilt, (np.pi - elevation) / 2)
    return np.asarray(front | over)


def workspace_fraction(layout: Layout) -> float:
    """Share of the sphere that the optical axis reaches, in closed form.

    Between two elevations at which the tilt begins or ends to reach over the front or over the zenith, the same
    azimuths are reached: the arc of the pan, the arc opposite, their union, or none. A zone of that width has the area
    ``width (sin e2 - sin e1)``. The attitude of the gimbal does not matter.
    """
    limits = np.radians([layout.tilt.min_deg, layout.tilt.max_deg])
    ends = [2 * layout.tilt.angle(q2) for q2 in limits]
    # The gaze's elevation is the arc sine of sin 2t, on either side of the zenith.
    edges = np.array(sorted({-np.pi / 2, np.pi / 2, *(float(np.arcsin(np.sin(end))) for end in ends)}))
    middles = (edges[:-1] + edges[1:]) / 2
    front = _reaches(layout.tilt, middles / 2)
    over = _reaches(layout.tilt, (np.pi - middles) / 2)
    arc = min(np.radians(layout.pan.max_deg - layout.pan.min_deg), TURN)
    # Two arcs of one length, half a turn apart, fill the circle together when each is half of it.
    width = np.where(front & over, min(2 * arc, TURN), np.where(front | over, arc, 0.0))
    return float((width * np.diff(np.sin(edges))).sum() / (2 * TURN))


def _reaches(joint: Joint, angle: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Whether some joint value within the limits has an optical angle, up to whole turns."""
    lowest, highest = np.radians([joint.min_deg - ROUNDING_DEG, joint.max_deg + ROUNDING_DEG])
    beyond_lowest = (joint.sign * (angle - np.radians(joint.offset_deg)) - lowest) % TURN
    return np.asarray(beyond_lowest <= highest - lowest)
