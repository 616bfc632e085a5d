"""Bought pieces: screws, heat-set inserts, washers, bushings and spacer sleeves, and the holes that printed parts need.

Screws, inserts and washers have the dimensions of bd_warehouse's tables, without threads. Steel is A4 (316) and
inserts are brass, because the mount is in sea water. A piece's own frame has its seat in z = 0: the underside of a
screw's head, of a bushing's flange and of a washer, the mouth of an insert; z points away from what it goes into.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
from bd_warehouse.fastener import HeatSetNut, PlainWasher, SocketHeadCapScrew
from build123d import Align, Cylinder, Location, Part, Plane, Pos, RegularPolygon, Solid, extrude
from numpy.typing import ArrayLike

from cad.shapes import cylinder
from optics.mesh import Group

Thread = Literal["M2", "M3", "M4"]

SCREW_SIZES: dict[Thread, str] = {"M2": "M2-0.4", "M3": "M3-0.5", "M4": "M4-0.7"}
INSERT_MAKER = "ruthex"
INSERT_SIZES: dict[Thread, str] = {"M2": "M2-0.4-4", "M3": "M3-0.5-4.0", "M4": "M4-0.7-4.0"}
"""The short ones: they need the thinnest walls."""
SCREW_LENGTHS_MM = (3, 4, 5, 6, 8, 10, 12, 16, 20, 25, 30, 35, 40)
"""Nominal lengths of ISO 4762 that are easily bought."""
COUNTERBORE_ROOM_MM = 0.3
"""Around and over a screw's head."""
INSERT_RELIEF_MM = 1.0
"""How much deeper than the insert its hole is, for the plastic that it pushes ahead."""
RUNNING_MM = 0.05
"""Radial clearance of what turns in a bushing, and by how much the bore for a pressed-in bushing is drawn larger."""
DRAWN_MM = 0.02
"""An insert is drawn this much smaller than its hole; its knurls, which bite into the plastic, are left out."""


@dataclass(frozen=True, kw_only=True)
class Piece:
    """A bought piece: what to order, and its shape in its own frame, millimetres."""

    catalogue: str
    shape: Solid


@dataclass(frozen=True, kw_only=True)
class Hardware:
    """A piece in its place.

    Attributes
    ----------
    name : str
        Unique in an assembly.
    group : Group
        What it moves with, and so the frame of `pose`.
    piece : Piece
        What it is.
    pose : Location
        Of the piece's own frame in the group's frame, millimetres.
    """

    name: str
    group: Group
    piece: Piece
    pose: Location

    @property
    def solid(self) -> Solid:
        """Shape in the frame of the group."""
        return self.piece.shape.moved(self.pose)


@dataclass(frozen=True, kw_only=True)
class Insert:
    """What a printed part must offer a heat-set insert: diameter of the hole, length, wall around the hole."""

    hole_diameter_mm: float
    length_mm: float
    wall_mm: float
    part_number: str

    @property
    def boss_radius_mm(self) -> float:
        """Radius of the boss that the maker asks for."""
        return self.hole_diameter_mm / 2 + self.wall_mm


@dataclass(frozen=True, kw_only=True)
class Bushing:
    """A flanged plain bushing; the length includes the flange."""

    bore_mm: float
    outer_mm: float
    flange_mm: float
    flange_thickness_mm: float
    length_mm: float

    @property
    def housing_radius_mm(self) -> float:
        """Radius of the printed bore it is pressed into."""
        return self.outer_mm / 2 + RUNNING_MM

    @property
    def journal_radius_mm(self) -> float:
        """Radius of what turns in it."""
        return self.bore_mm / 2 - RUNNING_MM


def along(point: ArrayLike, axis: ArrayLike) -> Location:
    """Pose of a piece whose seat is at `point` and whose z points along `axis`."""
    direction = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    return Location(Plane(origin=tuple(np.asarray(point, dtype=float)), z_dir=tuple(direction)))


