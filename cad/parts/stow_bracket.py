"""A fold bracket in two: a deck that stays on the hull, and an arm with M1's cell that swings up on a hinge.

The arm's plates turn outside the deck's lugs on M4 screws. By hand, an M3 screw through one plate goes into one of two
inserts in the lug, for use and for stowing; with a servo, its horn is on the axis in place of one pivot. Solids are
made in the fold frame and returned in the body frame.
"""

from __future__ import annotations

from dataclasses import replace
from math import cos, pi, radians, sin

import numpy as np
from build123d import Axis, Location, Part, Plane, Solid
from scipy.spatial import ConvexHull

from cad.parts.bracket.bracket_placement import ROOF_CORNER_MM
from cad.parts.bracket.fold_bracket import cell_in_fold, closed_pockets, in_body, on_hull, pedestal
from cad.parts.flange import FLANGE_WIDTH_MM
from cad.parts.hardware import (
    Hardware,
    Thread,
    along,
    cap_screw,
    clearance_diameter_mm,
    counterbored_hole,
    insert_hole,
    screw_in_insert,
    screw_length_mm,
)
from cad.parts.mirrors import FIT_MM
from cad.parts.servo import (
    EAR_THICKNESS_MM,
    HORN_CENTRE_HOLE_DIAMETER_MM,
    HORN_HEIGHT_MM,
    HORN_SCREW,
    HORN_THICKNESS_MM,
    case_ends,
    ear_hole_positions,
    ear_levels,
    horn_screw_positions,
    horn_solid,
    servo_solid,
    shaft_screw,
)
from cad.parts.stow_hinge import BAR_MM, GAP_MM, LUG_RADIUS_MM, Point, StowHinge
from cad.shapes import Limits, along_y, box, cylinder, location_mm, single_solid
from optics.mesh import Group

RAMP_MM = 10.0
PIVOT: Thread = "M4"
PIVOT_HOLE_MM = 4.2
"""Of the arm's plates, which turn on the screws: closer than a clearance hole."""
LOCK: Thread = "M3"
LOCK_CIRCLE_MM = 9.5
HORN_GRIP_MM = 2.3
"""Wall between the heads of the horn's screws and the horn."""
HORN_ROOM_MM = 0.5


def deck_solid(hinge: StowHinge) -> Solid:
    """Flange, deck and lugs: what of the bracket stays on the hull; body frame, millimetres."""
    placement, y = hinge.placement, hinge.placement.y_mm
    tongue = hinge.lug_limits_mm[1]
    wide = max(FLANGE_WIDTH_MM / 2, tongue)
    levels = (placement.roof_low_mm, placement.roof_mm)
    plate = box(placement.pedestal_mm[0], (y - wide, y + wide), levels)
    plate = plate.fillet(ROOF_CORNER_MM, plate.edges().filter_by(Axis.Z))
    nose = box((placement.anchor_mm[0], hinge.stop_mm), (y - tongue, y + tongue), levels)
    parts = [plate, nose, _lug(hinge, _mirrored(y, hinge.lug_limits_mm)), pedestal(placement)]
    cuts = _pivot_cuts(hinge, -1)
    if hinge.servo:
        beside_case = max(hinge.lug_limits_mm[0], hinge.horn_mm - HORN_HEIGHT_MM + GAP_MM)
        parts += [_servo_lug(hinge), _rail(hinge, _shifted(y, (beside_case, hinge.lug_limits_mm[1])))]
        cuts += _servo_cuts(hinge)
    else:
        parts.append(_lug(hinge, _shifted(y, hinge.lug_limits_mm)))
        cuts += _pivot_cuts(hinge, 1) + _lock_cuts(hinge)
    return on_hull(
        placement,
        [single_solid(parts, "joints.stow, of the fold_bracket", "look at mount.fold_anchor_mm too").cut(*cuts)],
        "fold_bracket",
        closed_pockets(placement, placement.wall_mm),
    )


