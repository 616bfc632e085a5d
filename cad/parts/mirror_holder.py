"""The mirror holder: a tray for M2 between two cheeks that turn about the tilt axis.

It is made in the m2 frame: x is the tilt axis, and the tilt axis lies in the mirror's face. One cheek is screwed to
the servo's horn, the other holds the insert of the pivot's screw. The horn's screws are reached from inside, over the
tray's empty floor: the mirror goes in last.
"""

from __future__ import annotations

from build123d import Part, Pos, Rot, Solid

from cad.parts.gimbal_dimensions import (
    CHEEK_RADIUS_MM,
    PIVOT_BUSHING,
    PIVOT_SLEEVE_MM,
    PIVOT_WASHER_MM,
    GimbalDimensions,
)
from cad.parts.hardware import (
    Hardware,
    along,
    cap_screw,
    counterbored_hole,
    heat_set_insert,
    insert_hole,
    screw_length_mm,
    spacer_sleeve,
    washer,
)
from cad.parts.mirrors import FIT_MM, LIP_OVERLAP_MM, mirror_tray, tray_depth_mm, tray_straight_mm
from cad.parts.servo import (
    HORN_CENTRE_HOLE_DIAMETER_MM,
    HORN_SCREW,
    HORN_THICKNESS_MM,
    horn_screw_positions,
    horn_solid,
    shaft_screw,
)
from cad.shapes import along_x, carved, cylinder, single_solid
from optics.mesh import Group

CHEEK_BASE_MM = 22.0
"""Half the length of a cheek where it leaves the tray."""
HORN_GRIP_MM = 2.3
"""Wall between the heads of the horn's screws and the horn."""
HORN_ROOM_MM = 0.5
"""How far a screw may reach out of the horn on the side of the servo's case."""


def mirror_holder_solid(dimensions: GimbalDimensions) -> Solid:
    """Solid of the mirror holder in the m2 frame, millimetres."""
    d, what, hint = dimensions, "gaze_mirror, of the mirror_holder", "look at mount.wall_mm too"
    tray = mirror_tray(d.mirror, d.mount.wall_mm, d.mount.mirror_fixing)
    cheeks = [_cheek(d, (d.cheek_inner_mm, d.cheek_outer_mm)), _cheek(d, (-d.cheek_outer_mm, -d.cheek_inner_mm))]
    whole = single_solid([tray, *cheeks], what, hint)
    return carved(whole, [*_horn_holes(d), _pivot_hole(d)], what, hint)


def tilt_horn_in_m2(dimensions: GimbalDimensions) -> Solid:
    """Tilt servo's horn in the m2 frame: its outer face towards the cheek."""
    return Pos(dimensions.tilt_horn_mm, 0, 0) * Rot(0, -90, 0) * horn_solid(dimensions.servos.tilt)


def holder_hardware(dimensions: GimbalDimensions) -> list[Hardware]:
    """Screws of horn and shaft, and the pivot: an insert in the cheek, a sleeve, a washer and their screw."""
    d = dimensions
    seat = d.tilt_horn_mm - FIT_MM - HORN_GRIP_MM
    screw = cap_screw(HORN_SCREW, screw_length_mm(HORN_GRIP_MM + FIT_MM + HORN_THICKNESS_MM + HORN_ROOM_MM))
    screws = [
        Hardware(
            name=f"tilt_horn_screw_{number}", group=Group.TILT, piece=screw, pose=along((seat, *place), (-1, 0, 0))
        )
        for number, place in enumerate(_horn_screws(), start=1)
    ]
    cheek = d.cheek_outer_mm - d.cheek_inner_mm
    grip = PIVOT_SLEEVE_MM + PIVOT_WASHER_MM
    pivot = {
        "pivot_insert": (heat_set_insert("M3"), d.cheek_outer_mm),
        "pivot_sleeve": (spacer_sleeve(PIVOT_BUSHING.bore_mm, "M3", PIVOT_SLEEVE_MM), d.cheek_outer_mm),
        "pivot_washer": (washer("M3"), d.pivot_sleeve_end_mm),
        "pivot_screw": (cap_screw("M3", screw_length_mm(grip + cheek)), d.pivot_sleeve_end_mm + PIVOT_WASHER_MM),
    }
    horn = Pos(d.tilt_horn_mm, 0, 0) * Rot(0, -90, 0)
    return [shaft_screw("tilt_shaft_screw", Group.TILT, d.servos.tilt, horn), *screws] + [
        Hardware(name=name, group=Group.TILT, piece=piece, pose=along((-x, 0, 0), (-1, 0, 0)))
        for name, (piece, x) in pivot.items()
    ]


def _horn_screws() -> list[tuple[float, float]]:
    """Those of the horn's holes that a key reaches over the tray's floor, as (y, z): all but the one behind it."""
    return [(y, z) for y, z in horn_screw_positions() if z > -1]


def _horn_holes(d: GimbalDimensions) -> list[Part]:
    """Holes for the horn's screws and for the screw of its shaft, through the cheek and the tray's side wall."""
    end = d.cheek_outer_mm
    inside = d.mirror.width_mm / 2 - LIP_OVERLAP_MM - 1
    seat = end - HORN_GRIP_MM
    holes = [cylinder((inside, 0, 0), (end + 1, 0, 0), HORN_CENTRE_HOLE_DIAMETER_MM / 2)]
    for place in _horn_screws():
        holes.append(counterbored_hole(HORN_SCREW, (seat, *place), (-1, 0, 0), seat - inside, HORN_GRIP_MM + 1))
    return holes


def _pivot_hole(d: GimbalDimensions) -> Part:
    depth = d.cheek_outer_mm - d.cheek_inner_mm
    return insert_hole("M3", (-d.cheek_outer_mm, 0, 0), (1, 0, 0), depth)


def _cheek(dimensions: GimbalDimensions, limits: tuple[float, float]) -> Part:
    """Disc about the tilt axis with straight flanks down to the back of the tray."""
    back = -tray_depth_mm(dimensions.mirror, dimensions.mount.wall_mm)
    base = min(CHEEK_BASE_MM, tray_straight_mm(dimensions.mirror))
    flank, edge = 0.85 * CHEEK_RADIUS_MM, back + dimensions.mount.wall_mm
    rise = CHEEK_RADIUS_MM / 2
    side = [(-base, back), (base, back), (base, edge), (flank, rise), (-flank, rise), (-base, edge)]
    disc = cylinder((limits[0], 0, 0), (limits[1], 0, 0), CHEEK_RADIUS_MM)
    return along_x(side, limits) + disc
