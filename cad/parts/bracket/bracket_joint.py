"""A fold bracket that is longer than the printer's bed, in two halves: end plates, a V-key between them, four screws.

The plane of the joint is x = const of the fold frame, in the girders. Each half ends there in a plate between the webs,
as deep as they are; the rear one takes the inserts and the key's groove, the front one the heads, whose keys then come
between girders that open towards M1. As printed, on the roof, all faces of the joint are upright, and the key begins
with a slope of 45 degrees.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from build123d import Part, Plane, Solid

from cad.parts.bracket.bracket_placement import BRACE_MM, BracketPlacement
from cad.parts.hardware import (
    COUNTERBORE_ROOM_MM,
    Hardware,
    Thread,
    clearance_diameter_mm,
    head_diameter_mm,
    insert,
    insert_hole,
    screw_in_insert,
)
from cad.parts.mirrors import tray_foot_mm
from cad.shapes import Limits, along_z, box, cylinder, location_mm, one_solid, prism
from optics.kernels.arrays import FloatArray
from optics.mesh import Group

REAR, FRONT = "fold_bracket_rear", "fold_bracket_front"
JOINT = "fold_joint"
THREAD: Thread = "M4"
REAR_PLATE_MM = 10.0
"""An insert of 4 mm, the room for what it pushes ahead, and a wall behind."""
FRONT_PLATE_MM = 8.0
KEY_MM = 3.0
"""How far the key stands out of the front plate."""
KEY_WIDTHS_MM = (10.0, 6.0)
"""At its foot and at its tip."""
FIT_MM = 0.2
"""Between key and groove, all around: what two printed faces may be off."""
APART_MM = 0.5
"""Between what is beside each other in a plate: heads and webs, bosses and groove."""
HEX_KEY_MM = 70.0
"""Of a hexagon key, in front of the heads."""
SUNK_MM = 0.3
"""How far the inserts end below their plate's face, so that plate meets plate."""
FAR_MM = 1000.0


@dataclass(frozen=True, kw_only=True)
class BracketJoint:
    """Where a bracket is parted, in the fold frame.

    Attributes
    ----------
    placement : BracketPlacement
        Of the whole bracket.
    x_mm : float
        Plane of the joint.
    key_y_mm : float
        Middle of the key.
    screws_mm : array, shape (4, 2)
        Axes of the screws, as (y, z).
    """

    placement: BracketPlacement
    x_mm: float
    key_y_mm: float
    screws_mm: FloatArray

    @property
    def levels_mm(self) -> Limits:
        """Lower and upper end of the plates."""
        return self.placement.roof_mm - self.placement.girder_mm, self.placement.roof_mm

    @property
    def sides_mm(self) -> Limits:
        """Ends of the plates along y, where they meet."""
        return girder_sides_mm(self.placement, self.x_mm)


def girder_sides_mm(placement: BracketPlacement, x_mm: float) -> Limits:
    """Outer faces of both girders between pedestal and cell, at an x of the fold frame."""
    _, sides = placement.pedestal_mm
    start = placement.girders_from_mm
    share = (x_mm - start) / (placement.upper_mm[0] - start)
    ends = (placement.y_mm - placement.tray_half_width_mm, placement.y_mm + placement.tray_half_width_mm)
    low, high = (side + share * (end - side) for side, end in zip(sides, ends, strict=True))
    return low, high


def bracket_joint(placement: BracketPlacement) -> BracketJoint | None:
    """Joint nearest to the middle of a bracket's length; None where its girders have no room for one."""
    upper, front = placement.upper_mm[0], placement.pedestal_mm[0][1]
    # All of the cell belongs to the front half: its lip is behind its back's upper corner, below.
    lip, _ = placement.in_side_view(tray_foot_mm(placement.mirror), placement.cell_wall_mm)
    low, high = front + REAR_PLATE_MM, min(upper - FRONT_PLATE_MM, lip) - APART_MM
    if low > high:
        return None
    x = float(np.clip((placement.rear_mm + max(placement.lower_mm[0], placement.roof_front_mm)) / 2, low, high))
    boss, head = insert(THREAD).boss_radius_mm, head_diameter_mm(THREAD) / 2
    # Bosses within the rear plate; heads and their keys between the webs, along their whole way.
    behind = girder_sides_mm(placement, x - REAR_PLATE_MM)
    ahead = np.array([girder_sides_mm(placement, x + way) for way in (FRONT_PLATE_MM, min(HEX_KEY_MM, upper - x))])
    beside = placement.web_mm + APART_MM + head
    low_y = max(behind[0] + boss, float(ahead[:, 0].max()) + beside)
    high_y = min(behind[1] - boss, float(ahead[:, 1].min()) - beside)
    screws = _screws_mm(placement, (low_y, high_y))
    return (
        None
        if screws is None
        else BracketJoint(placement=placement, x_mm=x, key_y_mm=(low_y + high_y) / 2, screws_mm=screws)
    )


