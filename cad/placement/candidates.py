"""Candidates for a mount on a hull: camera, distances, and seats for bracket and base, each with what it costs.

Everything here is judged on a grid of distances, in the fold frame: the body's for a fold down, turned by half a turn
about x for a fold up, so that M2 is always below the camera's axis.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from cad.hulls.anchors import Anchor
from cad.parts.flange import FLANGE_WIDTH_MM
from cad.parts.gimbal_base import base_room_mm
from cad.parts.gimbal_dimensions import GimbalDimensions
from cad.parts.mirrors import cell_front_mm, tray_depth_mm, tray_foot_mm, tray_half_width_mm, tray_head_mm
from cad.placement.camera_sites import CameraSite
from cad.placement.hull_field import HullField
from cad.placement.seats import SeatFinder, flange_points_mm
from optics.coverage.sphere import cell_directions
from optics.kernels.arrays import FloatArray
from optics.search.objectives import rig_with
from rigs import Rig

FOLD_STEEPEST_DEG, BASE_STEEPEST_DEG = 38.0, 33.0
"""Between a seat's normal and the vertical; the bracket itself refuses 60 degrees, but is a heavy wedge there."""
STEEPEST_DECK_DEG, DECK_DEG = 50.0, 3.0
"""A deck of the robot may be a seat although the camera leans more than the above, up to this; and what decks slope."""
LARGEST_RISE_MM = 110.0
"""How far a bracket's seat may be below the top of M1's cell; the bracket refuses a pedestal of 150 mm to its roof."""
FOLD_REACH_MM = 520.0
BASE_REACH_MM = 360.0
"""Arms longer than this bend too much."""
BASE_ENDS_MM = 56.0
"""How much longer the base is than from its seat to the pan axis; as wide as its flange, it lies across the bed."""
BASE_ROWS_MM = (0.0, 36.0, -36.0, 72.0, -72.0, 120.0, -120.0)
"""How far beside the camera's plane a seat for the base is looked for."""
ROOF_ROOM_MM = 14.0
"""Rails and screws over the roof's outer face."""
BEHIND_FLANGE_MM = 30.0
"""The roof's way is free from here on, seen from the middle of its seat."""
COLUMN_MM = 8.0
"""Half of the base's column, across."""
SPARE_MM = 2.0
"""What the grid may be off."""
NSIDE = 2
"""Of the directions in which the hull is looked for from M2: 48 of them."""
HIDDEN_MM = 1000.0
"""A design that the hull hides everything from costs as much as arms of this length."""
MARCH_STEPS = 24
KEPT = 8
"""Distances of a camera site whose seats are looked for: the best by what can be said without them."""


@dataclass(frozen=True, kw_only=True)
class MirrorShape:
    """What a pair of mirrors and their parts take up, seen from the camera's pinhole, fold frame, millimetres.

    Attributes
    ----------
    design : array, shape (6,)
        Columns of `optics.search.objectives.PARAMETERS`.
    dimensions : GimbalDimensions
    half_width_mm : float
        Of M1's cell.
    cell_mm : array, shape (n, 3)
        Points on M1's cell.
    yoke_mm : array, shape (m, 3)
        Points on the cylinder that yoke and tilt servo sweep, about the crossing of the joint axes.
    """

    design: FloatArray
    dimensions: GimbalDimensions
    half_width_mm: float
    cell_mm: FloatArray
    yoke_mm: FloatArray

    @property
    def gimbal_mm(self) -> FloatArray:
        """Where the joint axes cross, shape (3,)."""
        return np.array([self.design[0], 0.0, -self.design[1]])


