"""All parts of a rig as solids, each in the frame of the group it moves with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from operator import attrgetter
from typing import TypeAlias

import numpy as np
import trimesh
from build123d import Location, Solid
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from cad.assembly.part_meshes import kept_mesh, part_key
from cad.assembly.print_pose import fits_printer
from cad.assembly.tessellation import HULL_LINEAR_TOLERANCE_MM, LINEAR_TOLERANCE_MM, tessellated
from cad.hulls.hull import file_hull_surface, hull_shape
from cad.hulls.window import solid_with_window, with_window
from cad.parts.bands import BAND, band_hardware
from cad.parts.bracket.bracket_joint import FRONT, REAR, bracket_joint, halves, joint_hardware
from cad.parts.bracket.bracket_placement import BracketPlacement, bracket_placement
from cad.parts.bracket.fold_bracket import fold_bracket_solid
from cad.parts.flange import flange_hardware
from cad.parts.gimbal_base import base_hardware, base_placement, flange_seat, gimbal_base_solid, pan_servo_in_body
from cad.parts.gimbal_dimensions import GimbalDimensions
from cad.parts.hardware import Hardware
from cad.parts.mirror_holder import holder_hardware, mirror_holder_solid, tilt_horn_in_m2
from cad.parts.mirrors import clip_hardware, mirror_clip, mirror_plate
from cad.parts.servo import HORN_DIAMETER_MM, HORN_SCREW, HORN_SCREW_CIRCLE_MM, check_servo, servo_solid
from cad.parts.stow_bracket import arm_solid, deck_solid, hinge_hardware, stow_servo_in_body
from cad.parts.stow_hinge import StowHinge, stow_hinge
from cad.parts.yoke import pan_horn_in_pan, tilt_servo_in_pan, yoke_hardware, yoke_solid
from cad.poses import body_from_group
from cad.shapes import location_matrix, location_mm
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mesh import Group, PartMesh, Role
from rigs import Mount, Rig, Servo
from rigs.gaze import FlatMirror

Shape: TypeAlias = Solid | trimesh.Trimesh
Make: TypeAlias = Callable[[], Shape]

Key: TypeAlias = Callable[..., str | None]
"""From a part's name and all that its shape comes from, the key of its mesh in the cache (`part_key`)."""


@dataclass(frozen=True, kw_only=True)
class Part:
    """One named part.

    Attributes
    ----------
    name : str
        Unique in an assembly.
    group : Group
        What it moves with, and so the frame its solid is given in: body, pan or m2.
    role : Role
        What it is.
    make : callable
        Makes its `solid`.
    printed : bool
        Whether it is to be printed, and so must fit the printer.
    catalogue : str
        What to order, for a part that is bought.
    stows : bool
        Whether it swings with the fold mirror on the hinge of `Assembly.stow`; its solid is given in use.
    wraps : bool
        Whether it is a band, laid around the hull open and closed in its place.
    seen : Trimesh, optional
        What rays hit, millimetres, where that is not the solid's surface: of a hull from a file its own triangles.
    kept_as : str, optional
        Key of its mesh in the cache; without one it is made.
    """

    name: str
    group: Group
    role: Role
    make: Make
    printed: bool = False
    catalogue: str = ""
    stows: bool = False
    wraps: bool = False
    seen: trimesh.Trimesh | None = None
    kept_as: str | None = None

    @cached_property
    def solid(self) -> Shape:
        """Shape in millimetres; closed triangles only for a hull that came from a mesh. Made when first asked for."""
        return self.make()

    @cached_property
    def mesh(self) -> PartMesh:
        """Closed surface of the part in metres, in the frame of its group; made when it is first asked for."""
        return self._made_mesh() if self.kept_as is None else kept_mesh(self.kept_as, self._made_mesh, self._named)

    def _made_mesh(self) -> PartMesh:
        surface = self.solid
        if not isinstance(surface, trimesh.Trimesh):
            surface = tessellated(surface, HULL_LINEAR_TOLERANCE_MM if self.role is Role.HULL else LINEAR_TOLERANCE_MM)
        return self._as_mesh(surface)

    @cached_property
    def seen_mesh(self) -> PartMesh:
        """What rays hit of the part, as `mesh` gives what bodies touch."""
        return self.mesh if self.seen is None else self._as_mesh(self.seen)

    def _as_mesh(self, surface: trimesh.Trimesh) -> PartMesh:
        vertices_m = np.asarray(surface.vertices, dtype=np.float64) / 1000
        return self._named(vertices_m, np.asarray(surface.faces, dtype=np.int32))

    def _named(self, vertices_m: FloatArray, faces: NDArray[np.int32]) -> PartMesh:
        return PartMesh(name=self.name, group=self.group, role=self.role, vertices_m=vertices_m, faces=faces)


