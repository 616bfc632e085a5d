"""The frames of a rig over a dive: the links and joints of the exported URDF, and the vehicle in the world.

A node that turns joint values into transforms (`robot_state_publisher`) would publish the same ones from the URDF.
The virtual camera is among them: two reflections are a proper rigid motion, which three revolute joints in a row can
make (`cad.export.robot.robot`). One reflection is not, so the camera's image behind M1 alone has no frame.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from cad.assembly.meshes import rig_meshes
from cad.export.robot.robot import LINKS, LinkJoint, robot_model
from cad.parts.stow_hinge import stow_hinge
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mesh import Group
from rigs import Rig

WORLD = "world"
BODY = LINKS[Group.FIXED]
"""The URDF's first link: its frame is the body's."""


FOLD_MIRROR = "fold_mirror"
"""Name of M1's plate among the parts."""


@dataclass(frozen=True, kw_only=True)
class Motion:
    """Pose of a frame in its parent over the images of a dive.

    Attributes
    ----------
    parent, child : str
    translation_m : array, shape (n, 3)
    quaternion : array, shape (n, 4)
        x, y, z, w.
    """

    parent: str
    child: str
    translation_m: FloatArray
    quaternion: FloatArray

    @classmethod
    def of(cls, parent: str, child: str, parent_from_child: RigidTransform) -> Motion:
        """Take it from `n` poses at once, or from one."""
        turns = parent_from_child.rotation.as_quat(canonical=True)
        return cls(
            parent=parent,
            child=child,
            translation_m=np.atleast_2d(parent_from_child.translation),
            quaternion=np.atleast_2d(turns),
        )

    def at(self, row: int) -> tuple[str, str, FloatArray, FloatArray]:
        """Parent, child, translation and quaternion at one image."""
        return self.parent, self.child, self.translation_m[row], self.quaternion[row]


def rig_joints(rig: Rig) -> tuple[LinkJoint, ...]:
    """Joints of the rig's URDF."""
    layout = Layout.from_rig(rig)
    # A model wants a part on each link, for its mass; joints do not ask for it. On the hinge swings at least M1.
    model = robot_model(rig, layout, rig_meshes(rig), hinge=stow_hinge(rig, layout), swinging=[FOLD_MIRROR])
    return model.joints


def driven_joints(joints: Sequence[LinkJoint]) -> tuple[str, ...]:
    """Names of the joints that a joint state has to give: those that turn and do not follow another."""
    return tuple(joint.name for joint in joints if joint.axis is not None and joint.follows is None)


def fixed_frames(joints: Sequence[LinkJoint]) -> list[Motion]:
    """Frames that do not move against their parents: one pose each."""
    return [Motion.of(joint.parent, joint.child, joint.parent_from_child) for joint in joints if joint.axis is None]


def moving_frames(joints: Sequence[LinkJoint], values: Mapping[str, FloatArray]) -> list[Motion]:
    """Frames behind the joints that turn.

    Parameters
    ----------
    joints : sequence of LinkJoint
    values : mapping
        Of each of `driven_joints` to its values over the images, radians, shape (n,).
    """
    motions = []
    for joint in joints:
        if joint.axis is None:
            continue
        followed = joint.follows
        value = values[joint.name] if followed is None else followed.multiplier * values[followed.joint]
        turn = Rotation.from_rotvec(value[:, np.newaxis] * joint.axis)
        pose = joint.parent_from_child * RigidTransform.from_rotation(turn)
        motions.append(Motion.of(joint.parent, joint.child, pose))
    return motions
