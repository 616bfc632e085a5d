"""What a bag says of each image besides the image: joints, frames, the target's truth, what the loop found."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from cad.export.robot.robot import LinkJoint
from dives.bags import messages
from dives.bags.messages import Message
from dives.bags.recording import Recording
from dives.bags.transform_tree import BODY, WORLD, Motion, driven_joints, moving_frames
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from rigs import Rig

CROP = "gaze_mirror_crop"
"""Named as the frame of crop pixels; no transform leads there."""

JOINT_TOPICS = {
    "true": "/joint_states",
    "command": "/joint_states/commanded",
    "estimated": "/joint_states/estimated",
}
"""Topic of each kind of joint values; a node that poses a model listens to the first."""


@dataclass(frozen=True, kw_only=True)
class Facts:
    """Everything but the images, for all images at once: some hundred bytes each.

    Attributes
    ----------
    driven : tuple of str
        Names of the joints.
    joints : dict of str to array, shape (n, joints)
        By the kinds of `JOINT_TOPICS`, radians.
    motions : tuple of Motion
        Frames that move, the vehicle's in the world first.
    target_m : array, shape (n, 3)
        True place of the target's centre in the body's frame.
    estimated_direction : array, shape (n, 3)
        Unit vectors in the body's frame; nan where the loop has none.
    detected_px : array, shape (n, 2)
        In the crop; nan without a detection.
    modes : sequence of str
    """

    driven: tuple[str, ...]
    joints: dict[str, FloatArray]
    motions: tuple[Motion, ...]
    target_m: FloatArray
    estimated_direction: FloatArray
    detected_px: FloatArray
    modes: Sequence[str]

    @classmethod
    def of(cls, recording: Recording, rig: Rig, joints: Sequence[LinkJoint]) -> Facts:
        """Take them from a dive's log and the motion of its vehicle."""
        driven = driven_joints(joints)
        values = {kind: _joint_values(recording.joints_rad(kind), driven) for kind in JOINT_TOPICS}
        moving = moving_frames(joints, dict(zip(driven, values["true"].T, strict=True)))
        # The log tells the target from the centre of the gaze mirror, which does not move in the body.
        to_target = recording.number("target_distance_m")[:, np.newaxis] * recording.directions("true")
        return cls(
            driven=driven,
            joints=values,
            motions=(Motion.of(WORLD, BODY, recording.body_poses()), *moving),
            target_m=Layout.from_rig(rig).body_from_gimbal.translation + to_target,
            estimated_direction=recording.directions("estimated"),
            detected_px=np.stack([recording.number(f"centroid_{axis}_px") for axis in "xy"], axis=1),
            modes=recording.modes(),
        )

    def at(self, row: int, stamp_ns: int) -> Iterator[tuple[str, Message]]:
        """Topics and messages of one image; what is not known is not said."""
        yield "/tf", messages.transforms([motion.at(row) for motion in self.motions], stamp_ns)
        for kind, topic in JOINT_TOPICS.items():
            yield topic, messages.joint_state(self.driven, self.joints[kind][row], stamp_ns)
        yield "/target/truth", messages.point(self.target_m[row], stamp_ns, BODY)
        if np.isfinite(self.estimated_direction[row]).all():
            yield "/target/estimated_direction", messages.vector(self.estimated_direction[row], stamp_ns, BODY)
        if np.isfinite(self.detected_px[row]).all():
            yield "/target/detected_px", messages.point([*self.detected_px[row], 0.0], stamp_ns, CROP)
        yield "/tracking/mode", messages.string(self.modes[row])


def _joint_values(q: FloatArray, driven: Sequence[str]) -> FloatArray:
    """Values of pan and tilt, shape (n, 2), in the order of the joints; the fold mirror's hinge is in use, at zero."""
    columns = {"pan": q[:, 0], "tilt": q[:, 1]}
    return np.stack([columns.get(name, np.zeros(len(q))) for name in driven], axis=1)
