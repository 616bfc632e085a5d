"""The fold bracket: a flange on the hull, a pedestal, two girders under a braced roof, and M1's cell behind two ribs.

Roof and ribs stay behind M1 as seen from the camera, so that the direct view beside M1 loses no more than M1 takes.
It prints on its roof without support: the roof's outer face is flat, everything else rises from it at 45 degrees or
steeper, and pockets open towards the hull.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

import numpy as np
from build123d import Axis, Part, Plane, Rot, Solid
from scipy.spatial import ConvexHull, HalfspaceIntersection

from cad.parts.bracket.bracket_placement import BOSS_WALL_MM, BracketPlacement
from cad.parts.flange import (
    BOLT_HEAD_DIAMETER_MM,
    STRAP_PLACES_MM,
    STRAP_WIDTH_MM,
    bolt_places,
    fastener_room,
    hull_side,
)
from cad.parts.hardware import clearance_diameter_mm
from cad.parts.mirror_sides import BOND_HOLE_DIAMETER_MM
from cad.parts.mirrors import mirror_tray
from cad.shapes import Limits, along_y, along_z, box, cylinder, location_mm, prism, single_solid

ROOF_CORNER_MM = 6.0
SMALLEST_KINK_MM = 0.5
"""Between the sides of pedestal and cell, for a girder that widens or narrows."""
BAR_MM = 8.0
"""Width of the roof's bars."""
KNEE_MM = 2.0
"""What is filled around the inner corner of a chord's knee."""
RIB_BAR_MM = 9.0
"""Left around the hole of a rib, which spares weight and lets the water through."""
SMALLEST_POCKET_MM = 3.0
FOOT_SHARE = 0.8
"""How far down the cell's back the ribs go; its rims carry the rest."""
WINDOW_EDGE_MM = 14.0
"""Of the cell's floor, around the window in its middle."""
FAR_MM = 500.0

Plan = tuple[float, float]


def fold_bracket_solid(placement: BracketPlacement) -> Solid:
    """Solid of the fold bracket in the body frame, millimetres."""
    parts = [windowed_cell(placement), pedestal(placement), *_girders(placement)]
    for side in (-1, 1):
        # A rib reaches inwards from the outside of the cell.
        edge = placement.y_mm + side * placement.tray_half_width_mm
        parts.append(_rib(placement, ordered(edge, edge - side * placement.wall_mm)))
    return on_hull(placement, parts, "fold_bracket")


def cell_in_fold(placement: BracketPlacement) -> Part:
    """M1's cell in the fold frame."""
    return placement.fold_from_cell * mirror_tray(placement.mirror, placement.wall_mm, placement.fixing)


def windowed_cell(placement: BracketPlacement) -> Part:
    """M1's cell with a window between the bonding holes, pointed where it is highest as it is printed."""
    half_width = placement.mirror.width_mm / 4 - BOND_HOLE_DIAMETER_MM / 2 - placement.wall_mm
    half_height = placement.mirror.height_mm / 2 - WINDOW_EDGE_MM
    point = half_width * 3**0.5
    cell = cell_in_fold(placement)
    if half_width < SMALLEST_POCKET_MM or 2 * half_height < point + SMALLEST_POCKET_MM:
        return cell
    outline = [
        (-half_width, half_height),
        (half_width, half_height),
        (half_width, -half_height + point),
        (0.0, -half_height),
        (-half_width, -half_height + point),
    ]
    window = prism(outline, Plane.XY, (-FAR_MM / 5, 0.0))
    return cell - location_mm(placement.fold_from_m1) * window


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


def on_hull(placement: BracketPlacement, parts: list[Part], name: str) -> Solid:
    """One solid of parts, without the hull's side of the contact and the fasteners' room; in the body frame."""
    what, hint = f"fold_mirror, of the {name}", "look at mount.fold_anchor_mm too"
    whole = Part() + single_solid(parts, what, hint)
    cuts = [fastener_room(placement.seat), hull_side(placement.seat), *_pockets(placement)]
    return in_body(placement, single_solid([whole - cuts], what, hint))