def arm_solid(hinge: StowHinge) -> Solid:
    """M1's cell between two plates that turn on the lugs, and the bar that stops them; body frame in use."""
    placement, y = hinge.placement, hinge.placement.y_mm
    bar_limits = (hinge.stop_mm, hinge.stop_mm + BAR_MM)
    outer = hinge.arm_mm[1]
    levels = (placement.roof_low_mm, placement.roof_mm)
    parts = [cell_in_fold(placement), box(bar_limits, (y - outer, y + outer), levels)]
    outline = _plate_outline(hinge, [(x, z) for x in bar_limits for z in levels])
    x, z = hinge.axis_mm
    cuts = []
    for side, limits in ((-1, _mirrored(y, hinge.arm_mm)), (1, _shifted(y, hinge.arm_mm))):
        disc = cylinder((x, limits[0], z), (x, limits[1], z), LUG_RADIUS_MM)
        parts.append(along_y(outline, limits) + disc)
        if side > 0 and hinge.servo:
            cuts += _horn_cuts(hinge)
        else:
            cuts.append(cylinder((x, limits[0] - 1, z), (x, limits[1] + 1, z), PIVOT_HOLE_MM / 2))
    if hinge.servo is None:
        place = _lock_place(hinge, 0.0)
        start, end = (place[0], y + hinge.arm_mm[0] - 1, place[1]), (place[0], y + hinge.arm_mm[1] + 1, place[1])
        cuts.append(cylinder(start, end, clearance_diameter_mm(LOCK) / 2))
    what, hint = "fold_mirror, of the fold_arm", "look at mount.wall_mm too"
    return in_body(placement, single_solid([Part() + single_solid(parts, what, hint).cut(*cuts)], what, hint))


def stow_servo_in_body(hinge: StowHinge) -> tuple[Solid, Solid]:
    """Servo, its shaft on the axis and its case towards the flange, and its horn; body frame in use."""
    assert hinge.servo is not None
    place = location_mm(hinge.placement.body_from_fold) * _servo_place(hinge)
    return place * servo_solid(hinge.servo), place * horn_solid(hinge.servo)


def hinge_hardware(hinge: StowHinge) -> tuple[list[Hardware], list[Hardware]]:
    """Bought pieces that stay with the deck, and those that swing with the arm; body frame in use."""
    y, (x, z) = hinge.placement.y_mm, hinge.axis_mm
    grip = hinge.arm_mm[1] - hinge.lug_limits_mm[1]
    room = hinge.lug_mm
    fixed: list[Hardware] = []
    swinging: list[Hardware] = []
    sides = {"right": -1} if hinge.servo else {"right": -1, "left": 1}
    for name, side in sides.items():
        seat = (x, y + side * hinge.arm_mm[1], z)
        screw, insert_ = screw_in_insert(f"stow_pivot_{name}", Group.FIXED, PIVOT, seat, (0, side, 0), grip, room)
        fixed += [screw, insert_]
    if hinge.servo:
        fixed += _ear_hardware(hinge)
        swinging += _horn_hardware(hinge)
    else:
        for name, angle in (("use", 0.0), ("stowed", hinge.max_deg)):
            u, w = _lock_place(hinge, angle)
            seat = (u, y + hinge.arm_mm[1], w)
            screw, insert_ = screw_in_insert(f"stow_lock_{name}", Group.FIXED, LOCK, seat, (0, 1, 0), grip, room)
            fixed.append(insert_)
            swinging += [screw] if name == "use" else []
    place = location_mm(hinge.placement.body_from_fold)
    return [_posed(piece, place) for piece in fixed], [_posed(piece, place) for piece in swinging]


def _posed(piece: Hardware, place: Location) -> Hardware:
    return replace(piece, pose=place * piece.pose)


def _shifted(y: float, limits: Limits) -> Limits:
    return y + limits[0], y + limits[1]


def _mirrored(y: float, limits: Limits) -> Limits:
    return y - limits[1], y - limits[0]


