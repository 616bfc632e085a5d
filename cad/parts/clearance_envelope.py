"""Whether a gimbal's clearance envelope is clear of its hull: quick enough to be asked for thousands of designs.

Yoke and tilt servo turn within a cylinder about the pan axis, the mirror holder within a sphere about the crossing of
the axes. Both are taken whole, whatever the joint ranges: on the safe side of the checks on the solids themselves.
"""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from cad.parts.gimbal_base import base_placement
from cad.parts.gimbal_dimensions import GimbalDimensions
from optics.layout import Layout
from rigs import Rig

SEGMENTS = 64
"""Of cylinder and sphere: their chords lie 0.1 mm inside an arc of 100 mm, the tolerance of the checks on solids."""

ANCHOR_STEPS, ANCHOR_STEP_MM = 400, 0.5
"""How far a base anchor may be moved along the hull, 200 mm, and how finely."""

LARGEST_ANCHOR_GAP_MM = 1.0
"""An anchor further from the hull than this has left it; the checks on solids say the same."""

ON_HULL = "mount.base_anchor_mm on the hull"
STANDING = "mount.base_anchor_mm where the gimbal's base can stand"
YOKE_ENVELOPE = "room to turn: yoke and tilt servo clear of the hull"
HOLDER_ENVELOPE = "room to turn: mirror holder clear of the hull"

LARGEST_MARGIN_MM = 5.0
"""A larger margin than this is not measured: near misses are what is asked for, and looking further takes ten times as
long."""


def envelope_margins_mm(rig: Rig, hull: Manifold) -> dict[str, float]:
    """Margin of each condition on the clearance envelope beside the hull, negative where it is violated.

    Parameters
    ----------
    rig : Rig
        With mirrors.
    hull : Manifold
        Closed surface of the hull, body frame, millimetres (`cad.overlaps.manifold_mm`).

    Returns
    -------
    dict of str to float
        Millimetres beyond the clearance that the mount asks for, at most `LARGEST_MARGIN_MM`; how deep something goes
        into the hull is not told: the margin is then minus the clearance.
    """
    gaze = rig.require_gaze()
    dimensions, clearance = GimbalDimensions.from_rig(rig), gaze.mount.clearance_mm
    pose = Layout.from_rig(rig).body_from_gimbal.as_matrix()[:3]
    pose[:, 3] *= 1000
    try:
        anchor = with_standing_base(rig).require_gaze().mount
    except ValueError:
        anchor = None
    bottom = dimensions.yoke_bottom_mm
    yoke = Manifold.cylinder(dimensions.servo_arm_top_mm - bottom, dimensions.yoke_radius_mm, -1, SEGMENTS)
    holder = Manifold.sphere(dimensions.holder_reach_mm, SEGMENTS)
    reach = clearance + LARGEST_MARGIN_MM
    margins = {
        YOKE_ENVELOPE: yoke.translate((0, 0, bottom)).transform(pose).min_gap(hull, reach) - clearance,
        HOLDER_ENVELOPE: holder.transform(pose).min_gap(hull, reach) - clearance,
        STANDING: LARGEST_MARGIN_MM if anchor is not None else -LARGEST_MARGIN_MM,
    }
    if anchor is not None:
        point = Manifold.sphere(ANCHOR_STEP_MM / 2, 8).translate(anchor.base_anchor_mm)
        gap = point.min_gap(hull, LARGEST_MARGIN_MM)
        margins[ON_HULL] = LARGEST_MARGIN_MM if gap < LARGEST_ANCHOR_GAP_MM else -gap
    return margins


def with_standing_base(rig: Rig) -> Rig:
    """The rig with its base anchor moved as little as lets the gimbal's base stand.

    An anchor too near the pan axis moves straight away from it, any other stays.

    Raises
    ------
    ValueError
        When the base cannot stand anywhere on that line; the message names the key to change.
    """
    mount, layout = rig.require_gaze().mount, Layout.from_rig(rig)
    anchor = np.array(mount.base_anchor_mm)
    turn = layout.body_from_gimbal.rotation
    away = turn.apply(turn.inv().apply(anchor - 1000 * layout.body_from_gimbal.translation) * [1, 1, 0])
    length = np.linalg.norm(away)
    away = away / length if length > 0 else turn.apply([-1.0, 0.0, 0.0])

    def moved(step: int) -> Rig:
        x, y, z = np.round(anchor + step * ANCHOR_STEP_MM * away, 1).tolist()
        return rig.with_gaze(mount={"base_anchor_mm": (x, y, z)})

    refused = _refusal(rig, layout)
    if refused is None:
        return rig
    if _refusal(moved(ANCHOR_STEPS), layout) is not None:
        raise refused
    # What stands at a distance stands further away too.
    near, far = 0, ANCHOR_STEPS
    while far - near > 1:
        middle = (near + far) // 2
        near, far = (near, middle) if _refusal(moved(middle), layout) is None else (middle, far)
    return moved(far)


def _refusal(rig: Rig, layout: Layout) -> ValueError | None:
    """Why the gimbal's base cannot stand at its anchor."""
    try:
        base_placement(GimbalDimensions.from_rig(rig), layout)
    except ValueError as error:
        # Its frames would keep what the callers hold, in a circle with the error itself.
        return error.with_traceback(None)
    return None
