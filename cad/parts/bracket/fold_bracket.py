"""The fold bracket: a flange on the hull, a pedestal, two girders, and M1's framed cell behind two ribs.

Roof and ribs stay behind M1 as seen from the camera, so that the direct view beside M1 loses no more than M1 takes.
It prints on its roof: what is not the cell is webs on edge, upright then and of lines without infill between them, and
the cell rises from them at 45 degrees. Level plates, slender bars and blocks are what takes time
(`docs/explanation/fold.md`).
"""

from __future__ import annotations

from math import hypot

import numpy as np
from build123d import Axis, Part, Rot, Solid

from cad.parts.bracket.bracket_placement import BOSS_WALL_MM, BRACE_MM, ROOF_CORNER_MM, BracketPlacement
from cad.parts.contact import CylinderContact
from cad.parts.flange import (
    BOLT_HEAD_DIAMETER_MM,
    STRAP_PLACES_MM,
    STRAP_WIDTH_MM,
    Seat,
    bolt_places,
    fastener_room,
    hull_side,
)
from cad.parts.hardware import clearance_diameter_mm
from cad.parts.mirrors import mirror_tray
from cad.shapes import Limits, along_y, along_z, box, cylinder, location_mm, single_solid

SMALLEST_KINK_MM = 0.5
"""Between the sides of pedestal and cell, for a girder that widens or narrows."""
KNEE_MM = 2.0
"""What is filled around the inner corner between girder and rib."""
SMALLEST_POCKET_MM = 3.0
FOOT_SHARE = 0.8
"""How far down the cell's back the ribs go; its rims carry the rest."""
POST_MM = 12.0
"""Of the posts between cell and roof, across: with it they keep the cell from swaying sideways."""
RAIL_MM = 6.0
"""Of a strapped flange's rails, which bands lie on and which lie on the hull."""
FAR_MM = 500.0

Plan = tuple[float, float]


def fold_bracket_solid(placement: BracketPlacement) -> Solid:
    """Solid of the fold bracket in the body frame, millimetres."""
    parts = [cell_in_fold(placement, framed=True), pedestal(placement), *_girders(placement), *_posts(placement)]
    for side in (-1, 1):
        # A rib reaches inwards from the outside of the cell.
        edge = placement.y_mm + side * placement.tray_half_width_mm
        parts.append(_rib(placement, ordered(edge, edge - side * placement.web_mm)))
    return on_hull(placement, parts, "fold_bracket", _open_pockets(placement))


def cell_in_fold(placement: BracketPlacement, framed: bool = False) -> Part:
    """M1's cell in the fold frame; framed, with a window in its floor."""
    return placement.fold_from_cell * mirror_tray(placement.mirror, placement.cell_wall_mm, placement.fixing, framed)


def pedestal(placement: BracketPlacement) -> Part:
    """Block from the hull up to the roof, with the flange in it; what the hull and the bolts take is cut later."""
    seat = placement.seat
    (x_low, x_high), y_limits = placement.pedestal_mm
    low = float(placement.anchor_mm[2]) - FAR_MM
    block = box((x_low, x_high), y_limits, (low, placement.roof_mm))
    block = block.fillet(ROOF_CORNER_MM, block.edges().filter_by(Axis.Z))
    # The hull's side is cut under the flange alone; beside it the block ends where the flange's box does, and above the
    # highest point of the contact; beside one that is turned also above the bands, which lie on it.
    half_length, half_width = seat.length_mm / 2, seat.width_mm / 2
    under, over = seat.contact.range_mm
    if placement.flange_turn_deg:
        over = seat.height_mm
    beyond = [box((-FAR_MM, FAR_MM), (-FAR_MM, FAR_MM), (-2 * FAR_MM, under))]
    everywhere = (-FAR_MM, FAR_MM)
    for side in (-1, 1):
        beyond.append(box(ordered(side * half_length, side * FAR_MM), everywhere, (-FAR_MM, over)))
        beyond.append(box(everywhere, ordered(side * half_width, side * FAR_MM), (-FAR_MM, over)))
    return block - [location_mm(seat.body_from_seat) * cut for cut in beyond]