def _lug(hinge: StowHinge, limits: Limits) -> Part:
    """Rail from the flange to the front of the deck that rises to a round lug at the axis."""
    placement, (x, z) = hinge.placement, hinge.axis_mm
    foot, top = placement.roof_mm - placement.wall_mm / 2, placement.roof_mm + RAMP_MM
    start = placement.rear_mm + ROOF_CORNER_MM
    knee = (max(start + RAMP_MM, x - 2 * LUG_RADIUS_MM - 5), top)
    side = [(start, foot), (start + RAMP_MM, top), knee, hinge.on_lug(knee, side=1), (x, z)]
    toe = x + 0.7 * LUG_RADIUS_MM
    rail = along_y([*side, (toe, z), (toe, foot)], limits)
    return rail + cylinder((x, limits[0], z), (x, limits[1], z), LUG_RADIUS_MM)


def _rail(hinge: StowHinge, limits: Limits) -> Part:
    """Rail like a lug's, on the servo's side: it ends behind what turns."""
    placement = hinge.placement
    foot, top = placement.roof_mm - placement.wall_mm / 2, placement.roof_mm + RAMP_MM
    start, end = placement.rear_mm + ROOF_CORNER_MM, hinge.rear_mm - GAP_MM
    return along_y([(start, foot), (end, foot), (end - RAMP_MM, top), (start + RAMP_MM, top)], limits)


def _plate_outline(hinge: StowHinge, bar: list[Point]) -> list[Point]:
    """Outline of the arm's plates, as (x, z): the hull of the lug's circle, the cell's back and the bar.

    Nothing of it is in front of the cell's floor, where M1 is.
    """
    placement = hinge.placement
    # Half a wall into the cell's floor: solids that only touch do not become one.
    inset = placement.wall_mm / 2 / 2**0.5
    upper, lower = ((x - inset, z - inset) for x, z in (placement.upper_mm, placement.lower_mm))
    points = np.array(
        [
            upper,
            lower,
            placement.lower_mm,
            hinge.axis_mm,
            hinge.on_lug(upper, side=1),
            hinge.on_lug(lower, side=-1),
            *bar,
        ]
    )
    return _behind(upper, lower, [(float(x), float(z)) for x, z in points[ConvexHull(points).vertices]])


def _behind(upper: Point, lower: Point, outline: list[Point]) -> list[Point]:
    """What of a convex outline lies behind the line from an upper to a lower point (Sutherland and Hodgman 1974)."""
    along_line = np.subtract(upper, lower)
    normal = np.array([along_line[1], -along_line[0]])
    depths = [float(normal @ np.subtract(point, lower)) for point in outline]
    kept: list[Point] = []
    for number, (point, depth) in enumerate(zip(outline, depths, strict=True)):
        before, depth_before = outline[number - 1], depths[number - 1]
        if depth * depth_before < 0:
            share = depth_before / (depth_before - depth)
            kept.append((before[0] + share * (point[0] - before[0]), before[1] + share * (point[1] - before[1])))
        if depth >= 0:
            kept.append(point)
    return kept


def _pivot_cuts(hinge: StowHinge, side: int) -> list[Part]:
    x, z = hinge.axis_mm
    mouth = (x, hinge.placement.y_mm + side * hinge.lug_limits_mm[1], z)
    return [insert_hole(PIVOT, mouth, (0, -side, 0), hinge.lug_mm)]


def _lock_place(hinge: StowHinge, angle_deg: float) -> Point:
    """Where the locking screw is at a hinge angle; both places lie symmetrically behind the axis."""
    x, z = hinge.axis_mm
    angle = pi + radians(angle_deg - hinge.max_deg / 2)
    return x + LOCK_CIRCLE_MM * cos(angle), z + LOCK_CIRCLE_MM * sin(angle)


def _lock_cuts(hinge: StowHinge) -> list[Part]:
    mouth = hinge.placement.y_mm + hinge.lug_limits_mm[1]
    places = (_lock_place(hinge, angle) for angle in (0.0, hinge.max_deg))
    return [insert_hole(LOCK, (x, mouth, z), (0, -1, 0), hinge.lug_mm) for x, z in places]


