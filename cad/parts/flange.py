"""Flanges: what holds a printed part to the hull: bolted, strapped on with bands, or on pads of foam tape.

A seat is where a flange lies: its frame has its origin at the anchor, z along the hull's outward normal and x along the
flange. A printed part is the flange, whatever stands on it, without the hull's side of the contact and without the room
that bolts or straps need.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import trimesh
from build123d import Axis, Part, Plane, Pos, Rot
from numpy.typing import ArrayLike
from scipy.spatial.transform import RigidTransform, Rotation

from cad.hulls.anchors import Anchor, End, base_anchor, fold_anchor
from cad.hulls.hull import closed_surface, file_hull_solid
from cad.parts.contact import Contact, CylinderContact, PlaneContact, surface_contact
from cad.parts.hardware import Hardware, Piece, along, cap_screw, clearance_diameter_mm, screw_length_mm
from cad.shapes import box, cylinder, location_mm
from optics.kernels.arrays import FloatArray
from optics.layout import camera_pose
from optics.mesh import Group
from rigs import FileHull, Rig, TorpedoHull
from rigs.mounting import Attachment

FLANGE_LENGTH_MM = 50.0
FLANGE_WIDTH_MM = 46.0
FLANGE_HOLES_MM = (18.0, 17.0)
CORNER_RADIUS_MM = 5.0
BOLT_IN_HULL_MM = 8.0
"""How far a bolt reaches into the hull."""
BOLT_HEAD_DIAMETER_MM = 10.0
"""Room for an M4 washer and a key around a cap screw's head."""
SADDLE_LENGTH_MM = 60.0
SADDLE_WIDTH_MM = 64.0
PAD_LENGTH_MM = 90.0
PAD_WIDTH_MM = 70.0
PAD_THICKNESS_MM = 1.1
"""Of acrylic foam tape (3M VHB 5952 and its like)."""
SADDLE_HALF_ANGLE_DEG = 50.0
"""No wider than this around the hull: beyond it a strap pulls along the saddle, not onto it."""
STRAP_PLACES_MM = (-17.0, 17.0)
STRAP_WIDTH_MM = 14.0
STRAP_HEIGHT_MM = 3.5
"""Slot for the band of a 12 mm stainless hose clamp, with room for its slots' burr."""


@dataclass(frozen=True, kw_only=True)
class Seat:
    """Where and how a flange lies on the hull.

    Attributes
    ----------
    body_from_seat : RigidTransform
        Pose of the seat's frame, metres.
    contact : Contact
        The hull's surface under the flange, in the seat's frame.
    attachment : str
        What holds it: screws, clamps, straps or pads.
    wall_mm : float
        Wall of the mount.
    standing_mm : float
        Of what stands on the flange and is bolted down with it.
    head_room_mm : float
        Kept free over the bolts' heads, for the bolts and their key.
    """

    body_from_seat: RigidTransform
    contact: Contact
    attachment: Attachment
    wall_mm: float
    standing_mm: float = 0.0
    head_room_mm: float = 40.0

    @property
    def strapped(self) -> bool:
        """Whether bands hold it, which go around the hull."""
        return self.attachment in {"clamps", "straps"}

    @property
    def pad_mm(self) -> float:
        """Thickness of what is between hull and flange."""
        return PAD_THICKNESS_MM if self.attachment == "pads" else 0.0

    @property
    def length_mm(self) -> float:
        """Length of the flange along x."""
        return flange_size_mm(self.attachment)[0]

    @property
    def width_mm(self) -> float:
        """Width of the flange along y."""
        return (
            self.contact.width_mm if isinstance(self.contact, CylinderContact) else flange_size_mm(self.attachment)[1]
        )

    @property
    def floor_mm(self) -> float:
        """Height of the floor that bands press on, and of a plain flange's outer face, over the anchor."""
        return self.contact.range_mm[1] + self.pad_mm + self.wall_mm

    @property
    def height_mm(self) -> float:
        """Height of the flange's outer face, over the anchor."""
        return self.floor_mm + (STRAP_HEIGHT_MM + self.wall_mm if self.strapped else 0.0)

    @property
    def head_mm(self) -> float:
        """Height of the bolts' heads over the anchor."""
        return self.height_mm + self.standing_mm

    @property
    def normal(self) -> FloatArray:
        """Outward normal of the hull in the frame the seat is given in, shape (3,)."""
        return np.asarray(self.body_from_seat.rotation.as_matrix()[:, 2])

    def moved(self, new_from_body: RigidTransform) -> Seat:
        """The same seat in another frame."""
        return replace(self, body_from_seat=new_from_body * self.body_from_seat)


