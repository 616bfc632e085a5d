"""What the points that a frame shows move with: the world, the target, the hull, the yoke, or the gaze mirror."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from optics.kernels.arrays import FloatArray
from optics.layout import Layout, camera_pose
from optics.mesh import Group, PartMesh
from rigs import Rig
from scenes.stage.frame import Frame, Label
from scenes.stage.state import State


class Carrier(IntEnum):
    """What a point is fixed to."""

    NOTHING = 0
    """No point is seen, or it is not known what carries it."""
    WORLD = 1
    TARGET = 2
    HULL = 3
    """Everything that does not turn with a joint."""
    PAN = 4
    TILT = 5


CARRIER_OF_GROUP = {Group.FIXED: Carrier.HULL, Group.PAN: Carrier.PAN, Group.TILT: Carrier.TILT}

CARRIER_OF_LABEL = {
    Label.SURFACE: Carrier.WORLD,
    Label.WORLD: Carrier.WORLD,
    Label.TARGET: Carrier.TARGET,
    Label.HULL: Carrier.HULL,
}
"""Labels that say by themselves what their points move with."""

ON_PARTS = (Label.HULL, Label.MOUNT, Label.SERVO, Label.MIRROR_BACK)
"""Labels whose instances are parts of the rig; of a mirror's plate its edge is one, its back has none."""

ON_PLATE_M = 1e-4
"""A point this close to a mirror's plane lies on its plate: single precision at the scale of a world, with room."""


def checked_pose(state: State) -> RigidTransform:
    """The robot's pose of a state, which ground truth cannot do without."""
    if state.world_from_body is None:
        raise ValueError("state.world_from_body: expected the robot's pose, got None")
    return state.world_from_body


def world_from_camera(rig: Rig, state: State) -> RigidTransform:
    """Pose of the real camera."""
    return checked_pose(state) * camera_pose(rig.camera)


def world_from_carriers(rig: Rig, state: State) -> dict[Carrier, RigidTransform]:
    """Pose of everything that points can be fixed to; the target only when the state knows it."""
    body = checked_pose(state)
    poses = {Carrier.WORLD: RigidTransform.identity(), Carrier.HULL: body}
    if state.world_from_target is not None:
        poses[Carrier.TARGET] = state.world_from_target
    if rig.gaze is not None:
        layout = Layout.from_rig(rig)
        poses[Carrier.PAN] = body * layout.body_from_pan(state.q1)
        poses[Carrier.TILT] = body * layout.body_from_m2(state.q1, state.q2)
    return poses


def carriers(
    frame: Frame, rig: Rig, state: State, *, parts: Sequence[PartMesh] = (), instance_names: Sequence[str] = ()
) -> NDArray[np.uint8]:
    """`Carrier` of every pixel's point, shape (height, width).

    Parameters
    ----------
    frame, rig, state
        What was rendered, of which rig, where it was.
    parts : sequence of PartMesh
        The rig's parts; their names among the instances tell which joint they turn with.
    instance_names : sequence of str
        Names that the frame's `instance` counts.
    """
    of_label = np.zeros(max(Label) + 1, dtype=np.uint8)
    for label, carrier in CARRIER_OF_LABEL.items():
        of_label[label] = carrier
    found: NDArray[np.uint8] = of_label[frame.label]
    of_part = {part.name: CARRIER_OF_GROUP[part.group] for part in parts}
    # One more than there are names: instance -1, or one without a name, finds the last, which knows nothing.
    of_instance = np.array([of_part.get(name, Carrier.NOTHING) for name in instance_names] + [0], dtype=np.uint8)
    robot = np.isin(frame.label, ON_PARTS)
    instance = frame.instance[robot]
    on_part = of_instance[np.where(instance < len(instance_names), instance, -1)]
    found[robot] = np.where(on_part != Carrier.NOTHING, on_part, found[robot])
    plate = (frame.label == Label.MIRROR_BACK) & (frame.instance < 0)
    if plate.any() and rig.gaze is not None:
        found[plate] = _plates(frame.point_m[plate].astype(np.float64), rig, state)
    return np.where(np.isfinite(frame.distance_m), found, Carrier.NOTHING).astype(np.uint8)


def _plates(points_m: FloatArray, rig: Rig, state: State) -> NDArray[np.uint8]:
    """Which mirror's plate points lie on: M1 stays with the hull, M2 turns with both joints."""
    layout = Layout.from_rig(rig)
    in_body = checked_pose(state).inv().apply(points_m)
    off_m1 = np.abs(layout.body_from_m1.inv().apply(in_body)[:, 2])
    off_m2 = np.abs(layout.body_from_m2(state.q1, state.q2).inv().apply(in_body)[:, 2])
    found = np.where(off_m1 < off_m2, Carrier.HULL, Carrier.TILT)
    return np.where(np.minimum(off_m1, off_m2) < ON_PLATE_M, found, Carrier.NOTHING).astype(np.uint8)
