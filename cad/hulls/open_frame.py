"""The hull of an open-frame ROV: panels, cross bars and a tube on cradles; all but its overall size is nominal."""

from __future__ import annotations

from build123d import Axis, Part

from cad.hulls.port_boss import front_mm
from cad.shapes import Limits, box, cylinder
from rigs import Mount, OpenFrameHull, Port

BAR_LENGTH_MM = 70.0
FRONT_SETBACK_MM = 30.0
"""The bottom panel stops short of the front, where the gaze mirror looks up."""
REAR_MARGIN_MM = 25.0
OVERLAP_MM = 1.0
"""Pieces go into each other by this much: solids that only touch do not become one."""


def open_frame(hull: OpenFrameHull, mount: Mount, port: Port, pinhole_mm: tuple[float, float, float]) -> Part:
    """Frame, tube and cradles in the body frame, millimetres, without the port's boss."""
    return _frame(hull, mount) + _tube(hull, port, pinhole_mm)


def _frame(hull: OpenFrameHull, mount: Mount) -> Part:
    length, width, height = hull.length_mm / 2, hull.width_mm / 2, hull.height_mm / 2
    panel = hull.panel_thickness_mm
    between = (-width + panel - OVERLAP_MM, width - panel + OVERLAP_MM)
    frame = _side_panel(hull, (width - panel, width)) + _side_panel(hull, (-width, -width + panel))
    frame += box((-length, length - FRONT_SETBACK_MM), between, (-height, -height + panel))
    for centre in (mount.fold_anchor_mm[0], -length + REAR_MARGIN_MM + BAR_LENGTH_MM / 2):
        reach = (max(-length, centre - BAR_LENGTH_MM / 2), min(length, centre + BAR_LENGTH_MM / 2))
        frame += box(reach, between, (height - panel, height))
    return frame


def _side_panel(hull: OpenFrameHull, limits: Limits) -> Part:
    """Panel with two windows, all corners round."""
    length, height = hull.length_mm / 2, hull.height_mm / 2
    panel = box((-length, length), limits, (-height, height))
    panel = panel.fillet(height / 5, panel.edges().filter_by(Axis.Y))
    for middle in (-0.45 * length, 0.45 * length):
        window = box(
            (middle - 0.33 * length, middle + 0.33 * length),
            (limits[0] - 1, limits[1] + 1),
            (-0.5 * height, 0.5 * height),
        )
        panel -= window.fillet(height / 8, window.edges().filter_by(Axis.Y))
    return panel


def _tube(hull: OpenFrameHull, port: Port, pinhole_mm: tuple[float, float, float]) -> Part:
    """Watertight tube around the camera's axis on two cradles that stand on the bottom panel."""
    x, y, z = pinhole_mm
    rear, front = -hull.length_mm / 2 + REAR_MARGIN_MM, x + front_mm(port)
    if front <= rear:
        raise ValueError(f"camera.position_mm = {pinhole_mm}: expected x above {rear:g}, got {x:g}")
    tube = cylinder((rear, y, z), (front, y, z), hull.tube_diameter_mm / 2)
    foot = -hull.height_mm / 2 + OVERLAP_MM
    half_width, half_panel = 0.35 * hull.tube_diameter_mm, hull.panel_thickness_mm / 2
    for middle in (0.75 * rear + 0.25 * front, 0.25 * rear + 0.75 * front):
        cradle = (middle - half_panel, middle + half_panel)
        tube += box(cradle, (y - half_width, y + half_width), (foot, z))
    return tube
