"""The yoke: a U on the pan servo's horn whose arms carry the tilt servo and the pivot.

It is made in the pan frame: x where the gaze looks at zero tilt, y the tilt axis, z the pan axis.
"""

from __future__ import annotations

from build123d import Axis, Part, Pos, Rot, Solid

from cad.gimbal_dimensions import PIN_RADIUS_MM, PIVOT_RADIUS_MM, GimbalDimensions
from cad.mirror_holder import horn_screw_holes
from cad.mirrors import FIT_MM
from cad.servo import EAR_HOLE_DIAMETER_MM, HORN_DIAMETER_MM, case_ends, ear_hole_positions
from cad.shapes import along_x, along_y, box, cylinder, single_solid

OUTER_CHAMFER_MM = 6.0


def yoke_solid(dimensions: GimbalDimensions) -> Solid:
    """Solid of the yoke in the pan frame, millimetres."""
    parts = [_plate(dimensions), _servo_arm(dimensions), _pivot_arm(dimensions)]
    return single_solid(parts, "yoke", "look at gaze_mirror, servos.tilt and mount.wall_mm")


def _plate(d: GimbalDimensions) -> Part:
    """Plate on the horn, with its outer lower corners cut so that no hand or weed catches on them."""
    left, right = d.servo_arm_outer_mm, -d.pivot_outer_mm
    bottom, top = d.yoke_bottom_mm, d.yoke_floor_mm
    cut = min(OUTER_CHAMFER_MM, d.arm_thickness_mm - 1)
    outline = [(right + cut, bottom), (left - cut, bottom), (left, bottom + cut), (left, top), (right, top)]
    beam = along_x([*outline, (right, bottom + cut)], (-d.arm_half_width_mm, d.arm_half_width_mm))
    disc = cylinder((0, 0, bottom), (0, 0, top), max(d.arm_half_width_mm, HORN_DIAMETER_MM / 2) + 3)
    holes = Rot(0, 90, 0) * horn_screw_holes(-top - 1, -bottom + 1)
    return beam + disc - holes


def _servo_arm(d: GimbalDimensions) -> Part:
    """Frame around the tilt servo, which is pushed in from outside until its ears lie on the arm."""
    servo = d.servos.tilt
    limits = (d.servo_arm_inner_mm, d.servo_arm_outer_mm)
    half = d.arm_half_width_mm
    arm = box((-half, half), limits, (d.yoke_bottom_mm + d.arm_thickness_mm / 2, d.servo_arm_top_mm))
    top_edges = arm.edges().filter_by(Axis.Y).group_by(Axis.Z)[-1]
    arm = arm.fillet(OUTER_CHAMFER_MM / 2, top_edges)
    far, near = case_ends(servo)
    half_case = servo.size_mm[1] / 2 + FIT_MM
    through = (limits[0] - 1, limits[1] + 1)
    arm -= box((-half_case, half_case), through, (far - FIT_MM, near + FIT_MM))
    for z in ear_hole_positions(servo):
        arm -= cylinder((0, through[0], z), (0, through[1], z), EAR_HOLE_DIAMETER_MM / 2)
    return arm


def _pivot_arm(d: GimbalDimensions) -> Part:
    """Tapered arm that ends in a boss around the holder's pin."""
    limits = (-d.pivot_outer_mm, -d.pivot_inner_mm)
    half, bottom = d.arm_half_width_mm, d.yoke_bottom_mm + d.arm_thickness_mm / 2
    taper = [
        (-half, bottom),
        (half, bottom),
        (half, d.yoke_floor_mm),
        (PIVOT_RADIUS_MM, 0),
        (-PIVOT_RADIUS_MM, 0),
        (-half, d.yoke_floor_mm),
    ]
    boss = cylinder((0, limits[0], 0), (0, limits[1], 0), PIVOT_RADIUS_MM)
    hole = cylinder((0, limits[0] - 1, 0), (0, limits[1] + 1, 0), PIN_RADIUS_MM + FIT_MM)
    return along_y(taper, limits) + boss - hole


def tilt_servo_in_pan(dimensions: GimbalDimensions, servo: Solid) -> Solid:
    """Tilt servo in the pan frame: shaft along the tilt axis towards the mirror, case hanging down."""
    return Pos(0, dimensions.tilt_horn_mm, 0) * Rot(90, 0, 0) * Rot(0, 0, 90) * servo