@dataclass(frozen=True, kw_only=True)
class Prospect:
    """A camera site and distances that clear the hull, before seats are looked for.

    Attributes
    ----------
    site : CameraSite
    shape : MirrorShape
    hidden : float
        Share of all directions in which the hull is, seen from M2.
    """

    site: CameraSite
    shape: MirrorShape
    hidden: float


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """One way to put the mirrors on the hull, in the fold frame.

    Attributes
    ----------
    site : CameraSite
    shape : MirrorShape
    fold, base : Anchor
    fold_arm_mm, base_arm_mm : float
        How far bracket and base reach.
    hidden : float
        Share of all directions in which the hull is, seen from M2.
    """

    site: CameraSite
    shape: MirrorShape
    fold: Anchor
    base: Anchor
    fold_arm_mm: float
    base_arm_mm: float
    hidden: float

    @property
    def cost_mm(self) -> float:
        """Arms, path and what the hull hides, in millimetres of arm."""
        arms = self.fold_arm_mm + self.base_arm_mm + float(self.shape.design[:2].sum())
        return arms + self.site.behind_nose_mm + self.site.gap_mm + HIDDEN_MM * self.hidden


@dataclass
class Shortfalls:
    """For each condition that turned something away: how often, and the least that was missing (millimetres)."""

    found: dict[str, tuple[int, float]] = field(default_factory=dict)

    def note(self, condition: str, missing_mm: float = np.nan, count: int = 1) -> None:
        """Count what a condition turned away."""
        before, least = self.found.get(condition, (0, np.nan))
        self.found[condition] = (before + count, float(np.fmin(least, missing_mm)))


def mirror_shapes(rig: Rig, designs: FloatArray) -> list[MirrorShape]:
    """Shapes of a rig's parts for designs, shape (n, 6)."""
    shapes = []
    for design in designs:
        sized = rig_with(rig, design)
        dimensions = GimbalDimensions.from_rig(sized)
        shape = MirrorShape(
            design=design,
            dimensions=dimensions,
            half_width_mm=tray_half_width_mm(sized.require_gaze().fold_mirror),
            cell_mm=_cell_mm(sized),
            yoke_mm=_yoke_mm(dimensions),
        )
        shapes.append(shape)
    return shapes


def prospects(site: CameraSite, shapes: Sequence[MirrorShape], space: HullField, short: Shortfalls) -> list[Prospect]:
    """The best distances of one camera site, by what can be said without their seats.

    Parameters
    ----------
    site : CameraSite
    shapes : sequence of MirrorShape
        Distances and sizes that go together (`cad.placement.mirror_table`).
    space : HullField
        The hull, in the fold frame.
    short : Shortfalls
        What turned shapes away is added to it.
    """
    clear = _clear(site, shapes, space, short)
    if not clear:
        return []
    hidden = _hidden(site.pinhole_mm + np.stack([shape.gimbal_mm for shape in clear]), space)
    costs = np.array([shape.design[:2].sum() for shape in clear]) + HIDDEN_MM * hidden
    best = np.argsort(costs, kind="stable")[:KEPT]
    return [Prospect(site=site, shape=clear[number], hidden=float(hidden[number])) for number in best]


def seated(found: Sequence[Prospect], finder: SeatFinder, short: Shortfalls) -> Iterator[Candidate]:
    """Candidates: those of the prospects that have seats, with the nearest ones that hold."""
    for each in found:
        fold = _fold_seat(each.site, each.shape, finder, short)
        base = _base_seat(each.site, each.shape, finder, short) if fold else None
        if fold and base:
            yield Candidate(
                site=each.site,
                shape=each.shape,
                fold=fold[0],
                base=base[0],
                fold_arm_mm=fold[1],
                base_arm_mm=base[1],
                hidden=each.hidden,
            )


def _clear(site: CameraSite, shapes: Sequence[MirrorShape], space: HullField, short: Shortfalls) -> list[MirrorShape]:
    """Shapes whose M1 cell, turning mirror and yoke keep their distance from the hull."""
    clearance = np.array([shape.dimensions.mount.clearance_mm for shape in shapes])
    reach = np.array([shape.dimensions.holder_reach_mm for shape in shapes])
    cells = site.pinhole_mm + np.stack([shape.cell_mm for shape in shapes])
    centres = site.pinhole_mm + np.stack([shape.gimbal_mm for shape in shapes])
    yokes = np.stack([shape.yoke_mm for shape in shapes])
    rooms = {
        "M1's cell clear of the hull": space.distances_mm(cells).min(axis=1) - clearance,
        "M2 clear of the hull": space.distances_mm(centres) - reach - clearance,
        "the yoke clear of the hull": space.distances_mm(yokes + centres[:, np.newaxis]).min(axis=1) - clearance,
    }
    left = np.ones(len(shapes), dtype=bool)
    for condition, room in rooms.items():
        away = left & (room < 0)
        if away.any():
            short.note(condition, float(-room[away].max()), int(away.sum()))
        left &= ~away
    return [shape for shape, free in zip(shapes, left, strict=True) if free]


