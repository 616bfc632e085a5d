"""Where everything is: the frames of a rig, made once from its numbers.

Names read `b_from_a`: ``x_b = b_from_a.apply(x_a)``. The frames are those of `docs/reference/conventions.md`; `gimbal`
has its origin at the centre of M2's face, z along the pan axis (up), x the gaze's azimuth zero; `pan` turns in it by
the pan angle; `m2` is the mirror's own frame (x tilt axis, y up along the face, z outward normal).

A rig that folds up is one that folds down, turned by half a turn about the camera's axis, with both joints reversed:
the gimbal stands on its head, and its pan and tilt are the negatives of what the rig file's joints say.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from optics.kernels.arrays import FloatArray
from rigs import Camera, FoldMirror, GazeMirror, Joint, Joints, Rig

BODY_FROM_OPTICAL = Rotation.from_matrix(np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]))
"""A camera that looks along the body's x: camera z is body x, camera x is body -y, camera y is body -z (REP-103)."""

FOLD_DIRECTIONS = {"down": np.array([0.0, 1.0, 0.0]), "up": np.array([0.0, -1.0, 0.0])}
"""Where M1 sends the optical axis, in the camera frame: image-down or image-up."""

FACE_ELEVATION_AT_ZERO = np.pi / 4
"""Angle of M2's normal above the gimbal's x at zero tilt: half way between the incoming axis and a level gaze."""

ROUNDING_DEG = 1e-9
"""Joint values this far beyond a limit are at it."""


