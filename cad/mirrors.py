"""Mirror plates and the trays that hold them, in the mirror's frame.

The frame is the optical one: origin at the centre of the reflecting face, z its outward normal, y up the face.
"""

from __future__ import annotations

from build123d import Part, Solid

from cad.shapes import box, cylinder
from rigs.specification import FlatMirror

FIT_MM = 0.2
"""Gap of every designed fit: what a printed pocket needs around the piece that goes into it."""
RIM_MM = 2.0
LIP_OVERLAP_MM = 1.5
LIP_THICKNESS_MM = 1.2
BOND_HOLE_DIAMETER_MM = 8.0


def mirror_plate(mirror: FlatMirror) -> Solid:
    """Mirror plate, its reflecting face in z = 0; millimetres."""
    half_width, half_height = mirror.width_mm / 2, mirror.height_mm / 2
    limits = ((-half_width, half_width), (-half_height, half_height), (-mirror.thickness_mm, 0.0))
    return box(*limits).solid()


def tray_depth_mm(mirror: FlatMirror, wall_mm: float) -> float:
    """From the reflecting face to the back of the tray."""
    return mirror.thickness_mm + FIT_MM + wall_mm


def tray_half_width_mm(mirror: FlatMirror) -> float:
    """From the middle of the mirror to the outside of the tray's side walls."""
    return mirror.width_mm / 2 + FIT_MM + RIM_MM


def tray_foot_mm(mirror: FlatMirror) -> float:
    """From the middle of the mirror down to the outside of the rim on which its lower edge stands."""
    return mirror.height_mm / 2 + FIT_MM + RIM_MM


def mirror_tray(mirror: FlatMirror, wall_mm: float) -> Part:
    """Tray that a mirror slides into from its upper edge.

    A lip of 1.5 mm holds the two side edges; the lower edge stands on a rim that is flush with the face; the mirror
    is bonded through the holes in the tray's floor.
    """
    half_width, half_height = mirror.width_mm / 2, mirror.height_mm / 2
    back, floor = -tray_depth_mm(mirror, wall_mm), -(mirror.thickness_mm + FIT_MM)
    outside, foot = tray_half_width_mm(mirror), tray_foot_mm(mirror)
    beyond = half_height + 1
    tray = box((-outside, outside), (-foot, half_height), (back, FIT_MM + LIP_THICKNESS_MM))
    tray = tray.fillet(RIM_MM, tray.edges().filter_by(lambda edge: abs(edge.tangent_at(0.5).Z) > 0.5))
    tray -= box((-half_width - FIT_MM, half_width + FIT_MM), (-half_height - FIT_MM, beyond), (floor, FIT_MM))
    free = half_width - LIP_OVERLAP_MM
    tray -= box((-free, free), (-foot - 1, beyond), (0, FIT_MM + LIP_THICKNESS_MM + 1))
    for x in (-half_width / 2, half_width / 2):
        for y in (-half_height / 2, half_height / 2):
            tray -= cylinder((x, y, back - 1), (x, y, floor + 1), BOND_HOLE_DIAMETER_MM / 2)
    return tray