def _cell_mm(rig: Rig) -> FloatArray:
    """Points on the outline of M1's cell, seen from the pinhole, shape (n, 3)."""
    gaze = rig.require_gaze()
    mirror, wall, fixing = gaze.fold_mirror, gaze.mount.wall_mm, gaze.mount.mirror_fixing
    across = np.linspace(-1, 1, 7) * tray_half_width_mm(mirror)
    up = np.linspace(-tray_foot_mm(mirror), tray_head_mm(mirror, fixing), 9)
    out = np.array([-tray_depth_mm(mirror, wall), cell_front_mm(mirror, fixing)])
    a, u, w = (values.ravel() for values in np.meshgrid(across, up, out, indexing="ij"))
    slope = 2**-0.5
    # Up the face is back and up, its normal back and down.
    return np.column_stack([mirror.distance_mm - slope * (u + w), a, slope * (u - w)])


def _yoke_mm(dimensions: GimbalDimensions) -> FloatArray:
    """Points on the cylinder that yoke and tilt servo sweep, about the crossing of the joint axes, shape (n, 3)."""
    angles = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    levels = np.linspace(dimensions.yoke_bottom_mm, dimensions.servo_arm_top_mm, 6)
    a, z = (values.ravel() for values in np.meshgrid(angles, levels, indexing="ij"))
    radius = dimensions.yoke_radius_mm
    return np.column_stack([radius * np.cos(a), radius * np.sin(a), z])


def _hidden(eyes_mm: FloatArray, space: HullField) -> FloatArray:
    """Share of all directions in which there is hull, seen from places of shape (n, 3).

    A ray steps on as far as the hull is away.
    """
    directions = cell_directions(NSIDE)
    gone = np.zeros((len(eyes_mm), len(directions)))
    hit = np.zeros(gone.shape, dtype=bool)
    for _ in range(MARCH_STEPS):
        distance = space.nearest_mm(eyes_mm[:, np.newaxis] + gone[:, :, np.newaxis] * directions)
        hit |= distance < space.step_mm
        gone += np.where(hit, 0.0, np.maximum(distance, space.step_mm))
    return np.asarray(hit.mean(axis=1))


def _fold_seat(
    site: CameraSite, shape: MirrorShape, finder: SeatFinder, short: Shortfalls
) -> tuple[Anchor, float] | None:
    """Seat of the bracket with the shortest arm, on top of the hull with a free way for the roof to M1."""
    x, y, _ = site.pinhole_mm
    cell = site.pinhole_mm + shape.cell_mm
    front, head = float(cell[:, 0].max()), float(cell[:, 2].max())
    places = finder.places(y, 1, x + shape.design[0] - FOLD_REACH_MM, front - BEHIND_FLANGE_MM)
    if not places:
        short.note(f"a seat for the bracket within {FOLD_REACH_MM:g} mm of M1")
    options: list[tuple[float, FloatArray]] = []
    for place in places:
        rise = float(head - place[2])
        if rise > LARGEST_RISE_MM:
            short.note("a seat for the bracket not far below M1's cell", rise - LARGEST_RISE_MM)
        else:
            options.append((float(front - place[0]) + abs(rise), place))
    for arm, place in sorted(options, key=_arm):
        seat = finder.seat(place, 1, _steepest_deg(FOLD_STEEPEST_DEG, finder))
        if isinstance(seat, str):
            short.note(f"a seat for the bracket: {seat}")
            continue
        beside = site.room_mm(flange_points_mm(seat))
        if beside < 0:
            short.note("a seat for the bracket clear of the camera", -beside)
            continue
        level = max(seat.point_mm[2], head) + shape.dimensions.mount.wall_mm
        room = float(finder.space.distances_mm(_roof_mm(seat, [front, y, level], shape)).min())
        if room < 0:
            short.note("the bracket's roof clear of the hull", -room)
            continue
        return seat, arm
    return None