def halves(joint: BracketJoint, whole: Solid) -> tuple[Solid, Solid]:
    """Rear and front half of a bracket, from its solid; all in the body frame, millimetres."""
    x = joint.x_mm
    rear, front = (_within(joint, whole, limits) for limits in ((x - FAR_MM, x), (x, x + FAR_MM)))
    behind, ahead = _plate(joint, -REAR_PLATE_MM), _plate(joint, FRONT_PLATE_MM)
    groove, radius = _key(joint, FIT_MM), clearance_diameter_mm(THREAD) / 2
    inserts = [insert_hole(THREAD, (x, y, z), (-1, 0, 0), REAR_PLATE_MM) for y, z in joint.screws_mm]
    holes = [cylinder((x - 1, y, z), (x + FRONT_PLATE_MM + 1, y, z), radius) for y, z in joint.screws_mm]
    place = location_mm(joint.placement.body_from_fold)
    hint = "look at mount.fold_anchor_mm and mount.printer_bed_mm"
    for half, name in ((rear, REAR), (front, FRONT)):
        if not half.solids():
            raise ValueError(
                f"{name}: expected a bracket that reaches behind and ahead of its joint, got nothing; {hint}"
            )
    return (
        one_solid((rear + place * behind).cut(*(place * cut for cut in (groove, *inserts))), REAR, hint),
        one_solid((front + place * (ahead + _key(joint, 0.0))).cut(*(place * hole for hole in holes)), FRONT, hint),
    )


def joint_hardware(joint: BracketJoint) -> list[Hardware]:
    """Screws and inserts of the joint, in the fold frame."""
    return [
        piece
        for number, (y, z) in enumerate(joint.screws_mm, start=1)
        for piece in screw_in_insert(
            f"{JOINT}_{number}",
            Group.FIXED,
            THREAD,
            (joint.x_mm + FRONT_PLATE_MM, y, z),
            (1, 0, 0),
            FRONT_PLATE_MM + SUNK_MM,
            REAR_PLATE_MM - SUNK_MM,
        )
    ]


def _screws_mm(placement: BracketPlacement, outermost: Limits) -> FloatArray | None:
    """Four screws under the braces, two a side: in the outermost column where they fit into one, else in a row."""
    boss, head = insert(THREAD).boss_radius_mm, head_diameter_mm(THREAD) / 2
    high, low = (
        placement.roof_mm - BRACE_MM - COUNTERBORE_ROOM_MM - head,
        placement.roof_mm - placement.girder_mm + boss,
    )
    deep = high - low >= 2 * boss
    levels = (low, high) if deep else ((low + high) / 2,)
    middle, furthest = (outermost[0] + outermost[1]) / 2, (outermost[1] - outermost[0]) / 2
    columns = (furthest,) if deep else (furthest, furthest - 2 * boss)
    if high < low or columns[-1] < KEY_WIDTHS_MM[0] / 2 + FIT_MM + APART_MM + boss:
        return None
    return np.array([(middle + side * y, z) for side in (-1, 1) for y in columns for z in levels])


def _within(joint: BracketJoint, whole: Solid, limits: Limits) -> Part:
    space = box(limits, (-FAR_MM, FAR_MM), (-FAR_MM, FAR_MM))
    return Part([whole]) & (location_mm(joint.placement.body_from_fold) * space)


def _plate(joint: BracketJoint, thickness_mm: float) -> Part:
    """End plate from the plane of the joint, forwards or, with a negative thickness, backwards."""
    near, far = sorted((joint.x_mm, joint.x_mm + thickness_mm))
    (a, b), (c, d) = girder_sides_mm(joint.placement, near), girder_sides_mm(joint.placement, far)
    return along_z([(near, a), (far, c), (far, d), (near, b)], joint.levels_mm)


def _key(joint: BracketJoint, larger_mm: float) -> Part:
    """V-key on the front plate, or with `larger_mm` all around its groove in the rear one, open away from the roof."""
    x, y = joint.x_mm, joint.key_y_mm
    foot, tip = (width / 2 for width in KEY_WIDTHS_MM)
    lean = (foot - tip) / KEY_MM
    # The flanks move out along their normals, the tip along x.
    beside, depth = larger_mm * np.hypot(1, lean), KEY_MM + larger_mm
    foot, tip = foot + beside, foot + beside - lean * depth
    low, high = joint.levels_mm[0], joint.placement.roof_low_mm + larger_mm * 2**0.5
    low -= 1.0 if larger_mm else 0.0
    upright = along_z([(x, y - foot), (x, y + foot), (x - depth, y + tip), (x - depth, y - tip)], (low, high))
    plane = Plane(origin=(0, 0, 0), x_dir=(1, 0, 0), z_dir=(0, -1, 0))
    slope = prism(
        [(x, high), (x - depth, high - depth), (x - depth, high + 1), (x, high + 1)], plane, (-FAR_MM, FAR_MM)
    )
    return upright - slope
