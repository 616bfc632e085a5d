"""Bands that strap flanges to a hull: hose clamps around a cylinder, releasable cable ties around any other body.

A band lies taut, around the convex hull of what it goes around: the hull where it is, and the floors of the slots of
the flanges under it. Flanges whose slots lie in one plane across the body share their bands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from build123d import Face, Location, Solid, Vector, Wire
from scipy.spatial import ConvexHull

from cad.parts.contact import CylinderContact
from cad.parts.flange import STRAP_PLACES_MM, STRAP_WIDTH_MM, Seat
from cad.parts.hardware import Hardware, Piece
from optics.kernels.arrays import FloatArray
from optics.mesh import Group
from rigs.mounting import Attachment

BAND = "band_"
"""What names of bands begin with."""
BAND_WIDTH_MM = 12.0
BAND_THICKNESS_MM = {"clamps": 0.9, "straps": 1.9}
"""Nominal; the clamp's screw housing and the tie's head are left out."""
ARC_POINTS = 721
DRAWN_ARC_POINTS = 73
DRAWN_RIM_POINTS = 181
"""Of the drawn band, on a flange's floor and around a cylinder; its chords lie outside the arcs. How long a solid takes
to be checked grows with the square of its faces."""
SECTIONS = 5
"""Across a band's width, through a hull that is no cylinder."""


@dataclass(frozen=True, kw_only=True)
class Band:
    """One band.

    Attributes
    ----------
    kind : str
        clamps or straps.
    x_mm : float
        Where along the body its middle is.
    seats : tuple of Seat
        Flanges under it, in the body frame.
    around_mm : array, shape (n, 2)
        Points (y, z) of the hull that it goes around.
    """

    kind: Attachment
    x_mm: float
    seats: tuple[Seat, ...]
    around_mm: FloatArray

    @property
    def length_mm(self) -> float:
        """Length of the taut band: the rim of the convex hull of what is under it."""
        # In two dimensions SciPy calls the length of the rim the area.
        return float(ConvexHull(self._under()).area)

    @property
    def catalogue(self) -> str:
        """What to order."""
        if self.kind == "clamps":
            diameter = int(np.ceil(self.length_mm / np.pi))
            return f"Hose clamp DIN 3017-1 form A, band {BAND_WIDTH_MM:g} mm, range around {diameter} mm, A4 (W5)"
        length = int(np.ceil(self.length_mm))
        return f"Cable tie, releasable, 12.7 mm wide, for {length} mm around (two joined where none is as long), PA66"

    def solid(self) -> Solid:
        """Band in the body frame, millimetres."""
        contact = self.seats[0].contact
        around = self.around_mm
        if isinstance(contact, CylinderContact):
            around = _circle(contact.radius_mm / np.cos(np.pi / (DRAWN_RIM_POINTS - 1)), DRAWN_RIM_POINTS)
        under = np.vstack([around, *(_floor(seat, DRAWN_ARC_POINTS, outside=True) for seat in self.seats)])
        inner = under[ConvexHull(under).vertices]
        turns = np.linspace(0, 2 * np.pi, 16, endpoint=False)
        ring = BAND_THICKNESS_MM[self.kind] * np.column_stack([np.cos(turns), np.sin(turns)])
        swept = (inner[:, np.newaxis] + ring).reshape(-1, 2)
        outer = swept[ConvexHull(swept).vertices]
        rims = [_rim(points, self.x_mm - BAND_WIDTH_MM / 2) for points in (outer, inner)]
        return Solid.extrude(Face(rims[0], rims[1:]), Vector(BAND_WIDTH_MM, 0, 0))

    def press(self, seat: Seat) -> float:
        """How hard a band's unit tension presses a flange onto the hull: by its change of direction over the flange."""
        inwards = -seat.normal[1:]
        under = self._under()
        rim = under[ConvexHull(under).vertices]
        floor = _floor(seat, ARC_POINTS, outside=False)
        on_seat = [int(np.argmin(np.linalg.norm(rim - point, axis=1))) for point in (floor[0], floor[-1])]
        # The rim runs anticlockwise: the free stretches before and behind the flange pull along themselves.
        first, last = sorted(on_seat)
        if not _contains(rim[first : last + 1], floor):
            first, last = last, first + len(rim)
        leaving = rim[(last + 1) % len(rim)] - rim[last % len(rim)]
        coming = rim[first - 1] - rim[first]
        pull = leaving / np.linalg.norm(leaving) + coming / np.linalg.norm(coming)
        return float(pull @ inwards)

    def _under(self) -> FloatArray:
        return np.vstack([self.around_mm, *(_floor(seat, ARC_POINTS, outside=False) for seat in self.seats)])