def _servo_place(hinge: StowHinge) -> Location:
    x, z = hinge.axis_mm
    return Location(Plane(origin=(x, hinge.placement.y_mm + hinge.horn_mm, z), x_dir=(1, 0, 0), z_dir=(0, 1, 0)))


def _servo_lug(hinge: StowHinge) -> Part:
    """Upright plate between the ears of the servo and the arm."""
    placement, (x, z) = hinge.placement, hinge.axis_mm
    rear, front, half = hinge.servo_lug_ends_mm
    limits = _shifted(placement.y_mm, hinge.servo_lug_limits_mm)
    plate = box((x + rear, x + front), limits, (placement.roof_low_mm, z + half))
    corners = plate.edges().filter_by(Axis.Y).group_by(Axis.Z)[-1]
    return plate.fillet(3, corners)


def _servo_cuts(hinge: StowHinge) -> list[Part]:
    """Opening for the servo's case, which is pushed through from the middle, and holes for the ears' inserts."""
    assert hinge.servo is not None
    x, z = hinge.axis_mm
    far, near = case_ends(hinge.servo)
    half = hinge.servo.size_mm[1] / 2 + FIT_MM
    inner, outer = _shifted(hinge.placement.y_mm, hinge.servo_lug_limits_mm)
    opening = box((x + far - FIT_MM, x + near + FIT_MM), (inner - 1, outer + 1), (z - half, z + half))
    holes = [
        insert_hole(hinge.servo.ear_screw, (x + along_case, inner, z - across), (0, 1, 0), outer - inner)
        for along_case, across in ear_hole_positions(hinge.servo)
    ]
    return [opening, *holes]


def _ear_hardware(hinge: StowHinge) -> list[Hardware]:
    assert hinge.servo is not None
    x, z = hinge.axis_mm
    ears = hinge.placement.y_mm + hinge.horn_mm + ear_levels(hinge.servo)[0]
    inner, outer = hinge.servo_lug_limits_mm
    grip = EAR_THICKNESS_MM + FIT_MM
    return [
        piece
        for number, (along_case, across) in enumerate(ear_hole_positions(hinge.servo), start=1)
        for piece in screw_in_insert(
            f"stow_ear_{number}",
            Group.FIXED,
            hinge.servo.ear_screw,
            (x + along_case, ears, z - across),
            (0, -1, 0),
            grip,
            outer - inner,
        )
    ]


def _horn_cuts(hinge: StowHinge) -> list[Part]:
    (x, z), y = hinge.axis_mm, hinge.placement.y_mm
    inner, outer = _shifted(y, hinge.arm_mm)
    seat = inner + HORN_GRIP_MM
    cuts = [cylinder((x, inner - 1, z), (x, outer + 1, z), HORN_CENTRE_HOLE_DIAMETER_MM / 2)]
    for u, w in horn_screw_positions():
        place = (x + u, seat, z - w)
        cuts.append(counterbored_hole(HORN_SCREW, place, (0, 1, 0), outer - seat + 1, HORN_GRIP_MM + 1))
    return cuts


def _horn_hardware(hinge: StowHinge) -> list[Hardware]:
    assert hinge.servo is not None
    (x, z), y = hinge.axis_mm, hinge.placement.y_mm
    screw = cap_screw(HORN_SCREW, screw_length_mm(HORN_GRIP_MM + FIT_MM + HORN_THICKNESS_MM + HORN_ROOM_MM))
    seat = y + hinge.arm_mm[0] + HORN_GRIP_MM
    return [shaft_screw("stow_shaft_screw", Group.FIXED, hinge.servo, _servo_place(hinge))] + [
        Hardware(
            name=f"stow_horn_screw_{number}",
            group=Group.FIXED,
            piece=screw,
            pose=along((x + u, seat, z - w), (0, 1, 0)),
        )
        for number, (u, w) in enumerate(horn_screw_positions(), start=1)
    ]