def in_body(placement: BracketPlacement, solid: Solid) -> Solid:
    """Solid of the fold frame in the body frame."""
    return location_mm(placement.body_from_fold) * solid


def ordered(first: float, second: float) -> Limits:
    """Limits from two ends in any order."""
    return min(first, second), max(first, second)


def _pockets(placement: BracketPlacement) -> list[Part]:
    """Pocket of the pedestal, open towards the hull, around the bolts' bosses or between the bands."""
    seat, wall = placement.seat, placement.wall_mm
    if seat.attachment == "pads":
        # Tape carries by its area.
        return []
    (x_low, x_high), (y_low, y_high) = placement.pocket_sides_mm
    low = float(placement.anchor_mm[2]) - FAR_MM
    if seat.strapped:
        half = (STRAP_PLACES_MM[1] - STRAP_PLACES_MM[0] - STRAP_WIDTH_MM) / 2 - wall
        middle = (x_low + x_high) / 2
        x_low, x_high = middle - half - wall, middle + half + wall
        if half < SMALLEST_POCKET_MM / 2:
            return []
    pocket = box((x_low + wall, x_high - wall), (y_low + wall, y_high - wall), (low, placement.roof_low_mm))
    if placement.flange_turn_deg:
        pocket = Rot(0, 0, placement.flange_turn_deg) * pocket
    place = location_mm(seat.body_from_seat)
    if seat.strapped:
        return [pocket]
    hole = clearance_diameter_mm("M4") if seat.standing_mm else BOLT_HEAD_DIAMETER_MM
    radius = hole / 2 + BOSS_WALL_MM
    bosses = [place * cylinder((x, y, -FAR_MM), (x, y, FAR_MM), radius) for x, y in bolt_places()]
    return [pocket.cut(*bosses)]


def _girders(placement: BracketPlacement) -> list[Part]:
    """Chords of the roof with a web under each, bars across and diagonals."""
    (_, front), (y_low, y_high) = placement.pedestal_mm
    y, half = placement.y_mm, placement.tray_half_width_mm
    upper, end = placement.upper_mm[0], placement.roof_front_mm
    parts = []
    # Both chords from behind the pedestal's front to the cell and over it.
    knees = ((upper, y - half), (upper, y + half))
    # The kernel loses shapes at sides that all but are one: there the girder is straight.
    sides = [
        knee if abs(side - knee) < SMALLEST_KINK_MM else side
        for side, (_, knee) in zip((y_low, y_high), knees, strict=True)
    ]
    starts = ((front - placement.wall_mm, sides[0]), (front - placement.wall_mm, sides[1]))
    ends = ((end, y - half), (end, y + half))
    reaches_cell = upper - front > placement.wall_mm
    if not reaches_cell:
        starts = ((front - placement.wall_mm, y - half), (front - placement.wall_mm, y + half))
    for side in (0, 1):
        inwards = 1.0 if side == 0 else -1.0
        if reaches_cell:
            parts += _chord(placement, starts[side], knees[side], inwards)
            parts.append(_knee(placement, knees[side], inwards))
        parts += _chord(placement, knees[side], ends[side], inwards)
    parts += _bracing(placement, knees, ends, bays=1)
    if reaches_cell:
        width, length = 2 * half, hypot(upper - front, y - (y_low + y_high) / 2)
        parts += _bracing(placement, starts, knees, bays=max(1, round(length / width)))
    return parts


def _knee(placement: BracketPlacement, place: Plan, inwards: float) -> Part:
    """Fills the inner corner of a chord's knee, where the two bars would else touch along a line."""
    x, y = place
    across = ordered(0.0, inwards * (BAR_MM + KNEE_MM))
    return _bar((x - KNEE_MM, y), (x + KNEE_MM, y), across, (placement.roof_low_mm, placement.roof_mm))


