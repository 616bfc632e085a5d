"""Records of states: poses of everything as seen from the body, the mirrors, the ball, the sun, the sea."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import RigidTransform

from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mesh import Group
from optics.mirror_outline import OUTLINES
from rigs import Rig
from rigs.gaze import FlatMirror
from scenes.kernels.tracing import Primitive
from scenes.light.materials import Material
from scenes.light.sea import SeaState
from scenes.stage.clearance import Clearance
from scenes.stage.frame import FARTHEST_M
from scenes.stage.records import SNOW, TARGET, WORLD, BallRecord, MirrorPlate, Pose, StateRecord, decoy_group
from scenes.stage.scene import Scene
from scenes.stage.state import State
from scenes.stage.targets import MeshShape
from scenes.worlds.snow import snow_offset_m


class StateRecords:
    """Makes records of the states of a rig on a scene, for the kernels.

    All states are worked out together, as arrays, in double precision.

    Parameters
    ----------
    rig : Rig
    scene : Scene
        Where robot and target are unless a state says otherwise.
    target_instance : int
        Number of the target among the instances.
    """

    def __init__(self, rig: Rig, scene: Scene, *, target_instance: int):
        self.rig, self._stage, self._target_instance = rig, scene, target_instance
        self._layout = Layout.from_rig(rig) if rig.gaze is not None else None
        self._clearance = Clearance(scene.world)

    def of(self, states: Sequence[State]) -> StateRecord:
        """Batch of the records of states; `ValueError` for joints outside their limits."""
        world_from_body = np.array([self.body_pose(state).as_matrix() for state in states])
        body_from_world = _inverse(world_from_body)
        position = world_from_body[:, :3, 3]
        time_s = np.array([state.time_s for state in states])
        body_from = self.body_from(states)
        poses = {WORLD: Pose.of(world_from_body)}
        poses |= {group: Pose.of(_inverse(pose)) for group, pose in body_from.items() if group != Group.FIXED}
        ball, target = self._target(states, world_from_body, body_from_world)
        if target is not None:
            poses[TARGET] = target
        poses |= self._decoys(states, world_from_body)
        if self._stage.snow is not None:
            shift = snow_offset_m(self._stage.snow, position, time_s)
            poses[SNOW] = replace(poses[WORLD], translation=position - shift)
        return StateRecord(
            poses=poses,
            mirrors=self.mirrors(body_from),
            towards_sun=body_from_world[:, :3, :3] @ self._stage.light.towards_sun,
            clearance_m=np.minimum(self._clearance.metres(position), FARTHEST_M),
            ball=ball,
            sea=self._stage.sea.state(time_s),
        )

    def still_between(self, records: StateRecord) -> StateRecord:
        """The same, with what has nothing between two states as it is in the middle one: phases wrap, flakes step."""

        def still(values: FloatArray) -> FloatArray:
            return np.broadcast_to(values[len(values) // 2], values.shape)

        poses, sea = dict(records.poses), records.sea
        if SNOW in poses:
            snow = poses[SNOW]
            poses[SNOW] = Pose(rotation=still(snow.rotation), translation=still(snow.translation))
        if sea is not None:
            sea = SeaState(wave_turns=still(sea.wave_turns), flicker_time_s=still(sea.flicker_time_s))
        nearest = np.full_like(records.clearance_m, records.clearance_m.min())
        return replace(records, poses=poses, sea=sea, clearance_m=nearest)

    def body_pose(self, state: State) -> RigidTransform:
        """Pose of the robot in the world."""
        return self._stage.world_from_body if state.world_from_body is None else state.world_from_body

    def body_from(self, states: Sequence[State]) -> dict[str, FloatArray]:
        """Pose of every group of the rig in the body frame, shape (n, 4, 4)."""
        fixed = {str(Group.FIXED): np.broadcast_to(np.eye(4), (len(states), 4, 4))}
        if self._layout is None:
            return fixed
        for state in states:
            self._layout.check_joints(state.q1, state.q2)
        q1, q2 = np.array([(state.q1, state.q2) for state in states]).T
        pan, tilt = self._layout.moving_frames(q1, q2)
        return fixed | {str(Group.PAN): pan, str(Group.TILT): tilt}

    def mirrors(self, body_from: dict[str, FloatArray]) -> dict[str, MirrorPlate]:
        """Batches of the mirrors, body frame, of poses from `body_from`."""
        gaze = self.rig.gaze
        if self._layout is None or gaze is None:
            return {}
        tilt = body_from[str(Group.TILT)]
        fold = np.broadcast_to(self._layout.body_from_m1.as_matrix(), tilt.shape)
        plates = {Primitive.M1.name: (fold, gaze.fold_mirror), Primitive.M2.name: (tilt, gaze.gaze_mirror)}
        return {name: _mirror_plate(*plate) for name, plate in plates.items()}

    def _target(
        self, states: Sequence[State], world_from_body: FloatArray, body_from_world: FloatArray
    ) -> tuple[BallRecord, Pose | None]:
        """The target as a ball, or its pose as triangles."""
        target = self._stage.target
        ball = BallRecord(
            centre=np.zeros((len(states), 3)),
            radius=np.zeros(len(states)),
            material=np.full(len(states), float(Material.TARGET)),
            instance=np.full(len(states), float(self._target_instance)),
        )
        if target is None:
            return ball, None
        moved = [state.world_from_target for state in states]
        world_from_target = np.array(
            [(target.world_from_target if pose is None else pose).as_matrix() for pose in moved]
        )
        # Carried into the body frame here, in double precision.
        if isinstance(target.shape, MeshShape):
            return ball, Pose.of(_inverse(world_from_target) @ world_from_body)
        centre = (body_from_world @ world_from_target)[:, :3, 3]
        own, material = target.shape.radius_m, float(target.shape.material)
        radius = [own if state.target_radius_m is None else state.target_radius_m for state in states]
        return replace(ball, centre=centre, radius=np.array(radius), material=np.full(len(states), material)), None

    def _decoys(self, states: Sequence[State], world_from_body: FloatArray) -> dict[str, Pose]:
        """Poses of the decoys by group; `ValueError` when a state has more or fewer than the scene."""
        decoys = self._stage.decoys
        own = tuple(decoy.world_from_target for decoy in decoys)
        moved = [own if state.world_from_decoys is None else state.world_from_decoys for state in states]
        counts = {len(poses) for poses in moved}
        if counts != {len(decoys)}:
            raise ValueError(f"expected poses of {len(decoys)} decoys in each state, got {sorted(counts)}")
        return {
            decoy_group(number): Pose.of(
                _inverse(np.array([poses[number].as_matrix() for poses in moved])) @ world_from_body
            )
            for number in range(len(decoys))
        }


def _inverse(pose: FloatArray) -> FloatArray:
    """Inverses of rigid poses, shape (n, 4, 4)."""
    turn = pose[:, :3, :3].transpose(0, 2, 1)
    inverse = np.zeros_like(pose)
    inverse[:, :3, :3] = turn
    inverse[:, :3, 3] = -(turn @ pose[:, :3, 3, np.newaxis])[..., 0]
    inverse[:, 3, 3] = 1
    return inverse


def _mirror_plate(pose: FloatArray, plate: FlatMirror) -> MirrorPlate:
    return MirrorPlate(
        centre=pose[:, :3, 3],
        x=pose[:, :3, 0],
        y=pose[:, :3, 1],
        outline=OUTLINES[plate.outline](
            half_width=np.full(len(pose), plate.width_mm / 2000), half_height=np.full(len(pose), plate.height_mm / 2000)
        ),
    )
