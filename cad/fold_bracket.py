"""The fold bracket: a flange on the hull, a roof over M1 and the tray that holds M1 at 45 degrees.

Roof and ribs stay behind M1 as seen from the camera, so that the direct view beside M1 loses no more than M1 takes.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

import numpy as np
from build123d import Part, Solid

from cad.mirrors import mirror_tray, tray_depth_mm, tray_foot_mm, tray_half_width_mm
from cad.shapes import along_y, box, cylinder, location_mm, single_solid
from optics.layout import Layout
from rigs import FoldMirror, Mount

FLANGE_LENGTH_MM = 50.0
FLANGE_HOLES_MM = (18.0, 17.0)
FLANGE_HOLE_DIAMETER_MM = 4.5
"""Clearance for M4."""
SMALLEST_HALF_WIDTH_MM = 25.0
RAIL_HEIGHT_MM = 10.0
ALIGNMENT_MM = 0.5


@dataclass(frozen=True, kw_only=True)
class TrayCorners:
    """Upper and lower corner of the tray's back, as (x, z) in the body frame, millimetres."""

    upper: tuple[float, float]
    lower: tuple[float, float]


def fold_bracket_solid(fold_mirror: FoldMirror, mount: Mount, layout: Layout) -> Solid:
    """Solid of the fold bracket in the body frame, millimetres.

    Raises
    ------
    ValueError
        When the anchor is beside the camera's vertical plane or not above M1.
    """
    corners = tray_corners(fold_mirror, mount, layout)
    _check_anchor(mount, layout, corners)
    tray = location_mm(layout.body_from_m1) * mirror_tray(fold_mirror, mount.wall_mm)
    y = float(1000 * layout.body_from_m1.translation[1])
    half_width = max(tray_half_width_mm(fold_mirror), SMALLEST_HALF_WIDTH_MM)
    parts = [tray, _roof(mount, y, half_width, corners.lower[0])]
    for side in (-1, 1):
        # A rib reaches inwards from the outside of the tray, a rail from the edge of the roof.
        edge, rail_edge = y + side * tray_half_width_mm(fold_mirror), y + side * half_width
        parts.append(_rib(mount, corners, _ordered(edge, edge - side * mount.wall_mm)))
        parts.append(_rail(mount, corners.lower[0], _ordered(rail_edge, rail_edge - side * mount.wall_mm)))
    return single_solid(parts, "fold_bracket", "look at mount.fold_anchor_mm and fold_mirror")


def tray_corners(fold_mirror: FoldMirror, mount: Mount, layout: Layout) -> TrayCorners:
    """Where the back of M1's tray ends above and below."""
    back = -tray_depth_mm(fold_mirror, mount.wall_mm)
    points = np.array([[0, fold_mirror.height_mm / 2, back], [0, -tray_foot_mm(fold_mirror), back]])
    upper, lower = 1000 * layout.body_from_m1.apply(points / 1000)
    return TrayCorners(upper=(float(upper[0]), float(upper[2])), lower=(float(lower[0]), float(lower[2])))


def _check_anchor(mount: Mount, layout: Layout, corners: TrayCorners) -> None:
    x, y, z = mount.fold_anchor_mm
    plane = float(1000 * layout.body_from_m1.translation[1])
    if abs(y - plane) > ALIGNMENT_MM:
        raise ValueError(
            f"mount.fold_anchor_mm = {mount.fold_anchor_mm}: expected y = {plane:g}, as the camera has, got y = {y:g}"
        )
    if z < corners.upper[1]:
        raise ValueError(
            f"mount.fold_anchor_mm = {mount.fold_anchor_mm}: expected z of at least {corners.upper[1]:.1f}, the top of "
            f"M1's tray, so that the roof is above it, got z = {z:g}"
        )
    if x + FLANGE_LENGTH_MM / 2 > corners.lower[0]:
        raise ValueError(
            f"mount.fold_anchor_mm = {mount.fold_anchor_mm}: expected x of at most "
            f"{corners.lower[0] - FLANGE_LENGTH_MM / 2:.1f}, behind the front of M1, got x = {x:g}"
        )


def _ordered(first: float, second: float) -> tuple[float, float]:
    return min(first, second), max(first, second)


def _roof(mount: Mount, y: float, half_width: float, front: float) -> Part:
    """Plate from the flange, which is its rear end, to the front of M1."""
    anchor_x, _, low = mount.fold_anchor_mm
    high = low + mount.wall_mm
    roof = box((anchor_x - FLANGE_LENGTH_MM / 2, front), (y - half_width, y + half_width), (low, high))
    roof = roof.fillet(6, roof.edges().filter_by(lambda edge: abs(edge.tangent_at(0.5).Z) > 0.5))
    for dx in (-FLANGE_HOLES_MM[0], FLANGE_HOLES_MM[0]):
        for dy in (-FLANGE_HOLES_MM[1], FLANGE_HOLES_MM[1]):
            place = (anchor_x + dx, y + dy)
            roof -= cylinder((*place, low - 1), (*place, high + 1), FLANGE_HOLE_DIAMETER_MM / 2)
    return roof


def _rib(mount: Mount, corners: TrayCorners, limits: tuple[float, float]) -> Part:
    """Plate between tray and roof, with a hole that spares weight and lets the water through."""
    roof = mount.fold_anchor_mm[2] + mount.wall_mm / 2
    # Half a wall into the tray's floor: solids that only touch do not become one.
    inset = mount.wall_mm / 2 / 2**0.5
    upper = (corners.upper[0] - inset, corners.upper[1] - inset)
    lower = (corners.lower[0] - inset, corners.lower[1] - inset)
    front = (corners.lower[0], corners.lower[1])
    rib = along_y([upper, (upper[0], roof), (front[0], roof), front, lower], limits)
    width, height = front[0] - upper[0], roof - front[1]
    radius = (width + height - hypot(width, height)) / 2
    centre = (front[0] - radius, roof - radius)
    hole = cylinder((centre[0], limits[0] - 1, centre[1]), (centre[0], limits[1] + 1, centre[1]), 0.55 * radius)
    return rib - hole


def _rail(mount: Mount, front: float, limits: tuple[float, float]) -> Part:
    """Upstand along an edge of the roof, which would bend without it."""
    anchor_x, _, low = mount.fold_anchor_mm
    foot, top = low + mount.wall_mm / 2, low + mount.wall_mm + RAIL_HEIGHT_MM
    start, end = anchor_x - FLANGE_LENGTH_MM / 2 + 6, front - 6
    slope = RAIL_HEIGHT_MM
    return along_y([(start, foot), (end, foot), (end - slope, top), (start + slope, top)], limits)
