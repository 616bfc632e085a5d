"""The gimbal base: a flange under the hull, a slender column behind the gimbal and a foot with the pan servo.

It is made in the plane that holds the anchor and the pan axis: the base frame has the gimbal's origin, x away from the
anchor and z along the pan axis, and is turned into place at the end. The pan servo hangs in the foot, pushed in from
below; a bushing around its horn carries the yoke.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import atan2, degrees, hypot

import numpy as np
from build123d import Axis, Location, Part, Plane, Pos, Rot, Solid

from cad.parts.cable import TIE_EDGE_MM, TIE_STEP_MM, tie_slot
from cad.parts.flange import FLANGE_LENGTH_MM, Seat, base_seat, fastener_room, flange, flange_hardware, hull_side
from cad.parts.gimbal_dimensions import EAR_MARGIN_MM, PAN_BUSHING, FootDimensions, GimbalDimensions
from cad.parts.hardware import Hardware, along, flanged_bushing, insert_hole, screw_in_insert
from cad.parts.mirrors import FIT_MM
from cad.parts.servo import EAR_LENGTH_MM, EAR_THICKNESS_MM, HORN_HEIGHT_MM, case_ends, ear_hole_positions
from cad.shapes import along_x, along_y, box, carved, cylinder, filleted, location_mm, single_solid
from optics.layout import Layout
from optics.mesh import Group
from rigs import Rig

COLUMN_WIDTH_MM = 14.0
COLUMN_DEPTH_MM = 28.0
FOOT_HEIGHT_MM = 16.0
CORNER_MM = 10.0
"""Fillet between column and foot, where the base bends most, and cut of the corner outside it."""
HOUSING_WALL_MM = 3.0
"""Around the pan bushing; more where mount.wall_mm is."""
WEEP_DIAMETER_MM = 3.0
BOLT_HEAD_MM = 4.0
"""Height of an M4 cap screw's head (ISO 4762) under the flange."""


@dataclass(frozen=True, kw_only=True)
class BasePlacement:
    """Where the base stands: heading of its plane, and the anchor seen from the gimbal.

    Attributes
    ----------
    body_from_base : Location
        Pose of the base frame.
    reach_mm : float
        Horizontal distance from the anchor to the pan axis.
    height_mm : float
        Height of the anchor above the gimbal's origin.
    """

    body_from_base: Location
    reach_mm: float
    height_mm: float


def base_placement(dimensions: GimbalDimensions, layout: Layout) -> BasePlacement:
    """Placement of the base.

    Raises
    ------
    ValueError
        When the anchor puts column or flange into what yoke and mirror holder sweep, or below the gimbal's foot.
    """
    mount, pose = dimensions.mount, layout.body_from_gimbal
    x, y, height = 1000 * pose.inv().apply(np.array(mount.base_anchor_mm) / 1000)
    reach = hypot(x, y)
    needed, lowest = base_room_mm(dimensions, height)
    if reach < needed:
        towards = np.array([x, y]) / reach if reach > 0 else np.array([-1.0, 0.0])
        better = 1000 * pose.apply(np.array([*(needed * towards), height]) / 1000)
        raise ValueError(
            f"mount.base_anchor_mm = {mount.base_anchor_mm}: expected an anchor at least {needed:.1f} mm from the pan "
            f"axis, such as ({better[0]:.1f}, {better[1]:.1f}, {better[2]:g}), so that column and flange clear the "
            f"turning yoke by {mount.clearance_mm:g} mm; got {reach:.1f} mm"
        )
    if height < lowest:
        better = 1000 * pose.apply(np.array([x, y, lowest]) / 1000)
        raise ValueError(
            f"mount.base_anchor_mm = {mount.base_anchor_mm}: expected an anchor beyond the gimbal's foot, such as "
            f"({better[0]:.1f}, {better[1]:.1f}, {better[2]:.1f}); this one is {lowest - height:.1f} mm short of that"
        )
    turned = location_mm(pose) * Rot(0, 0, degrees(atan2(-y, -x)))
    return BasePlacement(body_from_base=turned, reach_mm=reach, height_mm=height)


def base_room_mm(dimensions: GimbalDimensions, height_mm: float) -> tuple[float, float]:
    """Where an anchor may be, so that column and flange clear what yoke and mirror holder sweep, and the foot.

    Parameters
    ----------
    dimensions : GimbalDimensions
    height_mm : float
        Height of the anchor above the gimbal's origin.

    Returns
    -------
    (float, float)
        Smallest distance of the anchor from the pan axis, and smallest height.
    """
    mount = dimensions.mount
    lowest_bolt = height_mm - mount.wall_mm - BOLT_HEAD_MM
    beside_yoke = lowest_bolt < dimensions.servo_arm_top_mm + mount.clearance_mm
    reach = mount.clearance_mm + max(
        dimensions.yoke_radius_mm + (FLANGE_LENGTH_MM if beside_yoke else COLUMN_DEPTH_MM) / 2,
        dimensions.holder_reach_mm + FLANGE_LENGTH_MM / 2,
    )
    return reach, dimensions.foot_top_mm + CORNER_MM + mount.wall_mm


