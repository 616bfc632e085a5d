"""Mirror plates and the cells that hold them, in the mirror's frame.

The frame is the optical one: origin at the centre of the reflecting face, z its outward normal, y up the face. A cell
is a tray with lips over the side edges. The face lies against the lips, which so define the mirror's plane whatever the
plate's thickness; behind the plate is a bed of silicone, or of neoprene strip where a clip closes the upper edge.

An octagon and an ellipse have the same tray but for pocket and lips: it is an octagon, which holds the ellipse of the
same sides. The plate slides in over its widest place, so that walls and lips end where the octagon's upper cuts begin.
"""

from __future__ import annotations

from math import hypot
from typing import Literal

from build123d import Axis, Ellipse, Part, Pos, Solid, extrude

from cad.parts.hardware import Hardware, counterbored_hole, head_height_mm, insert, insert_hole, screw_in_insert
from cad.parts.mirror_sides import BOND_HOLE_DIAMETER_MM, smallest_side_mm
from cad.shapes import Limits, along_z, box, cylinder, single_solid
from optics.mesh import Group
from optics.mirror_outline import OUTLINES, Centred, Octagon
from rigs import FoldMirror
from rigs.gaze import FlatMirror

Fixing = Literal["glue", "screws"]

FIT_MM = 0.2
"""Gap of every designed fit: what a printed pocket needs around the piece that goes into it."""
THICKNESS_LIMITS_MM = (1.5, 6.0)
"""Thinner plates of this size bend or break, thicker ones are heavier than the lips and the servos are made for."""
BED_MM = 0.5
"""Between the plate and the floor: what silicone needs to stay elastic, or a strip of neoprene when pressed."""
RIM_MM = 2.0
LIP_OVERLAP_MM = 1.5
LIP_THICKNESS_MM = 1.2
VENT_DIAMETER_MM = 4.0
SMALLEST_VENT_INSET_MM = 5.0
FRAME_MM = 16.0
"""Width of a framed tray's floor, from the mirror's edges inwards."""
SMALLEST_WINDOW_MM = 12.0
"""Through which a nozzle of silicone reaches the edges."""
FAR_BEHIND_MM = 100.0
HEAD_MM = 9.0
"""How far the floor reaches beyond the mirror's upper edge to carry the clip."""
CLIP_SEAT_MM = 1.7
"""Left under the head of a clip's screw."""
SMALLEST_HEAD_HALF_WIDTH_MM = 16.0
"""Of the tray's head: room for two screws."""
CLIP_SCREW_PITCH_MM = 70.0
"""Largest distance between two screws of a clip."""


def mirror_plate(mirror: FlatMirror) -> Solid:
    """Mirror plate, its reflecting face in z = 0; millimetres."""
    return _filled(mirror, 0.0, (-mirror.thickness_mm, 0.0)).solid()


def tray_depth_mm(mirror: FlatMirror, wall_mm: float) -> float:
    """From the reflecting face to the back of the tray."""
    return mirror.thickness_mm + BED_MM + wall_mm


def tray_half_width_mm(mirror: FlatMirror) -> float:
    """From the middle of the mirror to the outside of the tray's side walls."""
    return mirror.width_mm / 2 + FIT_MM + RIM_MM


def tray_foot_mm(mirror: FlatMirror) -> float:
    """From the middle of the mirror down to the outside of the rim on which its lower edge stands."""
    return mirror.height_mm / 2 + FIT_MM + RIM_MM


def tray_head_mm(mirror: FlatMirror, fixing: Fixing) -> float:
    """From the middle of the mirror up to the upper end of the tray."""
    return mirror.height_mm / 2 + (HEAD_MM if fixing == "screws" else 0.0)


def tray_straight_mm(mirror: FlatMirror) -> float:
    """From the middle of the mirror up and down to the ends of the tray's straight side walls."""
    return mirror.height_mm / 2 - _leg_mm(mirror)


def cell_front_mm(mirror: FlatMirror, fixing: Fixing) -> float:
    """How far the lips, or the clip, stand in front of the reflecting face."""
    return _clip_top(mirror) if fixing == "screws" else LIP_THICKNESS_MM


