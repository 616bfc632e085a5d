"""Position servos as solids, case, ears and shaft, and the round horns that turn on them.

The servo's frame has its origin in the middle of the horn's outer face, z along the shaft and out of the case, and x
along the case's length, towards the end that the shaft is near. The horn's frame is the same, but turns.
"""

from __future__ import annotations

from functools import cache
from math import cos, pi, sin

from build123d import Location, Solid

from cad.parts.hardware import Hardware, Piece, Thread, cap_screw, clearance_diameter_mm, insert, nominal_diameter_mm
from cad.parts.mirrors import FIT_MM
from cad.shapes import box, carved, cylinder, one_solid, single_solid
from optics.mesh import Group
from rigs import Servo

EAR_LENGTH_MM = 6.5
"""Leaves the insert for the screw of an ear the wall to the case's opening that its maker asks for."""
EAR_THICKNESS_MM = 2.5
EAR_DEPTH_MM = 9.0
"""From the case's top down to the ears' upper face; nominal for small servos, as are the other details here."""
SMALLEST_HEIGHT_MM = 13.0
"""Of a case: its ears are half way down, and an insert with its relief goes between them and the case's top."""
HORN_SCREW: Thread = "M2"
HORN_SCREW_CIRCLE_MM = 7.0
"""Radius on which the horn has four tapped holes."""
HORN_CENTRE_HOLE_DIAMETER_MM = 6.0
"""Room for the head of the screw that holds the horn on its shaft."""
HORN_DIAMETER_MM = 20.0
HORN_THICKNESS_MM = 2.5
HORN_HEIGHT_MM = 5.0
"""From the case's top to the horn's outer face."""
COLLAR_HEIGHT_MM = 1.5
COLLAR_RADIUS_MM = 6.0
"""Unless the case ends nearer to the shaft."""
SHAFT_DIAMETER_MM = 6.0
SHAFT_END_MM = 1.0
"""From the horn's outer face down to the end of the shaft."""
SHAFT_SCREW_LENGTH_MM: dict[Thread, int] = {"M2": 6, "M3": 8}
"""Of the screw that holds the horn on the shaft; nominal."""
SHAFT_SCREW_PLAY_MM = 0.1
"""Around it, in the horn's hole and in the shaft's thread as it is drawn."""


def ear_levels(servo: Servo) -> tuple[float, float]:
    """Lower and upper face of the ears along z of the servo's frame, millimetres."""
    upper = -HORN_HEIGHT_MM - min(EAR_DEPTH_MM, servo.size_mm[2] / 2)
    return upper - EAR_THICKNESS_MM, upper


def case_ends(servo: Servo) -> tuple[float, float]:
    """Far and near end of the case along x of the servo's frame, millimetres."""
    length = servo.size_mm[0]
    return -servo.shaft_offset_mm - length / 2, -servo.shaft_offset_mm + length / 2


def case_bottom(servo: Servo) -> float:
    """Bottom of the case along z of the servo's frame, millimetres."""
    return -HORN_HEIGHT_MM - servo.size_mm[2]


def ear_hole_positions(servo: Servo) -> list[tuple[float, float]]:
    """Where the screws go through the ears, as (x, y) of the servo's frame, millimetres."""
    half = ear_hole_spacing_mm(servo) / 2
    sides = (-servo.ear_hole_pitch_mm / 2, servo.ear_hole_pitch_mm / 2) if servo.ear_hole_pitch_mm else (0.0,)
    return [(end - servo.shaft_offset_mm, side) for end in (-half, half) for side in sides]


def ear_hole_spacing_mm(servo: Servo) -> float:
    """From the holes of one ear to those of the other; without a number of the servo's they are in the ears' middle."""
    return servo.ear_hole_spacing_mm or servo.size_mm[0] + EAR_LENGTH_MM


def check_servo(servo: Servo, key: str) -> None:
    """Refuse a servo that no mount can be made for; `key` is where the rig has it.

    Raises
    ------
    ValueError
        When the shaft is not on the case, or the case is too shallow for the screws of its ears.
    """
    _, width, height = servo.size_mm
    largest = servo.size_mm[0] / 2 - SHAFT_DIAMETER_MM / 2
    if servo.shaft_offset_mm > largest:
        raise ValueError(
            f"{key}.shaft_offset_mm = {servo.shaft_offset_mm:g}: expected at most {largest:g}, "
            "so that the shaft is on the case"
        )
    if width < SHAFT_DIAMETER_MM:
        raise ValueError(f"{key}.size_mm[1] = {width:g}: expected at least the shaft's {SHAFT_DIAMETER_MM:g}")
    if height < SMALLEST_HEIGHT_MM:
        raise ValueError(
            f"{key}.size_mm[2] = {height:g}: expected at least {SMALLEST_HEIGHT_MM:g}, so that the inserts for the "
            "screws of its ears have room beside its case"
        )
    _check_ears(servo, key)


