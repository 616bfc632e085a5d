"""What is seen over both mirrors in many episodes at once: one kernel follows the rays of the gaze mirrors' pixels.

Frames are exposed at one instant, on a white card, without noise: no rolling shutter, no blur, no automatic exposure.
A frame does not depend on those that it is rendered with.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from dives.environment.task import GazeTask
from dives.looked_at import pixels_around
from dives.rendered_camera import dive_scene
from optics.kernels.arrays import FloatArray
from optics.mesh import PartMesh
from optics.mirror_outline import mirror_outline
from scenes.baking.light_quality import LightQuality
from scenes.baking.lit_scene import prepare
from scenes.image import display_colours
from scenes.renderer import FastRenderer
from scenes.stage.state import State
from tracking.perception import Crop
from tracking.perception.corners.exact import corners_of


class MirrorCamera:
    """Frames of a task.

    Parameters
    ----------
    task : GazeTask
    parts : sequence of PartMesh
        Hull and mount; may be empty.
    quality : LightQuality, optional
        Full by default.
    """

    def __init__(self, task: GazeTask, parts: Sequence[PartMesh], quality: LightQuality | None = None):
        self._task = task
        self._corners = corners_of(task.rig)
        self._outline = mirror_outline(task.rig.require_gaze().gaze_mirror)
        camera = task.rig.camera
        share = min(1.0, task.frame_px / self._mirror_px())
        width, height = (max(1, round(share * size)) for size in (camera.width_px, camera.height_px))
        self._shrunk = np.array([width / camera.width_px, height / camera.height_px])
        lit = prepare(dive_scene(task.dive, task.rig), task.rig, parts, quality=quality)
        self._renderer = FastRenderer(lit, width_px=width, height_px=height)

    def frames(self, states: Sequence[State], q: FloatArray) -> NDArray[np.uint8]:
        """Crops of the gaze mirror, uint8 sRGB, shape (n, frame_px, frame_px, 3).

        Parameters
        ----------
        states : sequence of State
            n of them.
        q : array, shape (n, 2)
            Joint values from which the crop's place is found, radians.
        """
        rows, columns = self._renderer.shape
        corners = [(self._corners.corners(each) + 0.5) * self._shrunk - 0.5 for each in q]
        rays, pixels = zip(
            *(self._renderer.rays_of(pixels_around([each], (columns, rows))) for each in corners), strict=True
        )
        images = np.zeros((len(states), rows * columns, 3), dtype=np.uint8)
        if any(len(each) for each in rays):
            arrays = self._renderer.arrays(states, truth=False, chosen=rays, depth_m=self._task.dive.depth_m)
            radiance = np.stack([channel.numpy() for channel in arrays.rgb], axis=-1)
            state = np.repeat(np.arange(len(states)), [len(each) for each in rays])
            images[state, np.concatenate(pixels)] = display_colours(radiance, self._renderer.scene)
        size = self._task.frame_px
        return np.stack(
            [
                Crop.of(outline, size, size, self._outline).take(image.reshape(rows, columns, 3))
                for outline, image in zip(corners, images, strict=True)
            ]
        )

    def _mirror_px(self) -> float:
        """Shorter side of the gaze mirror's image in the middle of the joints' range, in the camera's pixels."""
        corners = self._corners.corners(self._task.gimbal.middle)
        if not np.isfinite(corners).all():
            raise ValueError(
                f"expected a camera that sees the gaze mirror in the middle of its range, got {self._task.rig.name!r}"
            )
        return float(np.ptp(corners, axis=0).min())