@cache
def cap_screw(thread: Thread, length_mm: int) -> Piece:
    """Socket head cap screw, ISO 4762, drawn without its thread and the rounding of its head."""
    data = _screw_data(thread)
    height, radius = head_height_mm(thread), nominal_diameter_mm(thread) / 2
    head = cylinder((0, 0, 0), (0, 0, height), head_diameter_mm(thread) / 2)
    shank = cylinder((0, 0, -length_mm), (0, 0, height / 2), radius)
    socket = extrude(RegularPolygon(data["s"] / 2, 6, major_radius=False), data["t"])
    screw = head + shank - Pos(0, 0, height - data["t"]) * socket
    return Piece(catalogue=f"Socket head cap screw ISO 4762 {thread}x{length_mm} A4-70", shape=screw.solids()[0])


@cache
def heat_set_insert(thread: Thread) -> Piece:
    """Heat-set insert, drawn as the plain tube that is left when its knurls have sunk into the plastic."""
    size = insert(thread)
    radius, bore = size.hole_diameter_mm / 2 - DRAWN_MM, nominal_diameter_mm(thread) / 2 + 0.1
    tube = cylinder((0, 0, -size.length_mm), (0, 0, 0), radius) - cylinder((0, 0, -size.length_mm), (0, 0, 0), bore)
    name = f"Heat-set insert {thread} x {size.length_mm:g}, brass ({INSERT_MAKER} {size.part_number})"
    return Piece(catalogue=name, shape=tube.solids()[0])


@cache
def washer(thread: Thread) -> Piece:
    """Large plain washer, ISO 7093."""
    return Piece(
        catalogue=f"Plain washer ISO 7093 {thread} A4",
        shape=PlainWasher(thread, fastener_type="iso7093").solids()[0],
    )


@cache
def flanged_bushing(bushing: Bushing) -> Piece:
    """Flanged plain bushing of a polymer that runs in water."""
    flange = cylinder((0, 0, 0), (0, 0, bushing.flange_thickness_mm), bushing.flange_mm / 2)
    body = cylinder((0, 0, bushing.flange_thickness_mm - bushing.length_mm), (0, 0, 0), bushing.outer_mm / 2)
    bore = cylinder((0, 0, -bushing.length_mm), (0, 0, bushing.flange_thickness_mm), bushing.bore_mm / 2)
    name = (
        f"Flanged plain bushing {bushing.bore_mm:g} x {bushing.outer_mm:g} x {bushing.length_mm:g} mm, "
        f"flange {bushing.flange_mm:g} x {bushing.flange_thickness_mm:g} mm, "
        "polymer for use in water (iglidur J or equal)"
    )
    return Piece(catalogue=name, shape=(flange + body - bore).solids()[0])


@cache
def spacer_sleeve(outer_mm: float, thread: Thread, length_mm: float) -> Piece:
    """Tube that a screw clamps and a bushing turns on."""
    inner = nominal_diameter_mm(thread) + 0.2
    tube = Cylinder(outer_mm / 2 - RUNNING_MM, length_mm, align=(Align.CENTER, Align.CENTER, Align.MIN))
    tube -= Cylinder(inner / 2, length_mm, align=(Align.CENTER, Align.CENTER, Align.MIN))
    return Piece(catalogue=f"Spacer sleeve {outer_mm:g} x {inner:g} x {length_mm:g} mm A4", shape=tube.solids()[0])


@cache
def insert(thread: Thread) -> Insert:
    """Insert that is used for a thread, as its maker specifies it."""
    size = INSERT_SIZES[thread]
    data = {
        key.partition(":")[2]: value for key, value in HeatSetNut.fastener_data[size].items() if INSERT_MAKER in key
    }
    return Insert(
        hole_diameter_mm=float(data["dc"]),
        length_mm=float(data["m"]),
        wall_mm=float(data["material_thickness"]),
        part_number=data["part"],
    )


