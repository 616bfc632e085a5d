"""Eqs. 1-3 of Cortes-Perez & Torres-Mendez 2021, read as `docs/explanation/gaze.md` says, against the layout."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from optics.kernels.arrays import FloatArray
from optics.layout import FACE_ELEVATION_AT_ZERO, Layout
from rigs import Rig

AQUA2 = Rig.load("aqua2")
LAYOUT = Layout.from_rig(AQUA2)
D1_M, D2_M = AQUA2.gaze.fold_mirror.distance_mm / 1000, AQUA2.gaze.gaze_mirror.distance_mm / 1000

ROUNDING = 1e-15
"""One product of rotations, on lengths below a metre, twice over."""


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


@given(q1=st.floats(-1.3, 1.3), q2=st.floats(-0.5, 2.1))
def test_the_equations_place_the_same_mirror(q1, q2):
    centre, normal = gaze_mirror_by_paper(*paper_joints(LAYOUT, q1, q2), d1_m=D1_M, d2_m=D2_M)
    pose = LAYOUT.camera_from_m2(q1, q2)
    np.testing.assert_allclose(centre, pose.translation, rtol=0, atol=2 * ROUNDING)
    np.testing.assert_allclose(normal, pose.rotation.as_matrix()[:, 2], rtol=0, atol=2 * ROUNDING)


def test_the_centre_does_not_move_with_the_joints():
    """The paper's claim below eq. 2: with the axes crossing in the face, X_e is invariant; here (0, d2, d1)."""
    for q in ((0.0, 0.0), (1.0, -0.5), (-2.0, 0.7)):
        centre, _ = gaze_mirror_by_paper(*q, d1_m=0.1, d2_m=0.2)
        np.testing.assert_allclose(centre, [0, 0.2, 0.1], rtol=0, atol=ROUNDING)


def test_both_matrices_are_rigid_motions():
    """SE(3), not SO(4) as printed: orthogonal with determinant 1, and a translation."""
    for matrix in (camera_from_frame_1(0.1), frame_1_from_frame_2(0.4, -0.3, 0.2)):
        np.testing.assert_allclose(matrix[:3, :3] @ matrix[:3, :3].T, np.eye(3), rtol=0, atol=ROUNDING)
        assert np.linalg.det(matrix[:3, :3]) > 0
        assert matrix[3].tolist() == [0, 0, 0, 1]


def test_level_gaze_is_the_paper_tilt_of_45_degrees():
    q1, q2 = np.degrees(paper_joints(LAYOUT, 0.0, 0.0))
    np.testing.assert_allclose([q1, q2], [0, 45], rtol=0, atol=1e-13)
