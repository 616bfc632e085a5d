"""The gimbal as three bodies with named joints: "pan" between base and yoke, "tilt" between yoke and mirror holder.

build123d's revolute joints take the rig's own joint values: sign and offset are in their axes and in the pose at zero,
and their ranges are the rig's limits, in degrees.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from build123d import Axis, Compound, Location, RevoluteJoint, RigidJoint
from scipy.spatial.transform import RigidTransform

from cad.assembly.assembly import Assembly
from cad.shapes import location_mm
from optics.layout import Layout
from optics.mesh import Group
from rigs import Joint

PAN, TILT = "pan", "tilt"


@dataclass(frozen=True, kw_only=True)
class JointedMount:
    """Bodies of a mount, connected by joints; millimetres, in the body frame.

    Attributes
    ----------
    fixed, pan, tilt : Compound
        What stands still, what turns with the yoke and what turns with the mirror; their solids are in the order of the
        assembly's parts. `fixed.joints["pan"]` and `pan.joints["tilt"]` are revolute, their counterparts of the same
        names rigid.
    layout : Layout
        Frames and limits of the rig.
    """

    fixed: Compound
    pan: Compound
    tilt: Compound
    layout: Layout

    def move(self, q1: float, q2: float) -> None:
        """Turn the joints; values in radians.

        Raises
        ------
        ValueError
            For values outside the rig's limits, by the name of the joint.
        """
        self.layout.check_joints(q1, q2)
        self.fixed.joints[PAN].connect_to(self.pan.joints[PAN], angle=_within(self.layout.pan, q1))
        self.pan.joints[TILT].connect_to(self.tilt.joints[TILT], angle=_within(self.layout.tilt, q2))


def jointed_mount(assembly: Assembly) -> JointedMount:
    """Connect the bodies of an assembly by its joints, at q = (0, 0) or the nearest value within the limits.

    A hull that is only a triangle mesh is left out.
    """
    layout = assembly.layout
    bodies = {group: _body(assembly, group) for group in Group}
    mount = JointedMount(fixed=bodies[Group.FIXED], pan=bodies[Group.PAN], tilt=bodies[Group.TILT], layout=layout)
    origin, pan_axis = 1000 * layout.body_from_gimbal.translation, layout.body_from_gimbal.rotation.apply([0, 0, 1])
    pan = Axis(tuple(origin), tuple(layout.pan.sign * pan_axis))
    # Raising M2's normal is a turn about -y of the pan frame.
    tilt = Axis((0, 0, 0), (0, -layout.tilt.sign, 0))
    pan_from_m2 = layout.body_from_pan(0).inv() * layout.body_from_m2(0, 0)
    _connect(mount.fixed, mount.pan, PAN, pan, layout.pan, at_zero=layout.body_from_pan(0))
    _connect(mount.pan, mount.tilt, TILT, tilt, layout.tilt, at_zero=pan_from_m2)
    mount.move(*(float(np.clip(0, *np.radians([joint.min_deg, joint.max_deg]))) for joint in (layout.pan, layout.tilt)))
    return mount


def _body(assembly: Assembly, group: Group) -> Compound:
    parts = [part for part in assembly.parts if part.group is group and not isinstance(part.solid, trimesh.Trimesh)]
    return Compound([part.solid for part in parts], label=group.value)


def _connect(
    standing: Compound, turning: Compound, name: str, axis: Axis, joint: Joint, *, at_zero: RigidTransform
) -> None:
    """Make both halves of a joint; `at_zero` is the turning body's pose in the standing one at joint value zero."""
    RevoluteJoint(name, to_part=standing, axis=axis, angular_range=(joint.min_deg, joint.max_deg))
    place: Location = location_mm(at_zero).inverse() * axis.location
    RigidJoint(name, to_part=turning, joint_location=place)


def _within(joint: Joint, q: float) -> float:
    """Joint value in degrees; a limit survives its conversion to radians and back."""
    return float(np.clip(np.degrees(q), joint.min_deg, joint.max_deg))
