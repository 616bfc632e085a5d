"""Eqs. 1-3 of Cortes-Perez & Torres-Mendez 2021 as they are written, with every loose end named.

The paper places the mirrors with two homogeneous matrices. To be the system of its figures 3 and 6 they are read so:

- T_0^1 and T_1^2 take coordinates in the frame with the higher number to the one with the lower: eq. 3 needs that.
  They are rigid transforms, SE(3), where the paper prints SO(4).
- Eq. 1: alpha = pi/2 about lambda = -x of the camera, so that z of frame 1 is the folded axis, image-down.
  d_1 = (0, 0, d1) and, alike, d_2 = (0, 0, d2) along that axis.
- Eq. 2: pan and tilt with z of frame 1 pointing down: its q1 is our pan with the other sign, its q2 the elevation of
  M2's normal, our tilt plus 45 degrees. The normal is then *minus* z of frame 2, which points into the plate.
- Eq. 3: the centre of M2 is the origin of frame 2, (0, 0, 0, 1), where the paper prints [0, 0, 1].
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from optics.arrays import FloatArray
from optics.layout import FACE_ELEVATION_AT_ZERO, Layout


def paper_joints(layout: Layout, q1: float, q2: float) -> tuple[float, float]:
    """The paper's (q1, q2) of eq. 2 for joint values of a rig, radians."""
    return -layout.pan.angle(q1), layout.tilt.angle(q2) + FACE_ELEVATION_AT_ZERO


def camera_from_frame_1(d1_m: float) -> FloatArray:
    """Eq. 1: frame 1, on the axis at d1, shape (4, 4)."""
    return _homogeneous(Rotation.from_rotvec([-np.pi / 2, 0.0, 0.0]), [0.0, 0.0, d1_m])


def frame_1_from_frame_2(q1: float, q2: float, d2_m: float) -> FloatArray:
    """Eq. 2: frame 2, at the centre of M2, for the paper's joint values; shape (4, 4)."""
    turn = Rotation.from_euler("z", q1 - np.pi / 2) * Rotation.from_euler("y", q2 - np.pi / 2)
    return _homogeneous(turn, [0.0, 0.0, d2_m])


def gaze_mirror_by_paper(q1: float, q2: float, *, d1_m: float, d2_m: float) -> tuple[FloatArray, FloatArray]:
    """Eq. 3: centre and normal of M2 in the camera frame, shape (3,) each, for the paper's joint values."""
    pose = camera_from_frame_1(d1_m) @ frame_1_from_frame_2(q1, q2, d2_m)
    return pose[:3, 3], -pose[:3, 2]


def _homogeneous(rotation: Rotation, translation: list[float]) -> FloatArray:
    matrix = np.eye(4)
    matrix[:3, :3] = rotation.as_matrix()
    matrix[:3, 3] = translation
    return matrix
