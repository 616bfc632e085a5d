"""A sheet for the whole mount: three views with the hull in grey, the distances that matter, and a list of parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from build123d import Solid

from cad.assembly.assembly import Assembly
from cad.export.drawings.bill_of_materials import Item
from cad.export.drawings.part_drawing import draw_outline
from cad.export.drawings.projection import FRONT, ISOMETRIC, LEFT, TOP, View, outline
from cad.export.drawings.sheet import (
    HEIGHT_MM,
    MARGIN_MM,
    THIN_MM,
    TITLE_MM,
    WIDTH_MM,
    Sheet,
    Title,
    at,
    largest_scale,
    scale_name,
)
from cad.shapes import location_mm
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mesh import PartMesh, Role

GAP_MM = 22.0
LIST_WIDTHS_MM = (12.0, 118.0, 14.0)
AROUND_MM = 8.0
"""How much of the hull is shown around the mount, on paper."""
MOST_ROWS = 30
SPREAD_POINTS = 4000
CELL_MM = 3.0
FEWEST_CELLS = 2
"""Parts that show less than this get no pointer."""


def draw_assembly(assembly: Assembly, items: Sequence[Item], *, rig_hash: str) -> Sheet:
    """Sheet of the mount at q1 = q2 = 0, in the mount frame: its views look along and across the camera's view."""
    mount, hull = _placed(assembly)
    boxes = [solid.bounding_box() for solid in mount]
    low = np.min([tuple(box.min) for box in boxes], axis=0)
    high = np.max([tuple(box.max) for box in boxes], axis=0)
    size = high - low
    room = np.array([WIDTH_MM - 2 * MARGIN_MM - sum(LIST_WIDTHS_MM) - 6, HEIGHT_MM - 2 * MARGIN_MM]) - 2 * GAP_MM - 4
    scale = largest_scale([size[0] + size[1], size[2] + size[1]], room)
    sheet = Sheet(
        Title(
            rig=assembly.rig.name,
            name="assembly",
            material=f"printed parts: {assembly.rig.require_gaze().mount.material.upper()}",
            scale=scale_name(scale),
            rig_hash=rig_hash,
            note=_note(assembly.layout),
        )
    )
    front = np.array([MARGIN_MM + GAP_MM, HEIGHT_MM - MARGIN_MM - GAP_MM - scale * size[2]])
    corners = {
        FRONT: front,
        LEFT: front + at(scale * size[0] + GAP_MM, 0),
        TOP: front - at(0, scale * size[1] + GAP_MM),
    }
    shifts: dict[View, FloatArray] = {}
    for view, corner in corners.items():
        projected = view.project([low, high])
        shifts[view] = corner - scale * projected.min(axis=0)
        extent = scale * np.ptp(projected, axis=0)
        place = _Place(scale=scale, shift=shifts[view])
        _draw_hull(sheet, hull, view, place, corner=corner, extent=extent)
        draw_outline(sheet, outline(mount, view), scale, shifts[view])
    _overall(sheet, size, scale, corners)
    right = front[0] + scale * size[0]
    front_place = _Place(scale=scale, shift=shifts[FRONT])
    _axes_and_distances(sheet, assembly.layout, front_place, right=right, bottom=front[1])
    below = _list(sheet, items)
    _image(sheet, assembly, items, ceiling=below)
    return sheet


def _note(layout: Layout) -> str:
    turned = layout.body_from_mount.rotation.magnitude() > 0
    axes = "; x along the camera's view, z image-up" if turned else ""
    return f"q1 = q2 = 0; the joint axes cross in the middle of M2; hull in grey, broken off{axes}"


@dataclass(frozen=True, kw_only=True)
class _Place:
    """Scale of a view and where the origin of its frame is on paper."""

    scale: float
    shift: FloatArray


def _placed(assembly: Assembly) -> tuple[list[Solid], list[Solid]]:
    """Solids of the mount and of the hull in the mount frame; a hull that is only a mesh is left out."""
    mount_from_body = location_mm(assembly.layout.body_from_mount).inverse()
    mount: list[Solid] = []
    hull: list[Solid] = []
    for part in assembly.parts:
        if isinstance(part.solid, trimesh.Trimesh):
            continue
        placed = mount_from_body * (location_mm(assembly.pose(part, 0.0, 0.0)) * part.solid)
        (hull if part.role is Role.HULL else mount).append(placed)
    return mount, hull


def _draw_hull(
    sheet: Sheet, hull: list[Solid], view: View, place: _Place, *, corner: FloatArray, extent: FloatArray
) -> None:
    if not hull:
        return
    lines = [place.scale * line + place.shift for line in outline(hull, view).visible]
    window = (corner - AROUND_MM, corner + extent + AROUND_MM)
    sheet.lines(lines, width_mm=THIN_MM, edgecolor="#9a9a9a", window=window)


def _overall(sheet: Sheet, size: FloatArray, scale: float, corners: dict[View, FloatArray]) -> None:
    width, depth, height = scale * size
    front, left = corners[FRONT], corners[LEFT]
    above = front[1] + height + 0.55 * GAP_MM
    sheet.distance(front + at(0, height), front + at(width, height), f"x {size[0]:.1f}", line=above)
    sheet.distance(left + at(0, height), left + at(depth, height), f"y {size[1]:.1f}", line=above)
    sheet.distance(front, front + at(0, height), f"z {size[2]:.1f}", line=front[0] - 0.7 * GAP_MM, along="y")


