"""Position servos as solids: case, ears, shaft and a round horn.

The servo's frame has its origin in the middle of the horn's outer face, z along the shaft and out of the case, and x
along the case's length, towards the end that the shaft is near.
"""

from __future__ import annotations

from build123d import Solid

from cad.shapes import box, cylinder, single_solid
from rigs import Servo

EAR_LENGTH_MM = 4.5
EAR_THICKNESS_MM = 2.5
EAR_DEPTH_MM = 9.0
"""From the case's top down to the ears' upper face; nominal for small servos, as are the other details here."""
EAR_HOLE_DIAMETER_MM = 2.4
HORN_DIAMETER_MM = 20.0
HORN_THICKNESS_MM = 2.5
HORN_HEIGHT_MM = 5.0
"""From the case's top to the horn's outer face."""
COLLAR_HEIGHT_MM = 1.5
COLLAR_RADIUS_MM = 6.0
"""Unless the case ends nearer to the shaft."""
SHAFT_DIAMETER_MM = 6.0


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


def servo_solid(servo: Servo) -> Solid:
    """Solid of a servo in its own frame, millimetres.

    Raises
    ------
    ValueError
        When the shaft is not on the case.
    """
    far, near = case_ends(servo)
    if near < SHAFT_DIAMETER_MM / 2:
        raise ValueError(
            f"servo {servo.name!r}: expected shaft_offset_mm of at most "
            f"{servo.size_mm[0] / 2 - SHAFT_DIAMETER_MM / 2:g}, so that the shaft is on the case, "
            f"got {servo.shaft_offset_mm:g}"
        )
    half_width = servo.size_mm[1] / 2
    case = box((far, near), (-half_width, half_width), (case_bottom(servo), -HORN_HEIGHT_MM))
    case = case.chamfer(0.8, None, case.edges())
    ears = box((far - EAR_LENGTH_MM, near + EAR_LENGTH_MM), (-half_width, half_width), ear_levels(servo))
    ears = ears.fillet(1.5, ears.edges().filter_by(lambda edge: abs(edge.tangent_at(0.5).Z) > 0.5))
    for x in ear_hole_positions(servo):
        lower, upper = ear_levels(servo)
        ears -= cylinder((x, 0, lower - 1), (x, 0, upper + 1), EAR_HOLE_DIAMETER_MM / 2)
    # The collar and the shaft begin inside the case: solids that only touch do not become one.
    collar_top = -HORN_HEIGHT_MM + COLLAR_HEIGHT_MM
    collar = cylinder((0, 0, -HORN_HEIGHT_MM - 2), (0, 0, collar_top), min(COLLAR_RADIUS_MM, near, half_width))
    shaft = cylinder((0, 0, -HORN_HEIGHT_MM - 2), (0, 0, -1), SHAFT_DIAMETER_MM / 2)
    horn = cylinder((0, 0, -HORN_THICKNESS_MM), (0, 0, 0), HORN_DIAMETER_MM / 2)
    return single_solid([case, ears, collar, shaft, horn], f"servo {servo.name}", "look at its size_mm")