def _check_ears(servo: Servo, key: str) -> None:
    """An insert with its wall has room beside the case, the hole lies in the ear, and two holes beside each other."""
    length, width, _ = servo.size_mm
    size, hole = insert(servo.ear_screw), clearance_diameter_mm(servo.ear_screw)
    low, high = length + 2 * (FIT_MM + size.boss_radius_mm), length + 2 * EAR_LENGTH_MM - hole
    spacing = ear_hole_spacing_mm(servo)
    if not low <= spacing <= high:
        raise ValueError(
            f"{key}.ear_hole_spacing_mm = {spacing:g}: expected {low:.1f} to {high:.1f}, so that {servo.ear_screw} "
            "inserts have a wall beside the case and the holes are in the ears"
        )
    apart, widest = 2 * size.boss_radius_mm, width - hole
    if servo.ear_hole_pitch_mm and not apart <= servo.ear_hole_pitch_mm <= widest:
        raise ValueError(
            f"{key}.ear_hole_pitch_mm = {servo.ear_hole_pitch_mm:g}: expected 0 for one hole, or {apart:.1f} to "
            f"{widest:.1f} for two in an ear"
        )


@cache
def servo_solid(servo: Servo) -> Solid:
    """Solid of a servo that `check_servo` lets pass, in its own frame, millimetres."""
    far, near = case_ends(servo)
    half_width = servo.size_mm[1] / 2
    case = box((far, near), (-half_width, half_width), (case_bottom(servo), -HORN_HEIGHT_MM))
    case = case.chamfer(0.8, None, case.edges())
    ears = box((far - EAR_LENGTH_MM, near + EAR_LENGTH_MM), (-half_width, half_width), ear_levels(servo))
    ears = ears.fillet(1.5, ears.edges().filter_by(lambda edge: abs(edge.tangent_at(0.5).Z) > 0.5))
    lower, upper = ear_levels(servo)
    for x, y in ear_hole_positions(servo):
        ears -= cylinder((x, y, lower - 1), (x, y, upper + 1), clearance_diameter_mm(servo.ear_screw) / 2)
    # The collar and the shaft begin inside the case: solids that only touch do not become one.
    collar_top = -HORN_HEIGHT_MM + COLLAR_HEIGHT_MM
    collar = cylinder((0, 0, -HORN_HEIGHT_MM - 2), (0, 0, collar_top), min(COLLAR_RADIUS_MM, near, half_width))
    shaft = cylinder((0, 0, -HORN_HEIGHT_MM - 2), (0, 0, -SHAFT_END_MM), SHAFT_DIAMETER_MM / 2)
    what = f"servo {servo.name}"
    whole = single_solid([case, ears, collar, shaft], what, "look at its size_mm")
    depth = SHAFT_SCREW_LENGTH_MM[servo.shaft_screw] + 0.5
    thread = cylinder((0, 0, -depth), (0, 0, 0), _shaft_hole_mm(servo))
    return carved(whole, [thread], what, "look at its shaft_screw")


def shaft_screw(name: str, group: Group, servo: Servo, servo_pose: Location) -> Hardware:
    """Screw that holds the horn on the shaft, driven through the middle of what is on the horn.

    It takes the place of the one that comes with the servo, for its hexagon socket: where it is driven, over the floor
    of M2's cell, a key gets to it and no screwdriver does.
    """
    screw = cap_screw(servo.shaft_screw, SHAFT_SCREW_LENGTH_MM[servo.shaft_screw])
    catalogue = f"{screw.catalogue}, on the shaft of servo {servo.name}"
    return Hardware(name=name, group=group, piece=Piece(catalogue=catalogue, shape=screw.shape), pose=servo_pose)


def _shaft_hole_mm(servo: Servo) -> float:
    """Radius of the hole for the screw of the shaft."""
    return nominal_diameter_mm(servo.shaft_screw) / 2 + SHAFT_SCREW_PLAY_MM


@cache
def horn_solid(servo: Servo) -> Solid:
    """Solid of a round horn: a disc with a socket for the shaft, a hole for the shaft's screw and four tapped holes."""
    horn = cylinder((0, 0, -HORN_THICKNESS_MM), (0, 0, 0), HORN_DIAMETER_MM / 2)
    horn -= cylinder((0, 0, -HORN_THICKNESS_MM), (0, 0, 0.1 - SHAFT_END_MM), SHAFT_DIAMETER_MM / 2 + FIT_MM / 2)
    horn -= cylinder((0, 0, -HORN_THICKNESS_MM), (0, 0, 0), _shaft_hole_mm(servo))
    for x, y in horn_screw_positions():
        # Drawn at the thread's outer diameter, so that the screws in it share no volume with it.
        horn -= cylinder((x, y, -HORN_THICKNESS_MM), (x, y, 0), nominal_diameter_mm(HORN_SCREW) / 2 + 0.1)
    return one_solid(horn, "horn", "look at cad/parts/servo.py")


def horn_screw_positions() -> list[tuple[float, float]]:
    """Where the horn's four tapped holes are, as (x, y) in its frame, millimetres."""
    angles = [quarter * pi / 2 for quarter in range(4)]
    return [(HORN_SCREW_CIRCLE_MM * cos(angle), HORN_SCREW_CIRCLE_MM * sin(angle)) for angle in angles]
