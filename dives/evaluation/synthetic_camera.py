"""A camera that draws instead of rendering: a red ball in the gaze mirror's outline, both where the exact train says.

It has no water, no light, no noise and no exposure time: what it leaves of a dive is geometry and time, at a hundredth
of the cost of a rendered image.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from optics import OpticalTrain
from optics.kernels.arrays import FloatArray, to_columns, to_rows
from optics.kernels.backend import Array3f64
from optics.layout import Layout
from optics.train import compiled_project
from rigs import ImageSensorSpec, Rig
from tracking.estimation.gimbal import Gimbal
from tracking.perception import ColourWindow, DetectorSettings
from tracking.perception.corners.exact import corners_of

WATER, MIRROR, BALL = (20, 60, 110), (90, 120, 130), (190, 30, 25)
"""sRGB of the image, of the gaze mirror in it, and of the ball."""

DRAWN_BALL = DetectorSettings(window=ColourWindow(hue_from_deg=340, hue_to_deg=20, saturation_min=0.5))
"""The detector's own settings but for the colour, which no water has changed."""

LIMB_POINTS = 24
SUBPIXEL_BITS = 4


class SyntheticCamera:
    """Images of a ball over the gaze mirror.

    Parameters
    ----------
    rig : Rig
        With mirrors.
    radius_m : float
        Of the ball.

    Attributes
    ----------
    rig : Rig
        With a shutter that opens all rows at once, as they are drawn.
    """

    def __init__(self, rig: Rig, radius_m: float):
        self.rig, self.radius_m = _with_global_shutter(rig), radius_m
        layout = Layout.from_rig(rig)
        self._gimbal = Gimbal(layout)
        self._centre_m: FloatArray = layout.body_from_gimbal.translation
        self._camera_from_body = layout.body_from_camera.inv()
        self._corners = corners_of(rig)
        # Camera, port and M1 do not move: their numbers are handed to the kernel once. M2 is reflected at here.
        q1, q2 = self._gimbal.middle.tolist()
        train = OpticalTrain.from_rig(rig, q1=q1, q2=q2)
        fixed = replace(train, mirrors=train.mirrors[:1])
        self._parameters, self._project = fixed.parameters(), compiled_project(*fixed.kind)
        # Kept, because copying an image takes a tenth of the time of filling one with a colour.
        self._water = np.full((rig.camera.height_px, rig.camera.width_px, 3), WATER, dtype=np.uint8)
        angle = np.linspace(0, 2 * np.pi, LIMB_POINTS, endpoint=False)[:, np.newaxis]
        self._circle = np.cos(angle), np.sin(angle)

    def image(self, q: FloatArray, target_m: FloatArray) -> NDArray[np.uint8]:
        """Draw what the camera would see, uint8, shape (height, width, 3).

        Parameters
        ----------
        q : array, shape (2,)
            True joint values, radians.
        target_m : array, shape (3,)
            Ball's centre from the centre of M2, body frame.
        """
        image = self._water.copy()
        corners = self._corners.corners(q)
        if np.isnan(corners).any():
            return image
        cv2.fillPoly(image, [_fixed(corners)], MIRROR, shift=SUBPIXEL_BITS)
        limb = self.pixels(q, target_m + self.radius_m * self._across(target_m))
        if np.isfinite(limb).all():
            hull = cv2.convexHull(limb.astype(np.float32))
            _, seen = cv2.intersectConvexConvex(corners.astype(np.float32), hull)
            if seen is not None:
                cv2.fillPoly(image, [_fixed(np.asarray(seen)[:, 0])], BALL, shift=SUBPIXEL_BITS)
        return image

    def pixels(self, q: FloatArray, points_m: FloatArray) -> FloatArray:
        """Where points from the centre of M2, body frame, shape (n, 3), would appear over both mirrors, shape (n, 2).

        As `OpticalTrain.project` has it, beyond the mirrors' edges too; nan behind M2.
        """
        normal = self._gimbal.normal(q)
        ahead = (points_m @ normal)[:, np.newaxis]
        unfolded = self._centre_m + points_m - 2 * ahead * normal
        columns = to_columns(self._camera_from_body.apply(unfolded))
        projected: tuple[Any, ...] = self._project(self._parameters, Array3f64(*columns))
        return np.asarray(np.where(ahead > 0, to_rows(projected[:2]), np.nan))

    def _across(self, observation: FloatArray) -> FloatArray:
        """Unit circle across a line of sight, shape (LIMB_POINTS, 3)."""
        _, _, axes = np.linalg.svd(observation[np.newaxis])
        cosine, sine = self._circle
        return np.asarray(cosine * axes[1] + sine * axes[2])


def _fixed(points_px: NDArray[Any]) -> NDArray[np.int32]:
    """Pixels as OpenCV takes fractions of them."""
    return np.round(np.asarray(points_px) * (1 << SUBPIXEL_BITS)).astype(np.int32)


def _with_global_shutter(rig: Rig) -> Rig:
    sensor = rig.image_sensor or ImageSensorSpec()
    return rig.model_copy(update={"image_sensor": sensor.model_copy(update={"row_time_us": 0.0})})
