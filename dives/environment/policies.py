"""Policies that are known: the loop's own laws on what an agent sees, and chance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from dives.environment.task import GazeTask
from dives.views.robot_view import robot_view
from optics.kernels.arrays import FloatArray
from optics.mesh import PartMesh
from tracking.loop.loop import TrackingLoop
from tracking.loop.variants import Variant
from tracking.perception import Crop
from tracking.perception.corners.exact import corners_of
from tracking.protocols import CameraFrame, MirrorReport

Observation = dict[str, NDArray[Any]]


class Policy(Protocol):
    """Turns what one environment shows into actions."""

    def begin(self, seed: int) -> None:
        """Forget everything: an episode begins."""

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Action for an observation, shape (2,)."""


class LoopPolicy:
    """A loop of `tracking` that is shown the agent's frame: its detector, filter and law, without functional check.

    Parameters
    ----------
    task : GazeTask
    variant : Variant
    parts : sequence of PartMesh
        Hull and mount, for a variant that ignores the robot in the image.
    """

    def __init__(self, task: GazeTask, variant: Variant, parts: Sequence[PartMesh]):
        self._task, self._variant = task, variant.without_check()
        self._view = robot_view(task.rig, parts) if variant.ignores_robot else None
        self._corners = corners_of(task.rig)

    def begin(self, seed: int) -> None:
        """Forget everything; the loop draws no numbers."""
        del seed
        self._loop = TrackingLoop(
            self._task.rig, self._variant, detector=self._task.dive.detector_settings(), robot_view=self._view
        )
        self._images = 0
        self._q_command: FloatArray | None = None

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """What the loop commands, as the task takes it."""
        q = observation["joints"].astype(np.float64)
        if self._q_command is None:
            self._q_command = q
            # The mirrors stand on the target already: a loop goes on from its last command.
            self._loop.restore({**self._loop.snapshot(), "q_command": q.tolist()})
        time_s = self._images * self._task.step_s
        camera_frame = CameraFrame(image=self._camera_image(observation["frame"], q), time_s=time_s)
        step = self._loop.step(camera_frame, MirrorReport(q=q, time_s=time_s, measured=False))
        self._images += 1
        if self._task.action == "angles":
            self._q_command = step.q_command
            return step.q_command.astype(np.float32)
        limit = self._task.speed_limit
        speeds = np.clip((step.q_command - self._q_command) / self._task.step_s, -limit, limit)
        self._q_command = self._q_command + speeds * self._task.step_s
        return speeds.astype(np.float32)

    def _camera_image(self, frame: NDArray[np.uint8], q: FloatArray) -> NDArray[np.uint8]:
        """The frame where the mirror is in the camera's image; the rest is black."""
        camera = self._task.rig.camera
        size = (camera.width_px, camera.height_px)
        crop = Crop.of(self._corners.corners(q), *frame.shape[1::-1])
        if crop.empty:
            return np.zeros((*size[::-1], 3), dtype=np.uint8)
        return np.asarray(cv2.warpPerspective(frame, crop.image_from_crop, size, borderMode=cv2.BORDER_CONSTANT))


class RandomPolicy:
    """Actions drawn evenly between the task's limits.

    Parameters
    ----------
    task : GazeTask
    """

    def __init__(self, task: GazeTask):
        speeds = task.action == "speeds"
        self._low = -task.speed_limit if speeds else task.gimbal.lowest
        self._high = task.speed_limit if speeds else task.gimbal.highest

    def begin(self, seed: int) -> None:
        """Draw from a seed on."""
        self._rng = np.random.default_rng(seed)

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Draw an action."""
        del observation
        return self._rng.uniform(self._low, self._high).astype(np.float32)