@dataclass(frozen=True, kw_only=True)
class Layout:
    """The frames of a rig with two mirrors.

    Attributes
    ----------
    body_from_camera, body_from_m1, body_from_gimbal : RigidTransform
        Fixed poses, metres.
    pan, tilt : Joint
        Limits, offset and sign of the joints in the gimbal's frame: for a fold up, sign and offset are the negatives of
        the rig file's, so that azimuth and elevation in the body keep their meaning.
    fold_direction : array, shape (3,)
        Where M1 sends the optical axis, a unit vector of the camera frame.
    """

    body_from_camera: RigidTransform
    body_from_m1: RigidTransform
    body_from_gimbal: RigidTransform
    pan: Joint
    tilt: Joint
    fold_direction: FloatArray

    @classmethod
    def from_rig(cls, rig: Rig) -> Layout:
        """Lay out a rig, once; raises `ValueError` for one without mirrors."""
        gaze = rig.require_gaze()
        return _laid_out(rig.camera, gaze.fold_mirror, gaze.gaze_mirror, gaze.joints)

    @property
    def camera_from_m1(self) -> RigidTransform:
        """Pose of the fold mirror in the camera frame."""
        return self.body_from_camera.inv() * self.body_from_m1

    @property
    def camera_from_gimbal(self) -> RigidTransform:
        """Pose of the gimbal in the camera frame."""
        return self.body_from_camera.inv() * self.body_from_gimbal

    @property
    def body_from_mount(self) -> RigidTransform:
        """Pose of the mount frame: the body turned about the pinhole, its x along the view and its z image-up.

        The identity for a camera that looks straight ahead.
        """
        return self._about_pinhole(self._body_from_mount_axes)

    @property
    def body_from_fold(self) -> RigidTransform:
        """Pose of the fold frame, in which M2 is below M1: the mount frame, for a fold up half a turn about its x."""
        turn = self._body_from_mount_axes
        if self.fold_direction[1] < 0:
            turn = Rotation.from_rotvec(np.pi * self.body_from_camera.rotation.apply([0, 0, 1])) * turn
        return self._about_pinhole(turn)

    @property
    def _body_from_mount_axes(self) -> Rotation:
        return self.body_from_camera.rotation * BODY_FROM_OPTICAL.inv()

    def _about_pinhole(self, turn: Rotation) -> RigidTransform:
        pinhole = self.body_from_camera.translation
        return RigidTransform.from_components(pinhole - turn.apply(pinhole), turn)

    def joint_grid(self, count: int) -> FloatArray:
        """Joint values in `count` equal steps over both ranges, shape (count^2, 2), radians; tilt runs fastest."""
        return joint_pairs(self.pan.values(count), self.tilt.values(count))

    def check_joints(self, q1: float, q2: float) -> None:
        """Raise a `ValueError` that names every joint value outside its limits; radians."""
        wrong = [
            f"expected {name} between {joint.min_deg:g} and {joint.max_deg:g} deg, got {np.degrees(q):g}"
            for name, joint, q in (("q1 (pan)", self.pan, q1), ("q2 (tilt)", self.tilt, q2))
            # A limit written in degrees must survive its own conversion to radians and back.
            if not joint.min_deg - ROUNDING_DEG <= np.degrees(q) <= joint.max_deg + ROUNDING_DEG
        ]
        if wrong:
            raise ValueError("; ".join(wrong))

    def body_from_pan(self, q1: float) -> RigidTransform:
        """Pose of the yoke's frame; `q1` in radians."""
        turn = RigidTransform.from_rotation(Rotation.from_euler("z", self.pan.angle(q1)))
        return self.body_from_gimbal * turn

    def body_from_m2(self, q1: float, q2: float) -> RigidTransform:
        """Pose of the gaze mirror; joint values in radians."""
        return self.body_from_pan(q1) * pan_from_m2(self.tilt.angle(q2))

    def moving_frames(self, q1: FloatArray, q2: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Same as `body_from_pan` and `body_from_m2` as matrices, for many joint values at once.

        Parameters
        ----------
        q1, q2 : array, shape (n,)
            Radians.

        Returns
        -------
        array, shape (n, 4, 4)
            Poses of the yoke's frame.
        array, shape (n, 4, 4)
            Poses of the gaze mirror.
        """
        pan, elevation = self.pan.angle(q1), FACE_ELEVATION_AT_ZERO + self.tilt.angle(q2)
        turn, tilt = np.zeros((2, len(q1), 4, 4))
        turn[:, 0, 0] = turn[:, 1, 1] = np.cos(pan)
        turn[:, 1, 0], turn[:, 0, 1] = np.sin(pan), -np.sin(pan)
        turn[:, 2, 2] = turn[:, 3, 3] = 1
        # Columns as in `pan_from_m2`: across, up the face, and its normal.
        tilt[:, 1, 0] = tilt[:, 3, 3] = 1
        tilt[:, 0, 1], tilt[:, 2, 1] = -np.sin(elevation), np.cos(elevation)
        tilt[:, 0, 2], tilt[:, 2, 2] = np.cos(elevation), np.sin(elevation)
        body_from_pan = self.body_from_gimbal.as_matrix() @ turn
        return body_from_pan, body_from_pan @ tilt

    def camera_from_m2_at(self, q1: FloatArray, q2: FloatArray) -> FloatArray:
        """Same as `camera_from_m2` as matrices, shape (n, 4, 4), for joint values of shape (n,)."""
        return np.asarray(self.body_from_camera.inv().as_matrix() @ self.moving_frames(q1, q2)[1])

    def camera_from_m2(self, q1: float, q2: float) -> RigidTransform:
        """Pose of the gaze mirror in the camera frame; joint values in radians."""
        return self.body_from_camera.inv() * self.body_from_m2(q1, q2)


@lru_cache(maxsize=64)
def _laid_out(camera: Camera, fold_mirror: FoldMirror, gaze_mirror: GazeMirror, joints: Joints) -> Layout:
    body_from_camera = camera_pose(camera)
    on_its_head = fold_mirror.direction == "up"
    return Layout(
        body_from_camera=body_from_camera,
        body_from_m1=body_from_camera * fold_mirror_pose(fold_mirror),
        body_from_gimbal=body_from_camera * gimbal_pose(fold_mirror, gaze_mirror),
        pan=_reversed(joints.pan) if on_its_head else joints.pan,
        tilt=_reversed(joints.tilt) if on_its_head else joints.tilt,
        fold_direction=FOLD_DIRECTIONS[fold_mirror.direction],
    )


def joint_pairs(q1: FloatArray, q2: FloatArray) -> FloatArray:
    """All pairs of joint values, shape (n, 2); q2 runs fastest."""
    return np.stack(np.meshgrid(q1, q2, indexing="ij"), axis=-1).reshape(-1, 2)


def check_stows(rig: Rig) -> None:
    """Raise a `ValueError` for a rig whose fold mirror cannot be stowed."""
    if rig.gaze is None or rig.gaze.joints.stow is None:
        raise ValueError(f"joints.stow: expected a hinge, to stow the fold mirror of {rig.name!r}, got none")


def camera_pose(camera: Camera) -> RigidTransform:
    """Pose of the camera in the body frame."""
    # Positive pitch looks up, which is a negative turn about the body's y (left); roll is clockwise from behind.
    angles = [camera.yaw_deg, -camera.pitch_deg, camera.roll_deg]
    turn = Rotation.from_euler("ZYX", angles, degrees=True)
    return RigidTransform.from_components(np.array(camera.position_mm) / 1000, turn * BODY_FROM_OPTICAL)


def fold_mirror_pose(fold_mirror: FoldMirror) -> RigidTransform:
    """Pose of M1 in the camera frame: on the axis, its normal half way between back-to-camera and the fold."""
    axis, fold = np.array([0.0, 0.0, 1.0]), FOLD_DIRECTIONS[fold_mirror.direction]
    normal = (fold - axis) / np.sqrt(2)
    up = -(fold + axis) / np.sqrt(2)
    return RigidTransform.from_components(
        axis * fold_mirror.distance_mm / 1000, Rotation.from_matrix(_axes(up=up, normal=normal))
    )


def gimbal_pose(fold_mirror: FoldMirror, gaze_mirror: GazeMirror) -> RigidTransform:
    """Pose of the gimbal in the camera frame: d1 along the axis, then d2 along the fold."""
    fold = FOLD_DIRECTIONS[fold_mirror.direction]
    origin = np.array([0.0, 0.0, fold_mirror.distance_mm]) + fold * gaze_mirror.distance_mm
    forward = np.array([0.0, 0.0, 1.0])
    up = -fold
    axes = np.column_stack([forward, np.cross(up, forward), up])
    return RigidTransform.from_components(origin / 1000, Rotation.from_matrix(axes))


def pan_from_m2(tilt_angle: float) -> RigidTransform:
    """Pose of M2 in the pan frame; the origin stays where the joint axes cross."""
    elevation = FACE_ELEVATION_AT_ZERO + tilt_angle
    normal = np.array([np.cos(elevation), 0.0, np.sin(elevation)])
    up = np.array([-np.sin(elevation), 0.0, np.cos(elevation)])
    return RigidTransform.from_rotation(Rotation.from_matrix(_axes(up=up, normal=normal)))


def _reversed(joint: Joint) -> Joint:
    """The same joint seen from its other end: the same values and limits, the opposite optical angle."""
    return joint.model_copy(update={"sign": -joint.sign, "offset_deg": -joint.offset_deg})


def _axes(*, up: FloatArray, normal: FloatArray) -> FloatArray:
    return np.column_stack([np.cross(up, normal), up, normal])