def _axes_and_distances(sheet: Sheet, layout: Layout, place: _Place, *, right: float, bottom: float) -> None:
    """Optical axis from pinhole over M1 to M2, both joint axes, and d1 and d2, in the front view."""
    mount_from_body = layout.body_from_mount.inv()
    poses = (layout.body_from_camera, layout.body_from_m1, layout.body_from_gimbal)
    points = 1000 * mount_from_body.apply([pose.translation for pose in poses])
    pinhole, m1, m2 = (place.scale * FRONT.project(point) + place.shift for point in points)
    sheet.lines([np.array([pinhole, m1, m2])], width_mm=THIN_MM, edgecolor="#0b4f9c")
    axis = layout.body_from_gimbal.rotation.apply([0.0, 0.0, 1.0])
    pan = FRONT.project(mount_from_body.rotation.apply(axis))
    sheet.axis_line(m2 + 12 * pan, m2 - (m2[1] - bottom + 4) * pan)
    places = ((pinhole, [-5, 9], "pinhole"), (m1, [6, 14], "M1"), (m2, [-8, 12], "M2"))
    for tip, beside, words in places:
        sheet.leader(tip, tip + np.array(beside), words)
    d1 = 1000 * float(np.linalg.norm(poses[1].translation - poses[0].translation))
    d2 = 1000 * float(np.linalg.norm(poses[2].translation - poses[1].translation))
    sheet.distance(pinhole, m1, f"d1 {d1:.1f}", line=bottom - 0.45 * GAP_MM)
    sheet.distance(m1, m2, f"d2 {d2:.1f}", line=right + 0.45 * GAP_MM, along="y")


def _list(sheet: Sheet, items: Sequence[Item]) -> float:
    """List of parts; returns the height of its lower edge."""
    rows = [("no.", "part", "count")]
    rows += [(str(number), item.name, str(item.count)) for number, item in enumerate(items[:MOST_ROWS], 1)]
    corner = (WIDTH_MM - MARGIN_MM - sum(LIST_WIDTHS_MM) - 3, HEIGHT_MM - MARGIN_MM - 3)
    return sheet.table(corner, LIST_WIDTHS_MM, rows, numbers=(0, 2))


def _image(sheet: Sheet, assembly: Assembly, items: Sequence[Item], *, ceiling: float) -> None:
    """Isometric image below the list, its parts numbered as there."""
    mount, _ = _placed(assembly)
    lines = outline(mount, ISOMETRIC)
    points = np.vstack(lines.visible)
    low, high = points.min(axis=0), points.max(axis=0)
    left, right = WIDTH_MM - MARGIN_MM - sum(LIST_WIDTHS_MM) + 14, WIDTH_MM - MARGIN_MM - 14
    floor = MARGIN_MM + TITLE_MM[1] + 4
    room = np.array([right - left, ceiling - floor - 6])
    factor = float(min(room / (high - low)))
    shift = np.array([(left + right) / 2, floor]) - factor * np.array([(low[0] + high[0]) / 2, low[1]])
    draw_outline(sheet, lines, factor, shift)
    seen = visible_places(assembly, [mesh for mesh in assembly.meshes if mesh.role is not Role.HULL], ISOMETRIC)
    tips = [
        (number, factor * seen[name] + shift)
        for number, item in enumerate(items, 1)
        # One of several alike, the first that shows.
        for name in [name for name in item.parts if name in seen][:1]
    ]
    _balloons(sheet, tips, (left - 8, right + 8), (floor + 2, ceiling - 8))


def visible_places(assembly: Assembly, meshes: Sequence[PartMesh], view: View) -> dict[str, FloatArray]:
    """Where a pointer to a part may point, in the view's coordinates; parts that do not show are left out.

    Points spread over all surfaces are sorted into cells on paper; the nearest of each cell is what is seen there.
    """
    points, mount_from_body = [], assembly.layout.body_from_mount.inv()
    for mesh in meshes:
        surface = trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False)
        spread, _ = trimesh.sample.sample_surface(surface, SPREAD_POINTS, seed=0)
        in_body = assembly.pose(assembly.part(mesh.name), 0.0, 0.0).apply(spread)
        points.append(1000 * mount_from_body.apply(in_body))
    places = view.project(np.vstack(points))
    depth = np.vstack(points) @ view.towards_observer
    owner = np.repeat(np.arange(len(meshes)), SPREAD_POINTS)
    nearest_first = np.argsort(-depth, kind="stable")
    cells = np.floor(places / CELL_MM).astype(int)
    _, first = np.unique(cells[nearest_first], axis=0, return_index=True)
    shown = nearest_first[first]
    found = {}
    for number, mesh in enumerate(meshes):
        own = places[shown[owner[shown] == number]]
        if len(own) >= FEWEST_CELLS:
            found[mesh.name] = own[np.linalg.norm(own - np.median(own, axis=0), axis=1).argmin()]
    return found


def _balloons(
    sheet: Sheet, tips: Sequence[tuple[int, FloatArray]], columns: tuple[float, float], heights: tuple[float, float]
) -> None:
    """Numbers in two columns, each at the side its part is nearer to, in the order of height: few lines cross."""
    order = sorted(tips, key=lambda tip: float(tip[1][0]))
    sides = (order[: len(order) // 2], order[len(order) // 2 :])
    for column, members in zip(columns, sides, strict=True):
        rising = sorted(members, key=lambda tip: float(tip[1][1]))
        for height, (number, tip) in zip(np.linspace(*heights, len(rising) + 2)[1:-1], rising, strict=True):
            sheet.balloon(tip, (column, float(height)), number)
