"""The mount as links and joints: what URDF and SDF have in common.

The virtual camera is the real one reflected over M1 and over M2. In the gimbal's frame, with the pan angle P, the tilt
angle t, and A(a) the turn that raises x towards z by a, the motion that takes it from its place at P = t = 0 to its
place at (P, t) is exactly ``Rz(P) A(2 t) Rx(-P)`` about the gimbal's origin (derived in `docs/reference/export.md`).
That is three revolute joints in a row, of which the last two follow tilt and pan: a fixed tree of links can express it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from cad.loads.masses import Body, part_bodies, together
from cad.parts.stow_hinge import StowHinge
from optics.gaze.kinematics import virtual_camera
from optics.kernels.arrays import FloatArray
from optics.layout import Layout, pan_from_m2
from optics.mesh import Group, PartMesh
from rigs import Joint, Rig, Servo

LINKS = {Group.FIXED: "base_link", Group.PAN: "pan_link", Group.TILT: "tilt_link"}
"""Link of each group of parts; the frame of a link is the frame of its group."""
CAMERA = "camera_optical_frame"
VIRTUAL_CAMERA = "virtual_camera_optical_frame"
IMAGINARY_MASS_KG = 1e-6
IMAGINARY_INERTIA_KG_M2 = 1e-9
"""Simulators refuse links that move and weigh nothing; the links of the virtual camera weigh a milligram."""


@dataclass(frozen=True, kw_only=True)
class Follows:
    """A joint whose value is a multiple of another's."""

    joint: str
    multiplier: float


@dataclass(frozen=True, kw_only=True)
class LinkJoint:
    """How a link hangs on another.

    Attributes
    ----------
    name, parent, child : str
    parent_from_child : RigidTransform
        At joint value zero, metres.
    axis : array, shape (3,), or None
        Unit vector in the child's frame about which it turns by the joint value; None for a fixed joint.
    lower, upper : float
        Limits of the joint value, radians.
    effort_n_m, velocity_rad_per_s : float
        What the servo can do.
    follows : Follows or None
        For the joints of the virtual camera.
    """

    name: str
    parent: str
    child: str
    parent_from_child: RigidTransform
    axis: FloatArray | None = None
    lower: float = 0.0
    upper: float = 0.0
    effort_n_m: float = 0.0
    velocity_rad_per_s: float = 0.0
    follows: Follows | None = None


@dataclass(frozen=True, kw_only=True)
class Link:
    """A rigid body; without parts it is a frame only.

    Attributes
    ----------
    name : str
    parts : tuple of PartMesh
        What it consists of, in its frame.
    body : Body or None
        Its mass; None for a frame that does not move against its parent.
    """

    name: str
    parts: tuple[PartMesh, ...] = ()
    body: Body | None = None


@dataclass(frozen=True, kw_only=True)
class Robot:
    """Links and joints of a rig, parents before children."""

    name: str
    links: tuple[Link, ...]
    joints: tuple[LinkJoint, ...]


def robot_model(
    rig: Rig,
    layout: Layout,
    meshes: Sequence[PartMesh],
    *,
    hinge: StowHinge | None = None,
    swinging: Collection[str] = (),
) -> Robot:
    """Links and joints of a rig with mirrors.

    The joints `pan` and `tilt` take the rig file's q1 and q2 in radians. The hull is drawn, but it has no mass and
    nothing collides with it: that is the vehicle's own model's business.

    Parameters
    ----------
    rig : Rig
    layout : Layout
    meshes : sequence of PartMesh
        Each in the frame of its group; M1 in use.
    hinge : StowHinge, optional
        On which the fold mirror swings; the joint `stow` is 0 in use, where alone the virtual camera is what it says.
    swinging : collection of str
        Names of the parts that swing on it.
    """
    gaze = rig.require_gaze()
    bodies = {body.name: body for group in part_bodies(rig, meshes).values() for body in group}
    links = [
        _link(name, [mesh for mesh in meshes if mesh.group is group and mesh.name not in swinging], bodies)
        for group, name in LINKS.items()
    ]
    joints = [
        _servo_joint("pan", layout.pan, gaze.servos.pan, parent="base_link", pose=layout.body_from_gimbal),
        _servo_joint("tilt", layout.tilt, gaze.servos.tilt, parent="pan_link", pose=RigidTransform.identity()),
    ]
    body_from_fold_link = RigidTransform.identity()
    if hinge is not None:
        joint = _stow_joint(hinge)
        joints.append(joint)
        body_from_fold_link = joint.parent_from_child
        at_hinge = body_from_fold_link.inv()
        own = [replace(mesh, vertices_m=at_hinge.apply(mesh.vertices_m)) for mesh in meshes if mesh.name in swinging]
        moved = {name: body.moved(at_hinge) for name, body in bodies.items() if name in swinging}
        links.append(_link("stow_link", own, moved))
    joints += [
        _fixed(
            "fold_mirror_frame",
            body_from_fold_link.inv() * layout.body_from_m1,
            parent="base_link" if hinge is None else "stow_link",
        ),
        _fixed(CAMERA, layout.body_from_camera),
        *_virtual_camera_joints(layout, gaze.servos.pan, gaze.servos.tilt),
    ]
    frames = [Link(name="fold_mirror_frame"), Link(name=CAMERA)]
    imaginary = [_imaginary_link("gaze_elevation_link"), _imaginary_link("gaze_roll_link"), Link(name=VIRTUAL_CAMERA)]
    return Robot(name=rig.name, links=(*links, *frames, *imaginary), joints=tuple(joints))