def _roof_mm(seat: Anchor, end_mm: Sequence[float], shape: MirrorShape) -> FloatArray:
    """Points of the bracket's roof between its flange and its front end (x, y, z), shape (..., 3)."""
    front, y, level = end_mm
    along = np.linspace(seat.point_mm[0] + BEHIND_FLANGE_MM, front, 24)
    across = y + shape.half_width_mm * np.linspace(-1, 1, 7)
    return np.stack(np.meshgrid(along, across, [level, level + ROOF_ROOM_MM]), axis=-1)


def _base_seat(
    site: CameraSite, shape: MirrorShape, finder: SeatFinder, short: Shortfalls
) -> tuple[Anchor, float] | None:
    """Seat of the gimbal's base with the shortest arm, on an underside of the hull with a free way for the column."""
    centre = site.pinhole_mm + shape.gimbal_mm
    bed = shape.dimensions.mount.printer_bed_mm
    furthest = min(BASE_REACH_MM, float(np.hypot(*bed[:2])) - FLANGE_WIDTH_MM - BASE_ENDS_MM)
    rows = [site.pinhole_mm[1] + row for row in BASE_ROWS_MM]
    places = [place for y in rows for place in finder.places(y, -1, centre[0] - BASE_REACH_MM, centre[0])]
    if not places:
        short.note(f"a seat for the base within {BASE_REACH_MM:g} mm of the pan axis")
    options: list[tuple[float, FloatArray]] = []
    for place in places:
        away = place - centre
        reach, height = float(np.hypot(*away[:2])), float(away[2])
        needed, lowest = base_room_mm(shape.dimensions, height)
        if reach < needed + SPARE_MM:
            short.note("a seat for the base beside the yoke", needed + SPARE_MM - reach)
        elif reach > furthest:
            short.note("a seat for the base so near that the printer's bed takes it", reach - furthest)
        elif height < lowest + SPARE_MM:
            short.note("a seat for the base above the gimbal's foot", lowest + SPARE_MM - height)
        else:
            options.append((reach + height, place))
    for arm, place in sorted(options, key=_arm):
        seat = finder.seat(place, -1, _steepest_deg(BASE_STEEPEST_DEG, finder))
        if isinstance(seat, str):
            short.note(f"a seat for the base: {seat}")
            continue
        beside = site.room_mm(flange_points_mm(seat))
        if beside < 0:
            short.note("a seat for the base clear of the camera", -beside)
            continue
        room = float(finder.space.distances_mm(_column_mm(seat, centre, shape)).min())
        room -= shape.dimensions.mount.clearance_mm + COLUMN_MM
        if room < 0:
            short.note("the base's column clear of the hull", -room)
            continue
        return seat, arm
    return None


def _steepest_deg(usual_deg: float, finder: SeatFinder) -> float:
    return max(usual_deg, min(finder.lean_deg + DECK_DEG, STEEPEST_DECK_DEG))


def _arm(option: tuple[float, FloatArray]) -> float:
    return option[0]


def _column_mm(seat: Anchor, centre_mm: FloatArray, shape: MirrorShape) -> FloatArray:
    """Points of the base's column below its flange, and of the beam to the pan axis, shape (n, 3)."""
    foot = centre_mm[2] + shape.dimensions.foot_top_mm - BEHIND_FLANGE_MM
    x, y, z = seat.point_mm
    column = np.linspace([x, y, foot], [x, y, z - BEHIND_FLANGE_MM], 12)
    return np.concatenate([column, np.linspace([x, y, foot], [*centre_mm[:2], foot], 12)])