def cell_radius_mm(mirror: FlatMirror, wall_mm: float, fixing: Fixing) -> float:
    """Radius of the cylinder about the mirror's x axis that a turning cell sweeps."""
    depth, front = tray_depth_mm(mirror, wall_mm), cell_front_mm(mirror, fixing)
    strip = _strip_mm(wall_mm) if fixing == "screws" else 0.0
    return max(hypot(tray_foot_mm(mirror), max(depth, front)), hypot(tray_head_mm(mirror, fixing), depth + strip))


def mirror_tray(mirror: FlatMirror, wall_mm: float, fixing: Fixing = "glue", framed: bool = False) -> Part:
    """Tray that a mirror slides into from its upper edge.

    A lip of 1.5 mm holds the two side edges, and the lower edge stands on a rim that is flush with the face. It goes on
    over an octagon's lower cuts, and follows an ellipse. Glued, the
    mirror is bonded through the holes in the floor; screwed, a clip closes the upper edge. Small holes at the corners
    let the air out from behind the plate in whatever attitude the tray dives. A framed tray has a window in its floor
    instead of the holes, and the mirror is bonded along the window's edges.

    Raises
    ------
    ValueError
        For a plate that is too small, too thin or too thick for a cell.
    """
    _check(mirror)
    half_width, half_height = mirror.width_mm / 2, mirror.height_mm / 2
    back, floor = -tray_depth_mm(mirror, wall_mm), -(mirror.thickness_mm + BED_MM)
    outside, foot = tray_half_width_mm(mirror), tray_foot_mm(mirror)
    beyond = tray_head_mm(mirror, fixing) + 1
    tray = _tray_block(mirror, beyond - 1, (back, LIP_THICKNESS_MM))
    # A mirror is as wide as its pocket down to where its outline begins to narrow.
    widest = {"rectangle": -half_height - FIT_MM, "octagon": -tray_straight_mm(mirror), "ellipse": 0.0}[mirror.outline]
    cuts = [box((-half_width - FIT_MM, half_width + FIT_MM), (widest, beyond), (floor, 0))]
    free = half_width - LIP_OVERLAP_MM - _leg_mm(mirror)
    cuts.append(box((-free, free), (-foot - 1, beyond), (0, LIP_THICKNESS_MM + 1)))
    upper = (tray_straight_mm(mirror), beyond)
    cuts.append(box((-outside - 1, outside + 1), upper, (floor, LIP_THICKNESS_MM + 1)))
    if mirror.outline != "rectangle":
        cuts.append(_filled(mirror, FIT_MM, (floor, 0)))
        cuts.append(_filled(mirror, -LIP_OVERLAP_MM, (0, LIP_THICKNESS_MM + 1)))
    bonds, vents = _bond_holes(mirror), _vents(mirror, max(SMALLEST_VENT_INSET_MM, wall_mm + 1))
    if framed and (window := _window(mirror, fixing)):
        cuts.append(window)
        bonds = []
        if _runs_out(mirror, fixing):
            # Beside a window that is open to the edge where the mirror slides in air gets out there.
            vents = [place for place in vents if place[1] < 0]
    for radius, places in ((BOND_HOLE_DIAMETER_MM / 2, bonds), (VENT_DIAMETER_MM / 2, vents)):
        cuts += [cylinder((*place, back - 1), (*place, floor + 1), radius) for place in places]
    if fixing == "glue":
        return tray.cut(*cuts)
    strip = _strip_mm(wall_mm)
    if strip > 0:
        end = tray_head_half_width_mm(mirror) - RIM_MM
        tray += box((-end, end), (half_height - 2, beyond - 1), (back - strip, back + 0.5))
    cuts += [insert_hole("M3", (x, y, floor), (0, 0, -1), wall_mm + strip) for x, y in clip_screws(mirror, wall_mm)]
    return tray.cut(*cuts)