@dataclass(frozen=True, kw_only=True)
class Assembly:
    """A rig, its parts and the frames they stand in; `stow` is the fold mirror's hinge, if it has one."""

    rig: Rig
    parts: tuple[Part, ...]
    layout: Layout
    stow: StowHinge | None = None

    @property
    def meshes(self) -> list[PartMesh]:
        """Parts as closed surfaces, in their order."""
        return [part.mesh for part in self.parts]

    @property
    def printed(self) -> list[PartMesh]:
        """Parts to be printed, as triangles."""
        return [part.mesh for part in self.parts if part.printed]

    @property
    def seen_meshes(self) -> list[PartMesh]:
        """What rays hit of the parts, in their order."""
        return [part.seen_mesh for part in self.parts]

    @property
    def stowed_meshes(self) -> list[PartMesh]:
        """What rays hit of the parts, with the fold mirror stowed where it has a hinge."""
        if self.stow is None:
            return self.seen_meshes
        moved = self.stow.body_from_stowing(np.radians(self.stow.max_deg))
        return [
            replace(part.mesh, vertices_m=moved.apply(part.mesh.vertices_m)) if part.stows else part.seen_mesh
            for part in self.parts
        ]

    def part(self, name: str) -> Part:
        """Part of a given name; raises `ValueError` when there is none."""
        for part in self.parts:
            if part.name == name:
                return part
        raise ValueError(f"expected a part ({', '.join(part.name for part in self.parts)}), got {name!r}")

    def pose(self, part: Part, q1: float, q2: float) -> RigidTransform:
        """Pose of a part's frame in the body frame, metres; joint values in radians."""
        return body_from_group(self.layout, part.group, q1, q2)


def build_assembly(rig: Rig) -> Assembly:
    """Build every part of a rig.

    Raises
    ------
    ValueError
        For a rig without mirrors, or one whose numbers make no mount; the message begins with the key to change.
    """
    assembly = _assembly(rig, lambda name, *inputs: None)
    # What cannot be made is told here.
    list(map(attrgetter("solid"), assembly.parts))
    return assembly


def kept_assembly(rig: Rig) -> Assembly:
    """As `build_assembly`, for triangles alone: large parts from the cache, where their solids need not be made."""
    return _assembly(rig, part_key)


def _assembly(rig: Rig, key: Key) -> Assembly:
    """Parts of a rig, whose solids are made when they are asked for."""
    layout = Layout.from_rig(rig)
    dimensions = GimbalDimensions.from_rig(rig)
    gaze = rig.require_gaze()
    mount, servos = gaze.mount, gaze.servos
    for which in ("pan", "tilt", "stow"):
        if (servo := getattr(servos, which)) is not None:
            check_servo(servo, f"servos.{which}")
    placement = base_placement(dimensions, layout)
    seat = flange_seat(rig, placement)
    fold, hinge = bracket_placement(rig, layout), stow_hinge(rig, layout)
    fixed, pan, tilt = Group.FIXED, Group.PAN, Group.TILT
    hull = _hull(rig, layout, key)
    foot, base = dimensions.foot, location_matrix(placement.body_from_base)
    base_key = key("gimbal_base", foot, base, placement.reach_mm, placement.height_mm, seat)
    parts = [
        hull,
        *_fold_parts(fold, hinge, key),
        _printed("gimbal_base", fixed, lambda: gimbal_base_solid(foot, placement, seat), base_key),
        _servo(
            "pan_servo", fixed, lambda: pan_servo_in_body(dimensions, placement, servo_solid(servos.pan)), servos.pan
        ),
        _horn("pan_horn", pan, lambda: pan_horn_in_pan(dimensions), servos.pan),
        _printed("yoke", pan, lambda: yoke_solid(dimensions), key("yoke", dimensions)),
        _servo("tilt_servo", pan, lambda: tilt_servo_in_pan(dimensions, servo_solid(servos.tilt)), servos.tilt),
        _horn("tilt_horn", tilt, lambda: tilt_horn_in_m2(dimensions), servos.tilt),
        _printed("mirror_holder", tilt, lambda: mirror_holder_solid(dimensions), key("mirror_holder", dimensions)),
        _mirror("gaze_mirror", tilt, lambda: mirror_plate(dimensions.mirror), dimensions.mirror, mount),
    ]
    if mount.mirror_fixing == "screws":
        parts += _clip("gaze_mirror", tilt, dimensions.mirror, mount.wall_mm, Location())
    hardware = base_hardware(dimensions, placement, seat) + yoke_hardware(dimensions) + holder_hardware(dimensions)
    seats = [end for end in (fold.seat.moved(fold.body_from_fold), seat) if end.strapped]
    if seats:
        surface = trimesh.Trimesh(1000 * hull.mesh.vertices_m, hull.mesh.faces, process=False)
        hardware += band_hardware(seats, surface)
    return Assembly(rig=rig, parts=(*parts, *map(_bought, hardware)), layout=layout, stow=hinge)


