"""A sheet for one part: three views in first-angle projection, an image, overall size, and a table of its holes."""

from __future__ import annotations

from itertools import groupby
from string import ascii_uppercase

import numpy as np
from build123d import Solid

from cad.export.drawings.projection import FRONT, ISOMETRIC, LEFT, TOP, Hole, Outline, View, holes, outline
from cad.export.drawings.sheet import (
    HEIGHT_MM,
    MARGIN_MM,
    SMALL_TEXT_MM,
    THIN_MM,
    TITLE_MM,
    WIDTH_MM,
    Sheet,
    Title,
    at,
    largest_scale,
    scale_name,
)
from optics.kernels.arrays import FloatArray

GAP_MM = 24.0
"""Between views, for the dimensions."""
TABLE_WIDTHS_MM = (10.0, 13.0, 13.0, 22.0, 13.0, 13.0, 13.0)
HEAD = ("hole", "⌀", "deep", "along", "x", "y", "z")
MOST_ROWS = 46


def draw_part(solid: Solid, *, rig: str, name: str, material: str, rig_hash: str, origin: FloatArray | None) -> Sheet:
    """Sheet of a part.

    Parameters
    ----------
    solid : Solid
        In the frame whose axes the views look along, millimetres.
    rig, name, material, rig_hash : str
        For the title block.
    origin : array, shape (3,), or None
        Where holes are measured from: the crossing of the joint axes for a part that turns; None for the corner of
        its box with the smallest coordinates.
    """
    box = solid.bounding_box()
    low, high = np.array(tuple(box.min)), np.array(tuple(box.max))
    size = high - low
    datum = low if origin is None else origin
    room = np.array([WIDTH_MM - 2 * MARGIN_MM - sum(TABLE_WIDTHS_MM) - 8, HEIGHT_MM - 2 * MARGIN_MM]) - 2.2 * GAP_MM
    scale = largest_scale([size[0] + size[1], size[2] + size[1]], room)
    note = "holes from the marked corner" if origin is None else "holes from where the joint axes cross"
    title = Title(rig=rig, name=name, material=material, scale=scale_name(scale), rig_hash=rig_hash, note=note)
    sheet = Sheet(title)
    left = MARGIN_MM + GAP_MM
    top = HEIGHT_MM - MARGIN_MM - GAP_MM
    front = np.array([left, top - scale * size[2]])
    corners = {
        FRONT: front,
        LEFT: front + at(scale * size[0] + GAP_MM, 0),
        TOP: front - at(0, scale * size[1] + GAP_MM),
    }
    found = named(holes(solid))
    for view, corner in corners.items():
        shift = corner - scale * view.project([low, high]).min(axis=0)
        draw_outline(sheet, outline([solid], view, hidden=True), scale, shift)
        _mark_holes(sheet, found, view, scale, shift)
        _mark_datum(sheet, view.project(datum) * scale + shift)
    _overall(sheet, size, scale, corners)
    _image(sheet, solid, left + scale * size[0] + GAP_MM / 2, front[1] - GAP_MM / 2)
    _hole_table(sheet, found, datum)
    return sheet


def draw_outline(sheet: Sheet, lines: Outline, scale: float, shift: FloatArray) -> None:
    """Draw a projected shape at a scale, `shift` being where the origin of its frame is on paper."""
    hidden = [scale * line + shift for line in lines.hidden]
    sheet.lines(hidden, width_mm=THIN_MM, linestyle=(0, (6, 3)), edgecolor="#777777")
    sheet.lines([scale * line + shift for line in lines.visible])