def flange_seat(rig: Rig, placement: BasePlacement) -> Seat:
    """Seat of the base's flange, body frame, its x towards the pan axis; raises as `cad.parts.flange.base_seat`."""
    return base_seat(rig, tuple(Plane(placement.body_from_base).x_dir))


def gimbal_base_solid(dimensions: FootDimensions, placement: BasePlacement, seat: Seat) -> Solid:
    """Solid of the gimbal base in the body frame, millimetres."""
    d, what, hint = dimensions, "mount.base_anchor_mm, of the gimbal_base", "look at servos.pan too"
    parts = [_side_view(d, placement, seat), _flare(placement, seat), _servo_block(d), _housing(d)]
    cuts = [*_servo_opening(d), *_housing_cuts(d), *_tie_slots(d, placement, seat)]
    base = single_solid([*(placement.body_from_base * part for part in parts), flange(seat)], what, hint)
    cuts = [*(placement.body_from_base * cut for cut in cuts), fastener_room(seat), hull_side(seat)]
    return carved(base, cuts, what, hint)


def pan_servo_in_body(dimensions: GimbalDimensions, placement: BasePlacement, servo: Solid) -> Solid:
    """Pan servo in the body frame: shaft up on the pan axis, case towards the column."""
    return placement.body_from_base * Pos(0, 0, dimensions.pan_horn_mm) * servo


def base_hardware(dimensions: GimbalDimensions, placement: BasePlacement, seat: Seat) -> list[Hardware]:
    """Screws of the flange, screws and inserts of the pan servo's ears, and the pan bushing, in the body frame."""
    d = dimensions.foot
    ears = d.pan_ledge_mm - FIT_MM - EAR_THICKNESS_MM
    pieces: list[Hardware] = []
    servo, room, grip = d.servo, d.foot_top_mm - d.pan_ledge_mm, EAR_THICKNESS_MM + FIT_MM
    for number, (x, y) in enumerate(ear_hole_positions(servo), start=1):
        pieces += screw_in_insert(
            f"pan_ear_{number}", Group.FIXED, servo.ear_screw, (x, y, ears), (0, 0, -1), grip, min(room, grip + 2)
        )
    bushing = along((0, 0, d.pan_bushing_seat_mm), (0, 0, 1))
    pieces.append(Hardware(name="pan_bushing", group=Group.FIXED, piece=flanged_bushing(PAN_BUSHING), pose=bushing))
    placed = [replace(piece, pose=placement.body_from_base * piece.pose) for piece in pieces]
    return placed + flange_hardware(seat, "base")


def tie_on_beam_mm(dimensions: FootDimensions, placement: BasePlacement) -> float:
    """Distance from the pan axis of the cable's tie on the foot: half way between servo and column."""
    return (placement.reach_mm - COLUMN_DEPTH_MM / 2 - _servo_ends(dimensions)[0]) / 2


def _side_view(d: FootDimensions, placement: BasePlacement, seat: Seat) -> Part:
    """Column and foot as one L, rounded in its inner corner and cut at its outer one; the hull cuts its top."""
    end = placement.height_mm + _over_anchor(placement, seat)
    back, front = -placement.reach_mm - COLUMN_DEPTH_MM / 2, -placement.reach_mm + COLUMN_DEPTH_MM / 2
    top, bottom = d.foot_top_mm, _foot_bottom(d)
    joint = case_ends(d.servo)[0]
    outline = [
        (back, end),
        (back, bottom + CORNER_MM),
        (back + CORNER_MM, bottom),
        (joint, bottom),
        (joint, top),
        (front, top),
        (front, end),
    ]
    half = COLUMN_WIDTH_MM / 2
    beam = along_y(outline, (-half, half))
    corner = beam.edges().filter_by(Axis.Y).filter_by(lambda e: hypot(e.center().X - front, e.center().Z - top) < 1)
    beam = filleted(beam, corner, CORNER_MM, "mount.base_anchor_mm, between the base's column and foot")
    upright = beam.edges().filter_by(Axis.Z).filter_by(lambda edge: front + 1 > edge.center().X)
    return filleted(beam, upright, half / 2, "mount.base_anchor_mm, edges of the base's column")


def _foot_bottom(d: FootDimensions) -> float:
    """Underside of the foot: well below the ears and the heads of their screws."""
    return min(d.foot_top_mm - FOOT_HEIGHT_MM, d.pan_ledge_mm - FOOT_HEIGHT_MM / 2)


def _over_anchor(placement: BasePlacement, seat: Seat) -> float:
    """How far the hull's surface may lie beyond the anchor under the column, where it slopes or is curved."""
    column = np.array(tuple(Plane(placement.body_from_base).z_dir))
    along = float(seat.normal @ column)
    sine = hypot(*(seat.normal - along * column))
    beyond = COLUMN_DEPTH_MM * sine / max(abs(along), 0.1)
    # On a steep hull the column's corner must not come out beside what the hull takes under the flange.
    within = (seat.length_mm / 2 - COLUMN_DEPTH_MM / 2 * abs(along)) / max(sine, 1e-9)
    return float(seat.contact.range_mm[1] + min(beyond, within))