def _hull(rig: Rig, layout: Layout, key: Key) -> Part:
    gaze = rig.require_gaze()
    hull = Part(
        name="hull",
        group=Group.FIXED,
        role=Role.HULL,
        make=lambda: solid_with_window(hull_shape(gaze.hull, gaze.mount, rig.port, layout), rig),
    )
    if rig.file_hull is not None:
        return replace(hull, seen=with_window(file_hull_surface(rig.file_hull), rig))
    return replace(hull, kept_as=key("hull", gaze.hull, gaze.mount, rig.port, layout))


def _fold_parts(placement: BracketPlacement, hinge: StowHinge | None, key: Key) -> list[Part]:
    """Fold bracket, M1 and what holds them, in the body frame; in two parts where M1 can be stowed."""
    place = location_mm(placement.body_from_fold) * placement.fold_from_cell
    mirror = placement.mirror
    swinging = [
        _mirror("fold_mirror", Group.FIXED, lambda: place * mirror_plate(mirror), mirror, placement.mount),
    ]
    if placement.fixing == "screws":
        swinging += _clip("fold_mirror", Group.FIXED, mirror, placement.cell_wall_mm, place)
    bolts = flange_hardware(placement.seat, "fold")
    body = location_mm(placement.body_from_fold)
    standing = [_bought(replace(bolt, pose=body * bolt.pose)) for bolt in bolts]
    if hinge is None:
        return [*_fixed_bracket(placement, key), *swinging, *standing]
    on_deck, on_arm = hinge_hardware(hinge)
    standing = [_printed("fold_bracket", Group.FIXED, partial(deck_solid, hinge)), *standing, *map(_bought, on_deck)]
    swinging = [_printed("fold_arm", Group.FIXED, partial(arm_solid, hinge)), *swinging, *map(_bought, on_arm)]
    if hinge.servo:
        servo, horn = stow_servo_in_body(hinge)
        standing.append(_servo("stow_servo", Group.FIXED, lambda: servo, hinge.servo))
        swinging.append(_horn("stow_horn", Group.FIXED, lambda: horn, hinge.servo))
    return standing + [replace(part, stows=True) for part in swinging]


def _fixed_bracket(placement: BracketPlacement, key: Key) -> list[Part]:
    """Fold bracket without a hinge: whole, or where the printer is too small and the girders have room, in halves."""
    kept_as = key("fold_bracket", placement)
    whole = _printed("fold_bracket", Group.FIXED, lambda: fold_bracket_solid(placement), kept_as)
    if fits_printer(whole.mesh, placement.mount) or (joint := bracket_joint(placement)) is None:
        return [whole]
    rear, front = halves(joint, whole.solid)
    body = location_mm(placement.body_from_fold)
    pieces = (replace(piece, pose=body * piece.pose) for piece in joint_hardware(joint))
    ends = [_printed(REAR, Group.FIXED, lambda: rear), _printed(FRONT, Group.FIXED, lambda: front)]
    return [*ends, *map(_bought, pieces)]


def _clip(name: str, group: Group, mirror: FlatMirror, floor_mm: float, place: Location) -> list[Part]:
    """Clip of a mirror that is screwed in, with its screws, on a cell whose floor is that thick."""
    pieces = (replace(piece, pose=place * piece.pose) for piece in clip_hardware(mirror, floor_mm, name, group))
    clip = _printed(f"{name}_clip", group, lambda: place * mirror_clip(mirror, floor_mm))
    return [clip, *map(_bought, pieces)]


def _printed(name: str, group: Group, make: Make, kept_as: str | None = None) -> Part:
    return Part(name=name, group=group, role=Role.MOUNT, make=make, printed=True, kept_as=kept_as)


def _servo(name: str, group: Group, make: Make, servo: Servo) -> Part:
    return Part(name=name, group=group, role=Role.SERVO, make=make, catalogue=f"Servo {servo.name}, {_depth(servo)}")


def _depth(servo: Servo) -> str:
    return f"rated to {servo.depth_rating_m:g} m" if servo.depth_rating_m else "depth rating unknown"


def _horn(name: str, group: Group, make: Make, servo: Servo) -> Part:
    circle = 2 * HORN_SCREW_CIRCLE_MM
    catalogue = f"Round horn {HORN_DIAMETER_MM:g} mm for servo {servo.name}, tapped 4 x {HORN_SCREW} on {circle:g} mm"
    return Part(name=name, group=group, role=Role.SERVO, make=make, catalogue=catalogue)


def _mirror(name: str, group: Group, make: Make, mirror: FlatMirror, mount: Mount) -> Part:
    front = mount.mirror_coating.replace("-", " ")
    catalogue = f"Front-surface mirror {mirror.size}, float glass, {front}, edges sealed and black"
    return Part(name=name, group=group, role=Role.MIRROR, make=make, catalogue=catalogue)


def _bought(piece: Hardware) -> Part:
    return Part(
        name=piece.name,
        group=piece.group,
        role=Role.HARDWARE,
        make=lambda: piece.solid,
        catalogue=piece.piece.catalogue,
        wraps=piece.name.startswith(BAND),
    )