def on_hull(placement: BracketPlacement, parts: list[Part], name: str, pockets: list[Part]) -> Solid:
    """One solid of parts, without pockets, the hull's side of the contact and the fasteners' room; body frame."""
    what, hint = f"fold_mirror, of the {name}", "look at mount.fold_anchor_mm too"
    whole = Part() + single_solid(parts, what, hint)
    cuts = [fastener_room(placement.seat), hull_side(placement.seat), *pockets]
    return in_body(placement, single_solid([whole - cuts], what, hint))


def in_body(placement: BracketPlacement, solid: Solid) -> Solid:
    """Solid of the fold frame in the body frame."""
    return location_mm(placement.body_from_fold) * solid


def ordered(first: float, second: float) -> Limits:
    """Limits from two ends in any order."""
    return min(first, second), max(first, second)


def closed_pockets(placement: BracketPlacement, wall_mm: float) -> list[Part]:
    """Pocket of the pedestal, open towards the hull, around the bolts' bosses or between the bands."""
    seat = placement.seat
    if seat.attachment == "pads":
        # Tape carries by its area.
        return []
    levels = (float(placement.anchor_mm[2]) - FAR_MM, placement.roof_low_mm)
    if not seat.strapped:
        return [_room_within(placement, (wall_mm, wall_mm), levels).cut(*_bosses(seat))]
    half = (STRAP_PLACES_MM[1] - STRAP_PLACES_MM[0] - STRAP_WIDTH_MM) / 2 - wall_mm
    if half < SMALLEST_POCKET_MM / 2:
        return []
    (x_low, x_high), _ = placement.pocket_sides_mm
    return [_room_within(placement, ((x_high - x_low) / 2 - half, wall_mm), levels)]


def _open_pockets(placement: BracketPlacement) -> list[Part]:
    """What is taken out of the pedestal through its roof too: all but walls and bosses, or rails under bands.

    Under holes for bolts and keys the roof stays: bosses lean there, and it holds them to the walls.
    """
    seat, web = placement.seat, placement.web_mm
    everywhere = (-FAR_MM, FAR_MM)
    if seat.strapped:
        room = _room_within(placement, (web, RAIL_MM), everywhere)
        if isinstance(seat.contact, CylinderContact):
            # Over a round hull a band would else lie on the hull itself.
            room -= location_mm(seat.body_from_seat) * box(everywhere, (-RAIL_MM / 2, RAIL_MM / 2), everywhere)
        return [room]
    if not seat.standing_mm:
        return closed_pockets(placement, web)
    return [_room_within(placement, (web, web), everywhere).cut(*_bosses(seat))]


def _room_within(placement: BracketPlacement, walls_mm: tuple[float, float], levels: Limits) -> Part:
    """Box within the pedestal's walls, whose thickness is given along and across the flange."""
    (x_low, x_high), (y_low, y_high) = placement.pocket_sides_mm
    along, across = walls_mm
    room = box((x_low + along, x_high - along), (y_low + across, y_high - across), levels)
    if (radius := ROOF_CORNER_MM - max(walls_mm)) > SMALLEST_KINK_MM:
        # Round as the pedestal is, or thin walls would not meet at its corners.
        room = room.fillet(radius, room.edges().filter_by(Axis.Z))
    return Rot(0, 0, placement.flange_turn_deg) * room if placement.flange_turn_deg else room


def _bosses(seat: Seat) -> list[Part]:
    """What stays around the bolts of a flange, or around their heads' room where that is in the pedestal."""
    hole = clearance_diameter_mm("M4") if seat.standing_mm else BOLT_HEAD_DIAMETER_MM
    place, radius = location_mm(seat.body_from_seat), hole / 2 + BOSS_WALL_MM
    return [place * cylinder((x, y, -FAR_MM), (x, y, FAR_MM), radius) for x, y in bolt_places()]


