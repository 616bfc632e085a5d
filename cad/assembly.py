"""All parts of a rig as solids, each in the frame of the group it moves with."""

from __future__ import annotations

from dataclasses import dataclass

import trimesh
from build123d import Solid
from scipy.spatial.transform import RigidTransform

from cad.fold_bracket import fold_bracket_solid
from cad.gimbal_base import base_stance, gimbal_base_solid, pan_servo_in_body
from cad.gimbal_dimensions import GimbalDimensions
from cad.hull import hull_shape
from cad.mirror_holder import mirror_holder_solid
from cad.mirrors import mirror_plate
from cad.poses import body_from_group
from cad.servo import servo_solid
from cad.shapes import location_mm
from cad.yoke import tilt_servo_in_pan, yoke_solid
from optics.layout import Layout
from optics.mesh import Group, Role
from rigs import Camera, Rig


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
    solid : Solid or Trimesh
        Shape in millimetres; a triangle mesh only for a hull that came from an STL file.
    printed : bool
        Whether it is to be printed, and so must fit the printer.
    """

    name: str
    group: Group
    role: Role
    solid: Solid | trimesh.Trimesh
    printed: bool = False


@dataclass(frozen=True, kw_only=True)
class Assembly:
    """Parts of a rig and the frames they stand in."""

    parts: tuple[Part, ...]
    layout: Layout

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
    layout = Layout.from_rig(rig)
    dimensions = GimbalDimensions.from_rig(rig)
    if rig.fold_mirror is None or rig.hull is None or rig.mount is None or rig.servos is None:
        raise ValueError(f"expected a rig with mirrors, got {rig.name!r}, which has none")
    _check_camera_is_level(rig.camera)
    stance = base_stance(dimensions, layout)
    pan_servo, tilt_servo = servo_solid(rig.servos.pan), servo_solid(rig.servos.tilt)
    fold_mirror = location_mm(layout.body_from_m1) * mirror_plate(rig.fold_mirror)
    fixed, pan, tilt = Group.FIXED, Group.PAN, Group.TILT
    parts = [
        Part(
            name="hull",
            group=fixed,
            role=Role.HULL,
            solid=hull_shape(rig.hull, rig.mount, rig.port, layout),
        ),
        _printed("fold_bracket", fixed, fold_bracket_solid(rig.fold_mirror, rig.mount, layout)),
        Part(name="fold_mirror", group=fixed, role=Role.MIRROR, solid=fold_mirror),
        _printed("gimbal_base", fixed, gimbal_base_solid(dimensions, stance)),
        Part(
            name="pan_servo",
            group=fixed,
            role=Role.SERVO,
            solid=pan_servo_in_body(dimensions, stance, pan_servo),
        ),
        _printed("yoke", pan, yoke_solid(dimensions)),
        Part(name="tilt_servo", group=pan, role=Role.SERVO, solid=tilt_servo_in_pan(dimensions, tilt_servo)),
        _printed("mirror_holder", tilt, mirror_holder_solid(dimensions)),
        Part(name="gaze_mirror", group=tilt, role=Role.MIRROR, solid=mirror_plate(dimensions.mirror)),
    ]
    return Assembly(parts=tuple(parts), layout=layout)


def _printed(name: str, group: Group, solid: Solid) -> Part:
    return Part(name=name, group=group, role=Role.MOUNT, solid=solid, printed=True)


def _check_camera_is_level(camera: Camera) -> None:
    for key in ("yaw_deg", "pitch_deg", "roll_deg"):
        value = getattr(camera, key)
        if value != 0:
            raise ValueError(f"camera.{key} = {value:g}: expected 0, the mount is made for cameras that look along +x")
