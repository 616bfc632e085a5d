"""How far a pixel of the crop is in gaze, and how the crop's axes turn the joints.

The crop's outline is the mirror's own, so its x runs along the tilt axis, to the right of who looks along the gaze
while the gaze is ahead, and its y down the mirror. The columns of the direction's Jacobian (`optics.gaze.jacobian`) lie
along the same two axes. When pan turns by dP to the left and tilt by dt upwards, the gaze turns by -cos 2t dP to
crop-right and by 2 dt to crop-up, whatever the elevation. What does not move therefore runs through the crop by

    dx = cos 2t dP / r_x        dy = 2 dt / r_y        r: radians to a pixel

Tilt keeps its sign everywhere. Pan turns its own over the zenith, where cos 2t < 0: there the crop stands upside down
in the world, its right is the world's left.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from optics.kernels.arrays import FloatArray
from tracking.estimation.gimbal import Gimbal
from tracking.estimation.lines_of_sight import LinesOfSight
from tracking.perception import Crop

MIDDLE = 0.5
"""Share of the crop over which its scale is taken: the outer parts may miss M1."""


def crop_scale(lines_of_sight: LinesOfSight, crop_at: Callable[[FloatArray], Crop], q: FloatArray) -> FloatArray:
    """Radians of gaze to a pixel of the crop along x and y, shape (2,), at joint values; nan where no mirror is seen.

    The mean over the crop's middle half of the angle between the rays of its ends, through port and mirrors.
    """
    crop = crop_at(q)
    if crop.empty:
        return np.full(2, np.nan)
    centre, size = np.array(crop.centre_px), np.array([crop.width_px, crop.height_px])
    scale = np.full(2, np.nan)
    for axis, length in enumerate(MIDDLE * size):
        offset = np.eye(2)[axis] * length / 2
        ends = [lines_of_sight.ray(pixel, q) for pixel in crop.to_image([centre - offset, centre + offset])]
        if ends[0] is not None and ends[1] is not None:
            scale[axis] = _angle(ends[0].direction, ends[1].direction) / length
    return scale


def level_pose(gimbal: Gimbal) -> FloatArray:
    """Joint values of a level gaze with pan in its middle, or next to it within the limits; shape (2,), radians."""
    level = gimbal.joint_values(gimbal.angles(gimbal.middle)[0], 0.0)
    return np.clip(level, gimbal.lowest, gimbal.highest)


def centroid_motion(gimbal: Gimbal, scale: FloatArray, q: FloatArray) -> FloatArray:
    """B of eq. 8: pixels of the crop that a still target moves, to a radian of each joint, shape (2, 2).

    Of a target in the middle: that a pan off the horizon turns the image about its middle as well is left out.
    """
    _, tilt = gimbal.angles(q)
    return np.asarray(np.diag(gimbal.signs * [math.cos(2 * tilt), 2.0] / scale))


def _angle(a: FloatArray, b: FloatArray) -> float:
    return math.atan2(float(np.linalg.norm(np.cross(a, b))), float(a @ b))