def fold_seat(rig: Rig) -> Seat:
    """Seat of the fold bracket in the body frame, its x along the camera's view.

    Raises
    ------
    ValueError
        When the hull's surface there carries no flange; the message begins with the key to change.
    """
    return _seat(rig, "fold", fold_anchor(rig), camera_pose(rig.camera).rotation.apply([0.0, 0.0, 1.0]))


def base_seat(rig: Rig, along: ArrayLike) -> Seat:
    """Seat of the gimbal's base in the body frame, its x in the direction `along`; raises as `fold_seat`."""
    return _seat(rig, "base", base_anchor(rig), along)


def lies_along_body(rig: Rig, end: End) -> bool:
    """Whether a flange lies along the body's x whatever stands on it: on a cylinder, or under bands across the body."""
    gaze = rig.require_gaze()
    return isinstance(gaze.hull, TorpedoHull) or getattr(gaze.mount, f"{end}_attachment") in {"clamps", "straps"}


def flange(seat: Seat) -> Part:
    """Flange with its fasteners' room cut out, in the frame the seat is given in, millimetres."""
    half_length, half_width = seat.length_mm / 2, seat.width_mm / 2
    bottom = seat.contact.range_mm[0] - 1
    plate = box((-half_length, half_length), (-half_width, half_width), (bottom, seat.height_mm))
    plate = plate.fillet(CORNER_RADIUS_MM, plate.edges().filter_by(Axis.Z))
    if seat.strapped and isinstance(seat.contact, CylinderContact):
        # The strap's tension wants one thickness all around, and a plate as high as a saddle would be heavy.
        low, radius = -seat.contact.radius_mm, seat.contact.radius_mm + seat.height_mm
        plate &= cylinder((-half_length - 1, 0, low), (half_length + 1, 0, low), radius)
    return _placed(seat, plate - _hull_side(seat) - _fastener_room(seat))


def hull_side(seat: Seat) -> Part:
    """What the hull takes up under the flange, in the frame the seat is given in, millimetres."""
    return _placed(seat, _hull_side(seat))


def fastener_room(seat: Seat) -> Part:
    """What bolts and their heads, or straps, need in and over the flange, in the frame the seat is given in."""
    return _placed(seat, _fastener_room(seat))


def flange_hardware(seat: Seat, name: str) -> list[Hardware]:
    """Bolts or pad of a flange, in the frame the seat is given in; bands go around the hull, and are made for both."""
    if seat.attachment == "pads":
        return [_pad(seat, name)]
    if seat.strapped:
        return []
    place, level = location_mm(seat.body_from_seat), seat.head_mm
    screw = cap_screw("M4", screw_length_mm(level - seat.contact.range_mm[0] + BOLT_IN_HULL_MM))
    return [
        Hardware(
            name=f"{name}_flange_screw_{number}",
            group=Group.FIXED,
            piece=screw,
            pose=place * along((x, y, level), (0, 0, 1)),
        )
        for number, (x, y) in enumerate(bolt_places(), start=1)
    ]


def bolt_places() -> list[tuple[float, float]]:
    """Where a flange's bolts are, as (x, y) of the seat's frame."""
    return [(sx * FLANGE_HOLES_MM[0], sy * FLANGE_HOLES_MM[1]) for sx in (-1, 1) for sy in (-1, 1)]


def flange_size_mm(attachment: Attachment) -> tuple[float, float]:
    """Length and width of a flange on a surface that is no cylinder."""
    if attachment == "pads":
        return PAD_LENGTH_MM, PAD_WIDTH_MM
    return (
        (SADDLE_LENGTH_MM, SADDLE_WIDTH_MM)
        if attachment in {"clamps", "straps"}
        else (FLANGE_LENGTH_MM, FLANGE_WIDTH_MM)
    )


def _pad(seat: Seat, name: str) -> Hardware:
    """Foam tape between hull and flange."""
    low, high = seat.contact.range_mm[0] - 1, seat.contact.range_mm[1] + seat.pad_mm + 1
    half_length, half_width = seat.length_mm / 2, seat.width_mm / 2
    layer = box((-half_length, half_length), (-half_width, half_width), (low, high))
    below, above = seat.contact.hull_side(seat.length_mm, seat.width_mm), _hull_side(seat)
    size = f"{seat.length_mm:g} x {seat.width_mm:g} mm"
    piece = Piece(
        catalogue=f"Acrylic foam tape, {seat.pad_mm:g} mm, sheet of {size} (3M VHB 5952 or equal)",
        # It comes onto the flange from the hull's side.
        shape=((layer & above) - below).solid().mirror(Plane.XY).mirror(Plane.XZ),
    )
    pose = location_mm(seat.body_from_seat) * Rot(180, 0, 0)
    return Hardware(name=f"{name}_flange_pad", group=Group.FIXED, piece=piece, pose=pose)


