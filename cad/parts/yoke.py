"""The yoke: a U on the pan servo's horn whose arms carry the tilt servo and the pivot.

It is made in the pan frame: x where the gaze looks at zero tilt, y the tilt axis, z the pan axis. Its hub turns in the
bushing of the pan axis and holds the horn; its arms grow out of the plate with fillets, where their bending is largest.
"""

from __future__ import annotations

from build123d import Axis, Location, Part, Pos, Rot, Solid

from cad.parts.cable import yoke_cable_cuts
from cad.parts.gimbal_dimensions import (
    PAN_BUSHING,
    PIVOT_BUSHING,
    PIVOT_RADIUS_MM,
    PIVOT_WASHER_RADIUS_MM,
    GimbalDimensions,
)
from cad.parts.hardware import (
    Hardware,
    along,
    cap_screw,
    counterbored_hole,
    flanged_bushing,
    insert_hole,
    screw_in_insert,
    screw_length_mm,
)
from cad.parts.mirrors import FIT_MM
from cad.parts.servo import (
    EAR_THICKNESS_MM,
    HORN_CENTRE_HOLE_DIAMETER_MM,
    HORN_DIAMETER_MM,
    HORN_SCREW,
    HORN_SCREW_CIRCLE_MM,
    HORN_THICKNESS_MM,
    case_ends,
    ear_hole_positions,
    ear_levels,
    horn_screw_positions,
    horn_solid,
    shaft_screw,
)
from cad.shapes import along_x, along_y, box, carved, cylinder, filleted, single_solid
from optics.mesh import Group

OUTER_CHAMFER_MM = 6.0
ROOT_FILLET_MM = 6.0
"""Where the arms leave the plate."""
HUB_GRIP_MM = 3.3
"""Floor of the hub's well, between the heads of the horn's screws and the horn."""
HORN_ROOM_MM = 0.5
WELL_RADIUS_MM = 9.5
"""Room for the heads of the horn's screws and a key on them."""
VENT_DIAMETER_MM = 3.0
VENT_RADIUS_MM = HORN_DIAMETER_MM / 2 + FIT_MM
"""From the pan axis to the vents, which are half beside the horn."""


def yoke_solid(dimensions: GimbalDimensions) -> Solid:
    """Solid of the yoke in the pan frame, millimetres."""
    d = dimensions
    what, hint = "gaze_mirror, of the yoke", "look at servos.tilt and mount.wall_mm too"
    body = single_solid([_frame(d), *_hub(d), *_pivot_boss(d)], what, hint)
    cuts = [*_taper(d), *_servo_opening(d), *_hub_cuts(d), *_pivot_cuts(d), *yoke_cable_cuts(d)]
    return carved(body, cuts, what, hint)


def tilt_servo_in_pan(dimensions: GimbalDimensions, servo: Solid) -> Solid:
    """Tilt servo in the pan frame: shaft along the tilt axis towards the mirror, case hanging down."""
    return Pos(0, dimensions.tilt_horn_mm, 0) * Rot(90, 0, 0) * Rot(0, 0, 90) * servo


def pan_horn_in_pan(dimensions: GimbalDimensions) -> Solid:
    """Pan servo's horn in the pan frame, in the pocket of the yoke's hub."""
    return Pos(0, 0, dimensions.pan_horn_mm) * horn_solid(dimensions.servos.pan)


def yoke_hardware(dimensions: GimbalDimensions) -> list[Hardware]:
    """Screws of the pan servo's horn and shaft, screws and inserts of the tilt servo's ears, the pivot's bushing."""
    d = dimensions
    screw = cap_screw(HORN_SCREW, screw_length_mm(HUB_GRIP_MM + FIT_MM + HORN_THICKNESS_MM + HORN_ROOM_MM))
    seat = _well_floor(d)
    pieces = [shaft_screw("pan_shaft_screw", Group.PAN, d.servos.pan, Location((0, 0, d.pan_horn_mm)))]
    pieces += [
        Hardware(name=f"pan_horn_screw_{number}", group=Group.PAN, piece=screw, pose=along((*place, seat), (0, 0, 1)))
        for number, place in enumerate(horn_screw_positions(), start=1)
    ]
    servo = d.servos.tilt
    outside = d.tilt_horn_mm - ear_levels(servo)[0]
    room = d.servo_arm_outer_mm - d.servo_arm_inner_mm
    for number, (z, x) in enumerate(ear_hole_positions(servo), start=1):
        name, head = f"tilt_ear_{number}", (x, outside, z)
        pieces += screw_in_insert(name, Group.PAN, servo.ear_screw, head, (0, 1, 0), EAR_THICKNESS_MM + FIT_MM, room)
    bushing = along((0, -d.pivot_inner_mm, 0), (0, 1, 0))
    return [
        *pieces,
        Hardware(name="pivot_bushing", group=Group.PAN, piece=flanged_bushing(PIVOT_BUSHING), pose=bushing),
    ]