def _girders(placement: BracketPlacement) -> list[Part]:
    """A web at each side from behind the pedestal's front to the cell, with bars across and diagonals at the roof."""
    (_, front), (y_low, y_high) = placement.pedestal_mm
    y, half = placement.y_mm, placement.tray_half_width_mm
    upper, end = placement.upper_mm[0], placement.roof_front_mm
    knees = ((upper, y - half), (upper, y + half))
    ends = ((end, y - half), (end, y + half))
    if upper - front <= placement.web_mm:
        # The pedestal is between the ribs, and bars alone reach them.
        return _bracing(placement, knees, ends, 1, placement.girder_mm)
    # The kernel loses shapes at sides that all but are one: there the girder is straight.
    sides = [
        knee if abs(side - knee) < SMALLEST_KINK_MM else side
        for side, (_, knee) in zip((y_low, y_high), knees, strict=True)
    ]
    starts = ((placement.girders_from_mm, sides[0]), (placement.girders_from_mm, sides[1]))
    bays = max(1, round(hypot(upper - front, y - (y_low + y_high) / 2) / (2 * half)))
    parts = [*_bracing(placement, knees, ends, 1, BRACE_MM), *_bracing(placement, starts, knees, bays, BRACE_MM)]
    for start, knee, inwards in zip(starts, knees, (1.0, -1.0), strict=True):
        across = ordered(0.0, inwards * placement.web_mm)
        parts += [_bar(start, knee, across, _girder_levels(placement)), _knee(placement, knee, inwards)]
    return parts


def _knee(placement: BracketPlacement, place: Plan, inwards: float) -> Part:
    """Fills the inner corner between a girder and the rib that it meets."""
    x, y = place
    across = ordered(inwards * placement.web_mm / 2, inwards * (placement.web_mm + KNEE_MM))
    return _bar((x - KNEE_MM, y), (x + KNEE_MM, y), across, _girder_levels(placement))


def _girder_levels(placement: BracketPlacement) -> Limits:
    return placement.roof_mm - placement.girder_mm, placement.roof_mm


def _bracing(
    placement: BracketPlacement, starts: tuple[Plan, Plan], ends: tuple[Plan, Plan], bays: int, depth_mm: float
) -> list[Part]:
    """Bars across a stretch of the roof: at its far end, between its bays, and a diagonal in each bay."""
    half = placement.web_mm / 2
    levels = (placement.roof_mm - depth_mm, placement.roof_mm)
    shares = np.linspace(0, 1, bays + 1)
    # Along the middle of the webs, whose outer faces are given.
    lines = [
        [(p[0] + share * (q[0] - p[0]), p[1] + inset + share * (q[1] - p[1])) for share in shares]
        for p, q, inset in zip(starts, ends, (half, -half), strict=True)
    ]
    bars = []
    for bay in range(bays):
        near, far = (lines[0][bay], lines[1][bay]), (lines[0][bay + 1], lines[1][bay + 1])
        a, b = (near[0], far[1]) if bay % 2 == 0 else (near[1], far[0])
        bars += [_bar(a, b, (-half, half), levels), _bar(far[0], far[1], (-2 * half, 0.0), levels)]
    return bars


def _bar(start: Plan, end: Plan, across: Limits, levels: Limits) -> Part:
    """Level bar between two points of the plan; `across` is from its line to its sides, positive to the left."""
    (x, y), (u, v) = start, end
    length = hypot(u - x, v - y)
    left = ((y - v) / length, (u - x) / length)
    near, far = ([(p[0] + side * left[0], p[1] + side * left[1]) for p in (start, end)] for side in ordered(*across))
    return along_z([*near, *reversed(far)], levels)


def _posts(placement: BracketPlacement) -> list[Part]:
    """What makes angles of the ribs at their near ends: walls across, from the cell's upper corner to the roof."""
    (x, z), half = placement.upper_mm, placement.web_mm / 2
    edges = [(placement.y_mm + side * placement.tray_half_width_mm, side) for side in (-1, 1)]
    return [
        box((x - half, x + half), ordered(edge, edge - side * POST_MM), (z - 2 * half, placement.roof_mm))
        for edge, side in edges
    ]


def _rib(placement: BracketPlacement, limits: Limits) -> Part:
    """Plate between the cell's back and the roof."""
    roof = placement.roof_mm
    # Half a wall into the cell's floor: solids that only touch do not become one.
    inset = placement.cell_wall_mm / 2 / 2**0.5
    upper, lower = ((x - inset, z - inset) for x, z in (placement.upper_mm, placement.lower_mm))
    foot = (upper[0] + FOOT_SHARE * (lower[0] - upper[0]), upper[1] + FOOT_SHARE * (lower[1] - upper[1]))
    end = max(upper[0] + 1, min(placement.roof_front_mm, foot[0]))
    return along_y([upper, (upper[0], roof), (end, roof), foot], limits)