def _flare(placement: BasePlacement, seat: Seat) -> Part:
    """What leads the flange's load into the column."""
    x, top = -placement.reach_mm, placement.height_mm
    low = top - seat.height_mm
    thin, thick = COLUMN_WIDTH_MM / 2 - 1, COLUMN_WIDTH_MM / 2 + 4
    flare = [(-thin, low - 12), (thin, low - 12), (thick, low), (thick, top), (-thick, top), (-thick, low)]
    return along_x(flare, (x - COLUMN_DEPTH_MM / 2 + 4, x + COLUMN_DEPTH_MM / 2 - 4))


def _servo_ends(d: FootDimensions) -> tuple[float, float]:
    """Ends of the foot along x: a wall beyond the servo's ears."""
    far, near = case_ends(d.servo)
    margin = EAR_LENGTH_MM + max(EAR_MARGIN_MM, d.wall_mm)
    return far - margin, near + margin


def _servo_block(d: FootDimensions) -> Part:
    half = d.servo.size_mm[1] / 2 + FIT_MM + d.wall_mm
    block = box(_servo_ends(d), (-half, half), (_foot_bottom(d), d.foot_top_mm))
    return block.fillet(2, block.edges().filter_by(Axis.Z))


def _housing_radius(d: FootDimensions) -> float:
    return PAN_BUSHING.housing_radius_mm + max(HOUSING_WALL_MM, d.wall_mm)


def _housing(d: FootDimensions) -> Part:
    """Ring around the pan bushing, on the foot."""
    return cylinder((0, 0, d.pan_ledge_mm), (0, 0, d.pan_bushing_seat_mm), _housing_radius(d))


def _housing_cuts(d: FootDimensions) -> list[Part]:
    """Bore for the bushing, and weep holes under it on four sides; one of them leads out over the servo's case.

    So no air stays between the servo's case and the yoke's hub, however the vehicle pitches and rolls.
    """
    bore = cylinder((0, 0, d.foot_top_mm), (0, 0, d.pan_bushing_seat_mm + 1), PAN_BUSHING.housing_radius_mm)
    # A little into the floor: a cylinder that only touches it, and the insert holes that end there, leaves slivers.
    level, radius, reach = d.foot_top_mm + 0.4 * WEEP_DIAMETER_MM, WEEP_DIAMETER_MM / 2, _housing_radius(d) + 1
    across = cylinder((0, -reach, level), (0, reach, level), radius)
    lengthwise = cylinder((-reach, 0, level), (reach, 0, level), radius)
    return [bore, across, lengthwise]


def _servo_opening(d: FootDimensions) -> list[Part]:
    """Where the pan servo is pushed in from below until its ears meet the ledge, with holes for their inserts."""
    servo = d.servo
    far, near = case_ends(servo)
    half, bottom = servo.size_mm[1] / 2 + FIT_MM, _foot_bottom(d) - 1
    case_top = d.pan_horn_mm - HORN_HEIGHT_MM
    cuts = [
        box((far - FIT_MM, near + FIT_MM), (-half, half), (bottom, case_top + FIT_MM)),
        box((far - EAR_LENGTH_MM - FIT_MM, near + EAR_LENGTH_MM + FIT_MM), (-half, half), (bottom, d.pan_ledge_mm)),
    ]
    for x, y in ear_hole_positions(servo):
        cuts.append(insert_hole(servo.ear_screw, (x, y, d.pan_ledge_mm), (0, 0, 1), d.foot_top_mm - d.pan_ledge_mm))
    for x in {x for x, _ in ear_hole_positions(servo)}:
        # Air that gathers under an ear leaves through the foot's sides.
        level = d.pan_ledge_mm - FIT_MM - EAR_THICKNESS_MM - WEEP_DIAMETER_MM / 2
        side = PAN_BUSHING.flange_mm
        cuts.append(cylinder((x, -side, level), (x, side, level), WEEP_DIAMETER_MM / 2))
    return cuts


def _tie_slots(d: FootDimensions, placement: BasePlacement, seat: Seat) -> list[Part]:
    """Slots for the ties of the tilt servo's cable: one on the beam of the foot, then up the column."""
    half, back = COLUMN_WIDTH_MM / 2, -placement.reach_mm - COLUMN_DEPTH_MM / 2 + TIE_EDGE_MM
    low, high = d.foot_top_mm + CORNER_MM, placement.height_mm - seat.height_mm - 2 * CORNER_MM
    slots = [tie_slot(-tie_on_beam_mm(d, placement), d.foot_top_mm - TIE_EDGE_MM, half, upright=False)]
    levels = np.arange(low, high, TIE_STEP_MM)
    return slots + [tie_slot(back, float(level), half, upright=True) for level in levels]