def _seat(rig: Rig, end: End, anchor: Anchor, along: ArrayLike) -> Seat:
    gaze = rig.require_gaze()
    place = f"mount.{end}_anchor_mm = {getattr(gaze.mount, f'{end}_anchor_mm')}"
    attachment: Attachment = getattr(gaze.mount, f"{end}_attachment")
    if attachment == "clamps" and not isinstance(gaze.hull, TorpedoHull):
        raise ValueError(
            f"mount.{end}_attachment = 'clamps': expected a cylindrical hull, got hull.shape = {gaze.hull.shape!r}; "
            "straps go around any body"
        )
    pose = _pose(anchor, (1.0, 0.0, 0.0) if lies_along_body(rig, end) else along, place)
    contact: Contact = PlaneContact()
    if isinstance(gaze.hull, TorpedoHull):
        contact = _on_cylinder(gaze.hull, anchor, place, flange_size_mm(attachment))
    elif isinstance(gaze.hull, FileHull):
        surface = closed_surface(file_hull_solid(gaze.hull))
        vertices = 1000 * pose.inv().apply(np.asarray(surface.vertices) / 1000)
        local = trimesh.Trimesh(vertices, surface.faces, process=False)
        contact = surface_contact(local, *flange_size_mm(attachment), place)
    return Seat(body_from_seat=pose, contact=contact, attachment=attachment, wall_mm=gaze.mount.wall_mm)


def _pose(anchor: Anchor, along: ArrayLike, place: str) -> RigidTransform:
    normal = np.array(anchor.normal)
    ahead = np.asarray(along, dtype=np.float64) - (np.asarray(along, dtype=np.float64) @ normal) * normal
    length = np.linalg.norm(ahead)
    if length < 0.1:
        towards = tuple(np.round(np.asarray(along, dtype=np.float64), 3).tolist())
        raise ValueError(f"{place}: expected a hull that does not face along {towards} there")
    x = ahead / length
    axes = np.column_stack([x, np.cross(normal, x), normal])
    return RigidTransform.from_components(np.array(anchor.point_mm) / 1000, Rotation.from_matrix(axes))


def _on_cylinder(hull: TorpedoHull, anchor: Anchor, place: str, size_mm: tuple[float, float]) -> CylinderContact:
    half_length = size_mm[0] / 2
    first, last = -hull.length_mm / 2 + hull.tail_length_mm, hull.length_mm / 2 - hull.nose_length_mm
    if not first + half_length <= anchor.point_mm[0] <= last - half_length:
        raise ValueError(
            f"{place}: expected x from {first + half_length:g} to {last - half_length:g}, where the hull is a cylinder"
        )
    radius = hull.diameter_mm / 2
    widest = 2 * radius * np.sin(np.radians(SADDLE_HALF_ANGLE_DEG))
    return CylinderContact(radius_mm=radius, width_mm=float(min(size_mm[1], widest)))


def _placed(seat: Seat, part: Part) -> Part:
    return location_mm(seat.body_from_seat) * part


def _hull_side(seat: Seat) -> Part:
    side = seat.contact.hull_side(seat.length_mm, seat.width_mm)
    return Pos(0, 0, seat.pad_mm) * side if seat.pad_mm else side


def _fastener_room(seat: Seat) -> Part:
    low, high = seat.contact.range_mm[0] - 2, seat.head_mm
    if seat.strapped and isinstance(seat.contact, CylinderContact):
        axis, inner = -seat.contact.radius_mm, seat.contact.radius_mm + seat.wall_mm
        rooms = []
        for x in STRAP_PLACES_MM:
            start, end = (x - STRAP_WIDTH_MM / 2, 0, axis), (x + STRAP_WIDTH_MM / 2, 0, axis)
            core = cylinder((start[0] - 1, 0, axis), (end[0] + 1, 0, axis), inner)
            rooms.append(cylinder(start, end, inner + STRAP_HEIGHT_MM) - core)
        return Part() + rooms
    rooms = []
    if seat.strapped:
        for x in STRAP_PLACES_MM:
            limits = (x - STRAP_WIDTH_MM / 2, x + STRAP_WIDTH_MM / 2)
            rooms.append(box(limits, (-seat.width_mm, seat.width_mm), (seat.floor_mm, seat.floor_mm + STRAP_HEIGHT_MM)))
        return Part() + rooms
    if seat.attachment == "pads":
        return _hull_side(seat)
    for x, y in bolt_places():
        rooms.append(cylinder((x, y, low), (x, y, high + 1), clearance_diameter_mm("M4") / 2))
        rooms.append(cylinder((x, y, high), (x, y, high + seat.head_room_mm), BOLT_HEAD_DIAMETER_MM / 2))
    return Part() + rooms
