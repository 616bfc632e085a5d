"""The fold bracket: a flange on the hull, a roof over M1 and the cell that holds M1 at 45 degrees.

Roof and ribs stay behind M1 as seen from the camera, so that the direct view beside M1 loses no more than M1 takes.
"""

from __future__ import annotations

from math import hypot

from build123d import Axis, Part, Solid

from cad.parts.bracket_placement import FoldStance
from cad.parts.flange import fastener_room, flange, hull_side
from cad.parts.mirrors import mirror_tray
from cad.shapes import Limits, along_y, box, cylinder, location_mm, single_solid

RAIL_HEIGHT_MM = 10.0
ROOF_CORNER_MM = 6.0
RIB_FILLET_MM = 3.0
LEVEL = 1e-9


def fold_bracket_solid(stance: FoldStance) -> Solid:
    """Solid of the fold bracket in the body frame, millimetres."""
    y, front = stance.y_mm, stance.lower_mm[0]
    roof = box((stance.rear_mm, front), _across(y, stance.half_width_mm), (stance.roof_low_mm, stance.roof_mm))
    roof = roof.fillet(ROOF_CORNER_MM, roof.edges().filter_by(Axis.Z))
    parts = [cell_in_fold(stance), roof, *flange_parts(stance)]
    for side in (-1, 1):
        # A rib reaches inwards from the outside of the cell, a rail from the edge of the roof.
        edge, rail_edge = y + side * stance.tray_half_width_mm, y + side * stance.half_width_mm
        parts.append(_rib(stance, ordered(edge, edge - side * stance.wall_mm)))
        parts.append(_rail(stance, front, ordered(rail_edge, rail_edge - side * stance.wall_mm)))
    return on_hull(stance, parts, "fold_bracket")


def cell_in_fold(stance: FoldStance) -> Part:
    """M1's cell in the fold frame."""
    return stance.fold_from_cell * mirror_tray(stance.mirror, stance.wall_mm, stance.fixing)


def flange_parts(stance: FoldStance) -> list[Part]:
    """Flange, and where the hull is curved or slopes what fills the wedge between it and the roof."""
    seat = stance.seat
    parts = [flange(seat)]
    if not seat.strapped and (seat.contact.range_mm != (0.0, 0.0) or seat.normal[2] < 1 - LEVEL):
        x, y, _ = stance.anchor_mm
        lean = hypot(seat.length_mm, seat.width_mm) / 2 * (1 - seat.normal[2] ** 2) ** 0.5
        low = float(stance.anchor_mm[2]) + seat.contact.range_mm[0] - lean
        half_length, half_width = seat.length_mm / 2 - 1, seat.width_mm / 2 - 1
        parts.append(box((x - half_length, x + half_length), (y - half_width, y + half_width), (low, stance.roof_mm)))
    return parts


def on_hull(stance: FoldStance, parts: list[Part], name: str) -> Solid:
    """One solid of parts, without the hull's side of the contact and the fasteners' room; in the body frame."""
    what, hint = f"fold_mirror, of the {name}", "look at mount.fold_anchor_mm too"
    whole = Part() + single_solid(parts, what, hint)
    cuts = [fastener_room(stance.seat)]
    if len(parts) and (stance.seat.contact.range_mm != (0.0, 0.0) or stance.seat.normal[2] < 1 - LEVEL):
        cuts.append(hull_side(stance.seat))
    return in_body(stance, single_solid([whole - cuts], what, hint))


def in_body(stance: FoldStance, solid: Solid) -> Solid:
    """Solid of the fold frame in the body frame."""
    return location_mm(stance.body_from_fold) * solid


def ordered(first: float, second: float) -> Limits:
    """Limits from two ends in any order."""
    return min(first, second), max(first, second)


def _across(middle: float, half: float) -> Limits:
    return middle - half, middle + half


def _rib(stance: FoldStance, limits: Limits) -> Part:
    """Plate between cell and roof, with a hole that spares weight and lets the water through."""
    roof = stance.roof_mm - stance.wall_mm / 2
    # Half a wall into the cell's floor: solids that only touch do not become one.
    inset = stance.wall_mm / 2 / 2**0.5
    upper, lower = ((x - inset, z - inset) for x, z in (stance.upper_mm, stance.lower_mm))
    front = stance.lower_mm
    rib = along_y([upper, (upper[0], roof), (front[0], roof), front, lower], limits)
    width, height = front[0] - upper[0], roof - front[1]
    radius = (width + height - hypot(width, height)) / 2
    centre = (front[0] - radius, roof - radius)
    return rib - cylinder((centre[0], limits[0] - 1, centre[1]), (centre[0], limits[1] + 1, centre[1]), 0.55 * radius)


def _rail(stance: FoldStance, front: float, limits: Limits) -> Part:
    """Upstand along an edge of the roof, which would bend without it."""
    foot, top = stance.roof_mm - stance.wall_mm / 2, stance.roof_mm + RAIL_HEIGHT_MM
    start, end = stance.rear_mm + ROOF_CORNER_MM, front - ROOF_CORNER_MM
    slope = RAIL_HEIGHT_MM
    return along_y([(start, foot), (end, foot), (end - slope, top), (start + slope, top)], limits)