def named(found: list[Hole]) -> list[tuple[str, Hole]]:
    """Holes with names: a letter for each diameter and direction, and a number when there are several."""
    pairs = []
    for position, (_, alike) in enumerate(groupby(found, key=_kind)):
        members = list(alike)
        letter = ascii_uppercase[position % 26] * (1 + position // 26)
        pairs += [
            (letter if len(members) == 1 else f"{letter}{number}", hole) for number, hole in enumerate(members, 1)
        ]
    return pairs


def _kind(hole: Hole) -> tuple[float, ...]:
    return tuple(float(value) for value in np.round([hole.diameter_mm, *hole.axis], 2) + 0.0)


def _mark_holes(sheet: Sheet, found: list[tuple[str, Hole]], view: View, scale: float, shift: FloatArray) -> None:
    """Centre marks in the view that looks along the hole; concentric holes share a mark."""
    labels: dict[tuple[float, ...], tuple[float, list[str]]] = {}
    for name, hole in found:
        if abs(hole.axis @ view.towards_observer) > 0.999:
            place = tuple(float(value) for value in np.round(scale * view.project(hole.mouth) + shift, 3))
            radius, names = labels.get(place, (0.0, []))
            labels[place] = (max(radius, scale * hole.diameter_mm / 2), [*names, name])
    for place, (radius, names) in labels.items():
        sheet.centre_mark(place, radius, " ".join(names))


def _mark_datum(sheet: Sheet, place: FloatArray) -> None:
    sheet.ring(place, 1.6, edgecolor="#b3261e")
    cross = [np.array([place - arm, place + arm]) for arm in 2.6 * np.eye(2)]
    sheet.lines(cross, width_mm=THIN_MM, edgecolor="#b3261e")


def _overall(sheet: Sheet, size: FloatArray, scale: float, corners: dict[View, FloatArray]) -> None:
    width, depth, height = scale * size
    front, left = corners[FRONT], corners[LEFT]
    above = front[1] + height + 0.4 * GAP_MM
    sheet.distance(front + at(0, height), front + at(width, height), f"x {size[0]:.1f}", line=above)
    sheet.distance(left + at(0, height), left + at(depth, height), f"y {size[1]:.1f}", line=above)
    sheet.distance(front, front + at(0, height), f"z {size[2]:.1f}", line=front[0] - 0.4 * GAP_MM, along="y")


def _image(sheet: Sheet, solid: Solid, left: float, ceiling: float) -> None:
    """Isometric image, not to scale, in the corner that the three views leave free."""
    lines = outline([solid], ISOMETRIC)
    points = np.vstack(lines.visible)
    low, high = points.min(axis=0), points.max(axis=0)
    right = WIDTH_MM - MARGIN_MM - sum(TABLE_WIDTHS_MM) - 8
    over_title = right > WIDTH_MM - MARGIN_MM - TITLE_MM[0]
    floor = MARGIN_MM + 5 + (TITLE_MM[1] if over_title else 0)
    room = np.array([right - left, ceiling - floor])
    factor = float(min(room / (high - low)))
    draw_outline(sheet, lines, factor, np.array([left, ceiling]) - factor * np.array([low[0], high[1]]))


def _hole_table(sheet: Sheet, found: list[tuple[str, Hole]], datum: FloatArray) -> None:
    if not found:
        return
    rows: list[tuple[str, ...]] = [HEAD]
    for name, hole in found[:MOST_ROWS]:
        x, y, z = np.round(hole.mouth - datum, 2) + 0.0
        rows.append(
            (
                name,
                f"{hole.diameter_mm:.1f}",
                f"{hole.depth_mm:.1f}",
                _direction(hole.axis),
                f"{x:.1f}",
                f"{y:.1f}",
                f"{z:.1f}",
            )
        )
    corner = (WIDTH_MM - MARGIN_MM - sum(TABLE_WIDTHS_MM) - 3, HEIGHT_MM - MARGIN_MM - 3)
    bottom = sheet.table(corner, TABLE_WIDTHS_MM, rows, numbers=(1, 2, 4, 5, 6))
    if len(found) > MOST_ROWS:
        words = f"and {len(found) - MOST_ROWS} more: see the STEP file"
        sheet.text((corner[0], bottom - 3), words, size_mm=SMALL_TEXT_MM)


def _direction(axis: FloatArray) -> str:
    for name, unit in zip("xyz", np.eye(3), strict=True):
        if axis @ unit > 0.9999:
            return name
    return "(" + " ".join(f"{value:.2f}" for value in np.round(axis, 2) + 0.0) + ")"