def _chord(placement: BracketPlacement, start: Plan, end: Plan, inwards: float) -> list[Part]:
    """Bar of the roof from a point to another, its outer edge on the line between them, and the web under that edge."""
    return [
        _bar(start, end, (0.0, inwards * BAR_MM), (placement.roof_low_mm, placement.roof_mm)),
        _bar(
            start, end, (0.0, inwards * placement.wall_mm), (placement.roof_mm - placement.girder_mm, placement.roof_mm)
        ),
    ]


def _bracing(placement: BracketPlacement, starts: tuple[Plan, Plan], ends: tuple[Plan, Plan], bays: int) -> list[Part]:
    """Bars across a stretch of the roof: at its far end, between its bays, and a diagonal in each bay."""
    half = BAR_MM / 2
    levels = (placement.roof_low_mm, placement.roof_mm)
    shares = np.linspace(0, 1, bays + 1)
    # Along the middle of the chords, whose outer edges are given.
    lines = [
        [(p[0] + share * (q[0] - p[0]), p[1] + inset + share * (q[1] - p[1])) for share in shares]
        for p, q, inset in zip(starts, ends, (half, -half), strict=True)
    ]
    bars = []
    for bay in range(bays):
        near, far = (lines[0][bay], lines[1][bay]), (lines[0][bay + 1], lines[1][bay + 1])
        a, b = (near[0], far[1]) if bay % 2 == 0 else (near[1], far[0])
        bars += [_bar(a, b, (-half, half), levels), _bar(far[0], far[1], (-BAR_MM, 0.0), levels)]
    return bars


def _bar(start: Plan, end: Plan, across: Limits, levels: Limits) -> Part:
    """Level bar between two points of the plan; `across` is from its line to its sides, positive to the left."""
    (x, y), (u, v) = start, end
    length = hypot(u - x, v - y)
    left = ((y - v) / length, (u - x) / length)
    near, far = ([(p[0] + side * left[0], p[1] + side * left[1]) for p in (start, end)] for side in ordered(*across))
    return along_z([*near, *reversed(far)], levels)


def _rib(placement: BracketPlacement, limits: Limits) -> Part:
    """Plate between the cell's back and the roof."""
    roof = placement.roof_mm - placement.wall_mm / 2
    # Half a wall into the cell's floor: solids that only touch do not become one.
    inset = placement.wall_mm / 2 / 2**0.5
    upper, lower = ((x - inset, z - inset) for x, z in (placement.upper_mm, placement.lower_mm))
    foot = (upper[0] + FOOT_SHARE * (lower[0] - upper[0]), upper[1] + FOOT_SHARE * (lower[1] - upper[1]))
    end = max(upper[0] + 1, min(placement.roof_front_mm, foot[0]))
    outline = [upper, (upper[0], roof), (end, roof), foot]
    rib, hole = along_y(outline, limits), _inset(outline, RIB_BAR_MM)
    return rib if hole is None else rib - along_y(hole, (limits[0] - 1, limits[1] + 1))


def _inset(outline: Sequence[Plan], distance_mm: float) -> list[Plan] | None:
    """Convex outline with every side moved inwards; None where nothing is left."""
    corners = np.array(outline)
    ahead = np.roll(corners, -1, axis=0) - corners
    middle = corners.mean(axis=0)
    normals = np.column_stack([-ahead[:, 1], ahead[:, 0]]) / np.linalg.norm(ahead, axis=1)[:, np.newaxis]
    normals *= np.sign(np.einsum("ij,ij->i", normals, middle - corners))[:, np.newaxis]
    levels = np.einsum("ij,ij->i", normals, corners) + distance_mm
    if (normals @ middle < levels + 1).any():
        return None
    # SciPy wants a x + b <= 0.
    points = HalfspaceIntersection(np.column_stack([-normals, levels]), middle).intersections
    return [(float(x), float(z)) for x, z in points[ConvexHull(points).vertices]]