def nominal_diameter_mm(thread: Thread) -> float:
    """Outer diameter of the thread."""
    return float(thread[1:])


def head_height_mm(thread: Thread) -> float:
    """Height of a cap screw's head (ISO 4762)."""
    return _screw_data(thread)["k"]


def head_diameter_mm(thread: Thread) -> float:
    """Diameter of a cap screw's head (ISO 4762)."""
    return _screw_data(thread)["dk"]


@cache
def _screw_data(thread: Thread) -> dict[str, float]:
    """Head's diameter dk and height k, socket's width s and depth t of a cap screw (ISO 4762), millimetres."""
    rows = SocketHeadCapScrew.fastener_data[SCREW_SIZES[thread]].items()
    # The table's keys have blanks at their ends.
    return {key.strip().partition(":")[2]: float(value) for key, value in rows if "iso4762" in key and value}


def clearance_diameter_mm(thread: Thread) -> float:
    """Diameter of a clearance hole, medium fit of ISO 273."""
    return float(SocketHeadCapScrew.clearance_hole_data[thread]["Normal"])


def screw_length_mm(room_mm: float) -> int:
    """Longest standard length of a screw that has `room_mm` from the underside of its head.

    Raises
    ------
    ValueError
        When even the shortest is too long.
    """
    fitting = [length for length in SCREW_LENGTHS_MM if length <= room_mm]
    if not fitting:
        raise ValueError(f"expected room for a screw of {SCREW_LENGTHS_MM[0]} mm or longer, got {room_mm:.1f} mm")
    return fitting[-1]


def insert_hole(thread: Thread, mouth: Sequence[float], inwards: Sequence[float], depth_mm: float) -> Part:
    """What to cut for an insert, from `mouth` along `inwards`: its hole, then a clearance hole out at the other side.

    `depth_mm` is how thick the part is there. The hole goes through, so that no air is trapped behind the insert.
    """
    size = insert(thread)
    start, direction = np.asarray(mouth, dtype=float), np.asarray(inwards, dtype=float)
    bottom = min(size.length_mm + INSERT_RELIEF_MM, depth_mm + 0.1)
    hole = cylinder(start - 0.1 * direction, start + bottom * direction, size.hole_diameter_mm / 2)
    radius = clearance_diameter_mm(thread) / 2
    return hole + cylinder(start, start + (depth_mm + 0.1) * direction, radius)


def counterbored_hole(
    thread: Thread, seat: Sequence[float], outwards: Sequence[float], above_mm: float, below_mm: float
) -> Part:
    """What to cut for a screw whose head lies on `seat`: room for its head outwards, a clearance hole inwards."""
    point, direction = np.asarray(seat, dtype=float), np.asarray(outwards, dtype=float)
    head = cylinder(point, point + above_mm * direction, head_diameter_mm(thread) / 2 + COUNTERBORE_ROOM_MM)
    return head + cylinder(point + 0.1 * direction, point - below_mm * direction, clearance_diameter_mm(thread) / 2)


def screw_in_insert(  # noqa: PLR0917  (name, place and direction read in this order)
    name: str, group: Group, thread: Thread, seat: ArrayLike, outwards: ArrayLike, grip_mm: float, room_mm: float
) -> tuple[Hardware, Hardware]:
    """Screw whose head lies on `seat`, and the insert that it goes into `grip_mm` further on.

    `room_mm` is how far the screw may reach beyond the mouth of the insert.
    """
    direction = np.asarray(outwards, dtype=float) / np.linalg.norm(outwards)
    pose = along(seat, direction)
    length = screw_length_mm(grip_mm + room_mm)
    return (
        Hardware(name=f"{name}_screw", group=group, piece=cap_screw(thread, length), pose=pose),
        Hardware(name=f"{name}_insert", group=group, piece=heat_set_insert(thread), pose=pose * Pos(0, 0, -grip_mm)),
    )
