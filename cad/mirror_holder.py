"""The mirror holder: a tray for M2 between two cheeks that turn about the tilt axis.

It is made in the m2 frame: x is the tilt axis, and the tilt axis lies in the mirror's face.
"""

from __future__ import annotations

from math import cos, pi, sin

from build123d import Part, Solid

from cad.gimbal_dimensions import CHEEK_RADIUS_MM, PIN_RADIUS_MM, THRUST_GAP_MM, GimbalDimensions
from cad.mirrors import mirror_tray, tray_depth_mm
from cad.shapes import along_x, cylinder, single_solid

CHEEK_BASE_MM = 22.0
"""Half the length of a cheek where it leaves the tray."""
HORN_SCREW_CIRCLE_MM = 7.0
HORN_SCREW_DIAMETER_MM = 2.2
HORN_CENTRE_HOLE_DIAMETER_MM = 6.0


def mirror_holder_solid(dimensions: GimbalDimensions) -> Solid:
    """Solid of the mirror holder in the m2 frame, millimetres."""
    d = dimensions
    horn_cheek = _cheek(d, (d.cheek_inner_mm, d.cheek_outer_mm)) - horn_screw_holes(
        d.cheek_inner_mm - 1, d.cheek_outer_mm + 1
    )
    pivot_cheek = _cheek(d, (-d.cheek_outer_mm, -d.cheek_inner_mm))
    pin_end = -d.cheek_outer_mm - THRUST_GAP_MM - d.arm_thickness_mm
    pin = cylinder((-d.cheek_inner_mm - 0.5, 0, 0), (pin_end, 0, 0), PIN_RADIUS_MM)
    pin = pin.chamfer(0.6, None, pin.edges().group_by(lambda edge: edge.center().X)[0])
    tray = mirror_tray(d.mirror, d.mount.wall_mm)
    return single_solid([tray, horn_cheek, pivot_cheek, pin], "mirror_holder", "look at gaze_mirror and mount.wall_mm")


def horn_screw_holes(start: float, end: float) -> Part:
    """Four screw holes and the access to the horn's own screw, along x between `start` and `end`."""
    holes = cylinder((start, 0, 0), (end, 0, 0), HORN_CENTRE_HOLE_DIAMETER_MM / 2)
    for quarter in range(4):
        angle = pi / 4 + quarter * pi / 2
        y, z = HORN_SCREW_CIRCLE_MM * cos(angle), HORN_SCREW_CIRCLE_MM * sin(angle)
        holes += cylinder((start, y, z), (end, y, z), HORN_SCREW_DIAMETER_MM / 2)
    return holes


def _cheek(dimensions: GimbalDimensions, limits: tuple[float, float]) -> Part:
    """Disc about the tilt axis with straight flanks down to the back of the tray."""
    back = -tray_depth_mm(dimensions.mirror, dimensions.mount.wall_mm)
    base = min(CHEEK_BASE_MM, dimensions.mirror.height_mm / 2)
    flank, edge = 0.85 * CHEEK_RADIUS_MM, back + dimensions.mount.wall_mm
    rise = CHEEK_RADIUS_MM / 2
    side = [(-base, back), (base, back), (base, edge), (flank, rise), (-flank, rise), (-base, edge)]
    disc = cylinder((limits[0], 0, 0), (limits[1], 0, 0), CHEEK_RADIUS_MM)
    return along_x(side, limits) + disc