def _link(name: str, meshes: Sequence[PartMesh], bodies: Mapping[str, Body]) -> Link:
    body = together(name, [bodies[mesh.name] for mesh in meshes if mesh.name in bodies])
    return Link(name=name, parts=tuple(meshes), body=body)


def _stow_joint(hinge: StowHinge) -> LinkJoint:
    """Hinge of the fold mirror; one that is turned by hand and locked has neither effort nor velocity."""
    point, axis = hinge.axis_in_body()
    return LinkJoint(
        name="stow",
        parent="base_link",
        child="stow_link",
        parent_from_child=RigidTransform.from_translation(point),
        axis=axis,
        lower=0.0,
        upper=float(np.radians(hinge.max_deg)),
        effort_n_m=hinge.servo.torque_n_m if hinge.servo else 0.0,
        velocity_rad_per_s=float(np.radians(hinge.servo.speed_deg_per_s)) if hinge.servo else 0.0,
    )


def _servo_joint(name: str, joint: Joint, servo: Servo, *, parent: str, pose: RigidTransform) -> LinkJoint:
    offset = np.radians(joint.offset_deg)
    if name == "pan":
        axis, zero = np.array([0.0, 0.0, joint.sign]), RigidTransform.from_rotation(Rotation.from_euler("z", offset))
    else:
        # The tilt axis is M2's x; a turn about its negative raises the normal.
        axis, zero = np.array([-joint.sign, 0.0, 0.0]), pan_from_m2(offset)
    return LinkJoint(
        name=name,
        parent=parent,
        child=f"{name}_link",
        parent_from_child=pose * zero,
        axis=axis,
        lower=float(np.radians(joint.min_deg)),
        upper=float(np.radians(joint.max_deg)),
        effort_n_m=servo.torque_n_m,
        velocity_rad_per_s=float(np.radians(servo.speed_deg_per_s)),
    )


def _virtual_camera_joints(layout: Layout, pan_servo: Servo, tilt_servo: Servo) -> list[LinkJoint]:
    """From the pan link to the virtual camera: A(2 t), which follows tilt, then Rx(-P), which follows pan."""
    pan_offset, tilt_offset = np.radians([layout.pan.offset_deg, layout.tilt.offset_deg])
    raised = Rotation.from_euler("y", -2 * tilt_offset)
    rolled = Rotation.from_euler("x", -pan_offset)
    elevation = _following(
        "gaze_elevation", "tilt", 2.0, layout.tilt, tilt_servo, parent="pan_link", zero=raised, axis=[0.0, -1.0, 0.0]
    )
    roll = _following(
        "gaze_roll", "pan", 1.0, layout.pan, pan_servo, parent=elevation.child, zero=rolled, axis=[-1.0, 0.0, 0.0]
    )
    # Joint values at which pan and tilt angle are zero, inside the limits or not.
    q1, q2 = -layout.pan.sign * pan_offset, -layout.tilt.sign * tilt_offset
    at_rest = layout.body_from_gimbal.inv() * virtual_camera(layout, q1, q2)
    return [elevation, roll, _fixed(VIRTUAL_CAMERA, at_rest, parent=roll.child)]


def _following(
    name: str,
    leader: str,
    multiplier: float,
    joint: Joint,
    servo: Servo,
    *,
    parent: str,
    zero: Rotation,
    axis: Sequence[float],
) -> LinkJoint:
    return LinkJoint(
        name=name,
        parent=parent,
        child=f"{name}_link",
        parent_from_child=RigidTransform.from_rotation(zero),
        axis=joint.sign * np.array(axis),
        lower=multiplier * float(np.radians(joint.min_deg)),
        upper=multiplier * float(np.radians(joint.max_deg)),
        effort_n_m=servo.torque_n_m,
        velocity_rad_per_s=multiplier * float(np.radians(servo.speed_deg_per_s)),
        follows=Follows(joint=leader, multiplier=multiplier),
    )


def _fixed(child: str, pose: RigidTransform, *, parent: str = "base_link") -> LinkJoint:
    return LinkJoint(name=f"{child}_joint", parent=parent, child=child, parent_from_child=pose)


def _imaginary_link(name: str) -> Link:
    zero = np.zeros(3)
    body = Body(
        name=name,
        mass_kg=IMAGINARY_MASS_KG,
        volume_m3=0.0,
        centre_of_mass_m=zero,
        centre_of_volume_m=zero,
        inertia_kg_m2=IMAGINARY_INERTIA_KG_M2 * np.eye(3),
    )
    return Link(name=name, body=body)
