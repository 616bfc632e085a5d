"""Position servos as solids, case, ears and shaft, and the round horns that turn on them.

The servo's frame has its origin in the middle of the horn's outer face, z along the shaft and out of the case, and x
along the case's length, towards the end that the shaft is near. The horn's frame is the same, but turns.
"""

from __future__ import annotations

from functools import cache
from math import cos, pi, sin

from build123d import Solid

from cad.parts.hardware import Thread, clearance_diameter_mm, nominal_diameter_mm
from cad.parts.mirrors import FIT_MM
from cad.shapes import box, cylinder, one_solid, single_solid
from rigs import Servo

EAR_LENGTH_MM = 6.5
"""Leaves the insert for the screw of an ear the wall to the case's opening that its maker asks for."""
EAR_THICKNESS_MM = 2.5
EAR_DEPTH_MM = 9.0
"""From the case's top down to the ears' upper face; nominal for small servos, as are the other details here."""
EAR_SCREW: Thread = "M2"
SMALLEST_HEIGHT_MM = 13.0
"""Of a case: its ears are half way down, and an insert with its relief goes between them and the case's top."""
HORN_SCREW: Thread = "M2"
HORN_SCREW_CIRCLE_MM = 7.0
"""Radius on which the horn has four tapped holes."""
HORN_CENTRE_HOLE_DIAMETER_MM = 6.0
"""Room for the head of the screw that holds the horn on its shaft and comes with the servo."""
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
SHAFT_SCREW_DIAMETER_MM = 3.2


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


def ear_hole_positions(servo: Servo) -> tuple[float, float]:
    """Where the screws go through the ears, along x of the servo's frame, millimetres."""
    far, near = case_ends(servo)
    return far - EAR_LENGTH_MM / 2, near + EAR_LENGTH_MM / 2


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


@cache
def servo_solid(servo: Servo) -> Solid:
    """Solid of a servo that `check_servo` lets pass, in its own frame, millimetres."""
    far, near = case_ends(servo)
    half_width = servo.size_mm[1] / 2
    case = box((far, near), (-half_width, half_width), (case_bottom(servo), -HORN_HEIGHT_MM))
    case = case.chamfer(0.8, None, case.edges())
    ears = box((far - EAR_LENGTH_MM, near + EAR_LENGTH_MM), (-half_width, half_width), ear_levels(servo))
    ears = ears.fillet(1.5, ears.edges().filter_by(lambda edge: abs(edge.tangent_at(0.5).Z) > 0.5))
    for x in ear_hole_positions(servo):
        lower, upper = ear_levels(servo)
        ears -= cylinder((x, 0, lower - 1), (x, 0, upper + 1), clearance_diameter_mm(EAR_SCREW) / 2)
    # The collar and the shaft begin inside the case: solids that only touch do not become one.
    collar_top = -HORN_HEIGHT_MM + COLLAR_HEIGHT_MM
    collar = cylinder((0, 0, -HORN_HEIGHT_MM - 2), (0, 0, collar_top), min(COLLAR_RADIUS_MM, near, half_width))
    shaft = cylinder((0, 0, -HORN_HEIGHT_MM - 2), (0, 0, -SHAFT_END_MM), SHAFT_DIAMETER_MM / 2)
    return single_solid([case, ears, collar, shaft], f"servo {servo.name}", "look at its size_mm")


@cache
def horn_solid() -> Solid:
    """Solid of a round horn: a disc with a socket for the shaft, a hole for the shaft's screw and four tapped holes."""
    horn = cylinder((0, 0, -HORN_THICKNESS_MM), (0, 0, 0), HORN_DIAMETER_MM / 2)
    horn -= cylinder((0, 0, -HORN_THICKNESS_MM), (0, 0, 0.1 - SHAFT_END_MM), SHAFT_DIAMETER_MM / 2 + FIT_MM / 2)
    horn -= cylinder((0, 0, -HORN_THICKNESS_MM), (0, 0, 0), SHAFT_SCREW_DIAMETER_MM / 2)
    for x, y in horn_screw_positions():
        # Drawn at the thread's outer diameter, so that the screws in it share no volume with it.
        horn -= cylinder((x, y, -HORN_THICKNESS_MM), (x, y, 0), nominal_diameter_mm(HORN_SCREW) / 2 + 0.1)
    return one_solid(horn, "horn", "look at cad/parts/servo.py")


def horn_screw_positions() -> list[tuple[float, float]]:
    """Where the horn's four tapped holes are, as (x, y) in its frame, millimetres."""
    angles = [quarter * pi / 2 for quarter in range(4)]
    return [(HORN_SCREW_CIRCLE_MM * cos(angle), HORN_SCREW_CIRCLE_MM * sin(angle)) for angle in angles]