def bands(seats: Sequence[Seat], hull: trimesh.Trimesh) -> list[Band]:
    """Bands of seats in the body frame, around a hull of triangles, millimetres; none for what is not strapped."""
    slots = sorted(
        ((slot_mm(seat, place), seat) for seat in seats if seat.strapped for place in STRAP_PLACES_MM),
        key=lambda slot: slot[0],
    )
    shared: list[list[tuple[float, Seat]]] = []
    for slot in slots:
        # A band may run aslant by the clearance that it has in its slots.
        if shared and slot[0] - shared[-1][0][0] <= STRAP_WIDTH_MM - BAND_WIDTH_MM:
            shared[-1].append(slot)
        else:
            shared.append([slot])
    found = []
    for group in shared:
        x, under = float(np.mean([at for at, _ in group])), tuple(seat for _, seat in group)
        found.append(Band(kind=under[0].attachment, x_mm=x, seats=under, around_mm=_around(under, hull, x)))
    return found


def band_hardware(seats: Sequence[Seat], hull: trimesh.Trimesh) -> list[Hardware]:
    """Bands as pieces of the assembly."""
    return [
        Hardware(
            name=f"{BAND}{number}_{'clamp' if band.kind == 'clamps' else 'tie'}",
            group=Group.FIXED,
            piece=Piece(catalogue=band.catalogue, shape=band.solid()),
            pose=Location(),
        )
        for number, band in enumerate(bands(seats, hull), start=1)
    ]


def slot_mm(seat: Seat, place_mm: float) -> float:
    """Where along the hull a slot is: x of the body, millimetres."""
    return float(1000 * seat.body_from_seat.apply([place_mm / 1000, 0.0, 0.0])[0])


def _around(seats: Sequence[Seat], hull: trimesh.Trimesh, x_mm: float) -> FloatArray:
    """Points (y, z) of the hull under a band: of the cylinder, or of sections through the triangles."""
    contact = seats[0].contact
    if isinstance(contact, CylinderContact):
        return _circle(contact.radius_mm, ARC_POINTS)
    points = []
    for x in x_mm + BAND_WIDTH_MM / 2 * np.linspace(-1, 1, SECTIONS):
        lines = trimesh.intersections.mesh_plane(hull, [1.0, 0.0, 0.0], [x, 0.0, 0.0])
        points.append(np.asarray(lines, dtype=np.float64).reshape(-1, 3)[:, 1:])
    every = np.vstack(points)
    if len(every) < 3:
        raise ValueError(f"mount.fold_attachment = 'straps': expected hull to go around at x = {x_mm:.1f}, found none")
    return np.asarray(every[ConvexHull(every).vertices])


def _circle(radius_mm: float, count: int) -> FloatArray:
    """Points (y, z) of a circle, the last of them the first, shape (count, 2)."""
    angles = np.linspace(0, 2 * np.pi, count)
    return np.asarray(radius_mm * np.column_stack([np.cos(angles), np.sin(angles)]))


def _floor(seat: Seat, count: int, *, outside: bool) -> FloatArray:
    """Floor of a flange's slots across the body, as (y, z), shape (n, 2); with `outside` chords lie outside its arc."""
    if isinstance(seat.contact, CylinderContact):
        floor = seat.contact.radius_mm + seat.wall_mm
        half = np.arcsin(seat.width_mm / 2 / floor)
        angles = np.arctan2(seat.normal[2], seat.normal[1]) + np.linspace(-half, half, count)
        length = floor / np.cos(half / (count - 1)) if outside else floor
        return length * np.column_stack([np.cos(angles), np.sin(angles)])
    ends = np.array([[0.0, side * seat.width_mm / 2, seat.floor_mm] for side in (-1, 1)])
    return np.asarray(1000 * seat.body_from_seat.apply(ends / 1000)[:, 1:])


def _contains(rim: FloatArray, floor: FloatArray) -> bool:
    """Whether a stretch of the rim is the one over a flange's floor: no further from it than its ends are apart."""
    middle = floor.mean(axis=0)
    reach = np.linalg.norm(floor - middle, axis=1).max()
    return bool((np.linalg.norm(rim - middle, axis=1) <= reach + 1e-6).all())


def _rim(points: FloatArray, x_mm: float) -> Wire:
    """Polygon of points (y, z) across the body."""
    return Wire.make_polygon([Vector(x_mm, float(y), float(z)) for y, z in points])