def _frame(d: GimbalDimensions) -> Part:
    """The U, with fillets inside and its outer lower corners cut so that no hand or weed catches on them."""
    left, right, half = d.servo_arm_outer_mm, -d.pivot_outer_mm, d.arm_half_width_mm
    inner_left, inner_right = d.servo_arm_inner_mm, -d.pivot_inner_mm
    bottom, floor = d.yoke_bottom_mm, d.yoke_floor_mm
    cut = min(OUTER_CHAMFER_MM, d.arm_thickness_mm - 1)
    outline = [
        (left - cut, bottom),
        (left, bottom + cut),
        (left, d.servo_arm_top_mm),
        (inner_left, d.servo_arm_top_mm),
        (inner_left, floor),
        (inner_right, floor),
        (inner_right, 0),
        (right, 0),
        (right, bottom + cut),
        (right + cut, bottom),
    ]
    frame = along_x(outline, (-half, half))
    roots = frame.edges().filter_by(Axis.X).filter_by(lambda edge: _is_root(edge.center().Y, edge.center().Z, d))
    frame = filleted(frame, roots, ROOT_FILLET_MM, "gaze_mirror, roots of the yoke's arms")
    top = frame.edges().filter_by(Axis.Y).group_by(Axis.Z)[-1]
    return filleted(frame, top, OUTER_CHAMFER_MM / 2, "servos.tilt, top of the yoke's arm")


def _is_root(y: float, z: float, d: GimbalDimensions) -> bool:
    return abs(z - d.yoke_floor_mm) < 0.01 and -d.pivot_inner_mm - 0.01 < y < d.servo_arm_inner_mm + 0.01


def _hub(d: GimbalDimensions) -> list[Part]:
    """Journal that turns in the pan bushing, and the disc that lies on the bushing's flange."""
    journal = cylinder((0, 0, d.pan_bushing_end_mm), (0, 0, d.yoke_floor_mm), PAN_BUSHING.journal_radius_mm)
    disc = cylinder((0, 0, d.yoke_bottom_mm), (0, 0, d.yoke_floor_mm), PAN_BUSHING.flange_mm / 2 + 1)
    return [journal, disc]


def _well_floor(d: GimbalDimensions) -> float:
    return d.pan_horn_mm + FIT_MM + HUB_GRIP_MM


def _hub_cuts(d: GimbalDimensions) -> list[Part]:
    """Pocket for the horn from below, well for its screws from above, and vents between the two."""
    below, floor, above = d.pan_bushing_end_mm - 1, _well_floor(d), d.yoke_floor_mm + 1
    cuts = [
        cylinder((0, 0, below), (0, 0, d.pan_horn_mm + FIT_MM), HORN_DIAMETER_MM / 2 + FIT_MM),
        cylinder((0, 0, floor), (0, 0, above), WELL_RADIUS_MM),
        cylinder((0, 0, below), (0, 0, above), HORN_CENTRE_HOLE_DIAMETER_MM / 2),
    ]
    for x, y in horn_screw_positions():
        cuts.append(counterbored_hole(HORN_SCREW, (x, y, floor), (0, 0, 1), 0.1, HUB_GRIP_MM + 1))
        # Between the screws: whichever way up the mount is, no air stays under the hub.
        share = VENT_RADIUS_MM / HORN_SCREW_CIRCLE_MM / 2**0.5
        vent = (share * (x - y), share * (x + y))
        cuts.append(cylinder((*vent, below), (*vent, floor + VENT_DIAMETER_MM / 2), VENT_DIAMETER_MM / 2))
    # A slot from the middle to one of the vents, for the air over the horn when the mount stands on its head.
    slot = box((0, VENT_RADIUS_MM), (-1, 1), (below, floor + 0.1))
    return [*cuts, Rot(0, 0, 45) * slot]


def _servo_opening(d: GimbalDimensions) -> list[Part]:
    """Where the tilt servo is pushed in from outside until its ears lie on the arm, and the holes for their inserts."""
    servo = d.servos.tilt
    far, near = case_ends(servo)
    half, outer, inner = servo.size_mm[1] / 2 + FIT_MM, d.servo_arm_outer_mm, d.servo_arm_inner_mm
    cuts = [box((-half, half), (inner - 1, outer + 1), (far - FIT_MM, near + FIT_MM))]
    for z, x in ear_hole_positions(servo):
        cuts.append(insert_hole(servo.ear_screw, (x, outer, z), (0, -1, 0), outer - inner))
    return cuts


def _pivot_boss(d: GimbalDimensions) -> list[Part]:
    end = max(d.pivot_seat_mm, d.pivot_outer_mm)
    return [cylinder((0, -end, 0), (0, -d.pivot_inner_mm, 0), PIVOT_RADIUS_MM)]


def _pivot_cuts(d: GimbalDimensions) -> list[Part]:
    """Bore for the bushing, and room for washer and screw where a thick arm reaches further out than the sleeve."""
    outside = -max(d.pivot_seat_mm, d.pivot_outer_mm) - 1
    bore = cylinder((0, outside, 0), (0, 1 - d.pivot_inner_mm, 0), PIVOT_BUSHING.housing_radius_mm)
    return [bore, cylinder((0, outside, 0), (0, -d.pivot_seat_mm, 0), PIVOT_WASHER_RADIUS_MM + 0.5)]


def _taper(d: GimbalDimensions) -> list[Part]:
    """What is cut from both sides of the pivot's arm, which bends least at its top."""
    start, half, end = d.yoke_floor_mm + ROOT_FILLET_MM, d.arm_half_width_mm, PIVOT_RADIUS_MM
    cuts = []
    for side in (-1, 1):
        corners = [(side * half, start), (side * (half + 1), start), (side * (half + 1), 1), (side * end, 1)]
        outline = [*corners, (side * end, 0)]
        cuts.append(along_y(outline, (-d.pivot_outer_mm - 1, ROOT_FILLET_MM + 1 - d.pivot_inner_mm)))
    return cuts
