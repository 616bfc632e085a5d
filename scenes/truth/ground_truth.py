"""Everything that is known about a frame beside its light."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray
from optics.mesh import PartMesh
from optics.status import Region
from optics.train import OpticalTrain
from rigs import Rig
from scenes.stage.frame import Frame
from scenes.stage.state import State
from scenes.truth.carriers import Carrier, carriers, world_from_camera
from scenes.truth.motion import Motion, motion
from scenes.truth.virtual_view import VirtualView, virtual_view


@dataclass(frozen=True, kw_only=True)
class GroundTruth:
    """A frame with what was computed from it, its rig and its state.

    Attributes
    ----------
    frame, rig, state
        What was rendered, of which rig, where it was.
    instance_names : tuple of str
        Names that `frame.instance` counts.
    target_radius_m : float, optional
        Of a target that is a ball about the origin of its pose; None for another shape.
    view : VirtualView
        z-depth and normals in the virtual camera of each pixel's region.
    carrier : array, shape (height, width)
        `Carrier` of each pixel's point.
    forward, backward : Motion, optional
        To the next and to the previous state, both from this frame's pixels.
    """

    frame: Frame
    rig: Rig
    state: State
    instance_names: tuple[str, ...]
    target_radius_m: float | None
    view: VirtualView
    carrier: NDArray[np.uint8]
    forward: Motion | None
    backward: Motion | None

    @property
    def train(self) -> OpticalTrain:
        """The exact train of the frame."""
        return OpticalTrain.from_rig(self.rig, q1=self.state.q1, q2=self.state.q2)

    @property
    def camera_matrix(self) -> FloatArray:
        """OpenCV's, of the real camera in air at the frame's size, shape (3, 3)."""
        camera = self.rig.camera
        rows, columns = self.frame.region.shape
        x, y = columns / camera.width_px, rows / camera.height_px
        return np.array(
            [
                [camera.fx_px * x, 0, (camera.cx_px + 0.5) * x - 0.5],
                [0, camera.fy_px * y, (camera.cy_px + 0.5) * y - 0.5],
                [0, 0, 1],
            ]
        )

    def world_from_virtual(self) -> dict[Region, FloatArray]:
        """Pose of each region's virtual camera, shape (4, 4); after one mirror its determinant is -1."""
        poses = {Region.DIRECT: world_from_camera(self.rig, self.state).as_matrix()}
        turned = np.eye(4)
        for region, mirror in zip((Region.FOLD, Region.GAZE), self.train.mirrors, strict=False):
            turned = mirror.reflection.as_matrix() @ turned
            poses[region] = poses[Region.DIRECT] @ turned
        return poses


def ground_truth(
    frame: Frame,
    rig: Rig,
    state: State,
    *,
    parts: Sequence[PartMesh] = (),
    instance_names: Sequence[str] = (),
    target_radius_m: float | None = None,
    next_state: State | None = None,
    next_frame: Frame | None = None,
    previous_state: State | None = None,
    previous_frame: Frame | None = None,
) -> GroundTruth:
    """Ground truth of a frame through port and mirrors.

    Parameters
    ----------
    frame : Frame
        With one sample per pixel: with more of them, its geometry is that of each pixel's first sample, which is not
        at the pixel's centre.
    rig : Rig
        As it was rendered: without mirrors when they were stowed.
    state : State
        In which it was rendered, with the robot's pose, and the target's when there is one.
    parts : sequence of PartMesh
        The parts that were rendered, whose names say which instances turn with a joint. Without them, mount and
        servos have no motion vectors.
    instance_names : sequence of str
        Names that `frame.instance` counts.
    target_radius_m : float, optional
        Of a target that is a ball, to tell how much of it is visible.
    next_state, previous_state : State, optional
        To which motion vectors are wanted.
    next_frame, previous_frame : Frame, optional
        Frames of these states, to tell what is hidden in them.

    Raises
    ------
    ValueError
        When a pose is missing or frames differ in size.
    """
    if (next_frame is not None and next_state is None) or (previous_frame is not None and previous_state is None):
        raise ValueError("expected a state for each frame, got next_frame or previous_frame alone")
    train = OpticalTrain.from_rig(rig, q1=state.q1, q2=state.q2)
    view = virtual_view(frame, rig, train, world_from_camera(rig, state).inv())
    carrier = carriers(frame, rig, state, parts=parts, instance_names=instance_names)
    # The train does not lead to what is seen over a further reflection, so that it cannot say where that will be.
    carrier[view.further_reflection] = Carrier.NOTHING
    moves = [
        None if other is None else motion(frame, carrier, rig, state=state, other_state=other, other_frame=shown)
        for other, shown in ((next_state, next_frame), (previous_state, previous_frame))
    ]
    return GroundTruth(
        frame=frame,
        rig=rig,
        state=state,
        instance_names=tuple(instance_names),
        target_radius_m=target_radius_m,
        view=view,
        carrier=carrier,
        forward=moves[0],
        backward=moves[1],
    )