def clip_screws(mirror: FlatMirror, wall_mm: float) -> list[tuple[float, float]]:
    """Where the screws of a clip are, as (x, y) of the mirror's frame: at its ends, and between them in a long one.

    Those at the ends stay beside the ribs that carry the tray, which are a wall thick.
    """
    margin = max(HEAD_MM, wall_mm + insert("M3").hole_diameter_mm / 2 + insert("M3").wall_mm)
    reach = max(tray_head_half_width_mm(mirror) - margin, 0.0)
    y = mirror.height_mm / 2 + (FIT_MM + HEAD_MM) / 2
    gaps = max(1, -int(-2 * reach // CLIP_SCREW_PITCH_MM))
    return [(-reach + 2 * reach * step / gaps, y) for step in range(gaps + 1)]


def mirror_clip(mirror: FlatMirror, wall_mm: float) -> Solid:
    """Bar on the tray's head that keeps the mirror from sliding out and holds its upper edge down, in place."""
    half_width, half_height = mirror.width_mm / 2, mirror.height_mm / 2
    floor, top = -(mirror.thickness_mm + BED_MM), _clip_top(mirror)
    outside = tray_head_half_width_mm(mirror)
    bar = box((-outside, outside), (half_height + FIT_MM, half_height + HEAD_MM), (floor, top))
    bar = bar.fillet(RIM_MM, bar.edges().filter_by(Axis.Z).group_by(Axis.Y)[-1])
    free = half_width - LIP_OVERLAP_MM - FIT_MM - _leg_mm(mirror)
    lip = box((-free, free), (half_height - LIP_OVERLAP_MM, half_height + FIT_MM + 1), (0, LIP_THICKNESS_MM))
    cuts = [
        counterbored_hole("M3", (x, y, floor + CLIP_SEAT_MM), (0, 0, 1), top - floor, CLIP_SEAT_MM + 1)
        for x, y in clip_screws(mirror, wall_mm)
    ]
    return (
        single_solid([bar, lip], f"{_section(mirror)}.width_mm, of its clip", "look at mount.mirror_fixing too")
        .cut(*cuts)
        .solid()
    )


def clip_hardware(mirror: FlatMirror, wall_mm: float, name: str, group: Group) -> list[Hardware]:
    """Screws and inserts of a clip, in the mirror's frame."""
    seat = -(mirror.thickness_mm + BED_MM) + CLIP_SEAT_MM
    depth = wall_mm + _strip_mm(wall_mm)
    return [
        piece
        for count, (x, y) in enumerate(clip_screws(mirror, wall_mm), start=1)
        for piece in screw_in_insert(f"{name}_clip_{count}", group, "M3", (x, y, seat), (0, 0, 1), CLIP_SEAT_MM, depth)
    ]


def tray_head_half_width_mm(mirror: FlatMirror) -> float:
    """From the middle of the mirror to the ends of the tray's head and of the clip on it."""
    least = min(SMALLEST_HEAD_HALF_WIDTH_MM, tray_half_width_mm(mirror))
    return max(tray_half_width_mm(mirror) - _leg_mm(mirror), least)


def _outline_mm(mirror: FlatMirror, growth_mm: float, name: str | None = None) -> Centred:
    """Outline of a mirror in millimetres, wider all around; or another of its sides."""
    sides = {"half_width": mirror.width_mm / 2 + growth_mm, "half_height": mirror.height_mm / 2 + growth_mm}
    return OUTLINES[name or mirror.outline](**sides)


def _filled(mirror: FlatMirror, growth_mm: float, limits: Limits) -> Part:
    """A mirror's outline, wider all around, between levels."""
    outline = _outline_mm(mirror, growth_mm)
    w, h = outline.half_width, outline.half_height
    if mirror.outline == "rectangle":
        return box((-w, w), (-h, h), limits)
    if mirror.outline == "octagon":
        return along_z([(float(x), float(y)) for x, y in outline.rim()], limits)
    return extrude(Pos(0, 0, limits[0]) * Ellipse(w, h), amount=limits[1] - limits[0], dir=(0, 0, 1))


def _leg_mm(mirror: FlatMirror) -> float:
    """How much of each corner's sides the tray lacks: nothing of a rectangle's, an octagon's cut of the others'."""
    octagon = _outline_mm(mirror, 0.0, "octagon")
    return 0.0 if mirror.outline == "rectangle" or not isinstance(octagon, Octagon) else float(octagon.leg_m)


def _tray_block(mirror: FlatMirror, head: float, limits: Limits) -> Part:
    """The tray before anything is cut out of it, up to its head."""
    outside, foot = tray_half_width_mm(mirror), tray_foot_mm(mirror)
    if mirror.outline == "rectangle":
        block = box((-outside, outside), (-foot, head), limits)
        return block.fillet(RIM_MM, block.edges().filter_by(Axis.Z))
    rim = _outline_mm(mirror, FIT_MM + RIM_MM, "octagon").rim()
    block = along_z([(float(x), float(y)) for x, y in rim], limits)
    end, top = tray_head_half_width_mm(mirror), mirror.height_mm / 2
    block &= box((-outside, outside), (-foot, top), limits)
    return block + box((-end, end), (top - RIM_MM, head), limits) if head > top else block


def _bond_holes(mirror: FlatMirror) -> list[Limits]:
    """Where the mirror is bonded through the floor."""
    x, y = mirror.width_mm / 4, mirror.height_mm / 4
    return [(side * x, end * y) for side in (-1, 1) for end in (-1, 1)]


def _vents(mirror: FlatMirror, inset_mm: float) -> list[Limits]:
    """Where air gets out: at the corners, which of an ellipse are the octagon's around it, on its own rim."""
    rim = _outline_mm(mirror, -inset_mm).rim(8)
    return [(float(x), float(y)) for x, y in rim]


def _window(mirror: FlatMirror, fixing: Fixing) -> Part | None:
    """What a framed tray lacks of its floor: what is FRAME_MM from the mirror's edges; None where little is left."""
    half_width, half_height = mirror.width_mm / 2 - FRAME_MM, mirror.height_mm / 2 - FRAME_MM
    if min(half_width, half_height) < SMALLEST_WINDOW_MM / 2:
        return None
    limits = (-FAR_BEHIND_MM, 0.0)
    window = _filled(mirror, -FRAME_MM, limits)
    if not _runs_out(mirror, fixing):
        return window
    return window + box((-half_width, half_width), (0, mirror.height_mm), limits)


def _runs_out(mirror: FlatMirror, fixing: Fixing) -> bool:
    """Whether a framed tray's window is open where the mirror slides in: a clip and cut corners need a floor there."""
    return fixing == "glue" and mirror.outline == "rectangle"


def _strip_mm(wall_mm: float) -> float:
    """Thickness of the strip behind the tray's head where the floor is thinner than an insert is long."""
    return max(insert("M3").length_mm - wall_mm, 0.0)


def _clip_top(mirror: FlatMirror) -> float:
    """Front of the clip: above its screws' heads, and not below its lip."""
    return max(LIP_THICKNESS_MM, CLIP_SEAT_MM + head_height_mm("M3") - mirror.thickness_mm - BED_MM)


def _section(mirror: FlatMirror) -> str:
    """Section of the rig file that a mirror comes from."""
    return "fold_mirror" if isinstance(mirror, FoldMirror) else "gaze_mirror"


def _check(mirror: FlatMirror) -> None:
    low, high = THICKNESS_LIMITS_MM
    if not low <= mirror.thickness_mm <= high:
        raise ValueError(
            f"{_section(mirror)}.thickness_mm = {mirror.thickness_mm:g}: expected {low:g} to {high:g}, "
            "what a mirror cell holds"
        )
    for key in ("width_mm", "height_mm"):
        size = getattr(mirror, key)
        least = smallest_side_mm(mirror)
        if size < least:
            raise ValueError(
                f"{_section(mirror)}.{key} = {size:g}: expected at least {least:g}, below which the holes in the floor "
                "of its cell run into each other or out from under it"
            )
