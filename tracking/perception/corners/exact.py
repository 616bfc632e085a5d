"""Corners of the gaze mirror in the image from joint values, exact: what section 3.1.1 of the paper gave up on.

They are those of the rectangle that the mirror's outline fills: the crop's, also where the mirror is an octagon or an
ellipse and has none there.

The outline of M2 is seen through the port and over M1 alone, so its corners are projected by the train without M2,
which does not depend on the pose. They are smooth functions of the joints, so they are projected once, at Chebyshev
nodes over the joints' range, and kept as polynomials: rounding is all that is lost, and a pose costs tens of
microseconds.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optics.kernels.arrays import FloatArray
from optics.layout import Layout, pan_from_m2
from optics.status import Status
from optics.train import OpticalTrain
from rigs import Joint, Rig
from tracking.perception.corners.inverse_distance import check_joint_values
from tracking.perception.crop import CORNER_COUNT, runs_clockwise

CROP_CORNERS_IN_M2 = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]], dtype=np.float64)
"""Top left, top right, bottom right, bottom left of the crop, in half widths and heights along M2's axes.

M1 shows M2 mirrored: M2's x, to the right for who stands before it, points to the left of the crop.
"""

MARGIN = np.radians(3.0)
"""Beyond the joint limits the polynomials hold this far: backlash and calibration may put a joint there."""

NODE_COUNTS = (24, 48, 96)
"""Nodes a joint; the first count whose polynomials are smooth enough is taken."""

TOLERANCE_PX = 1e-9
"""Largest coefficient that the last quarter of a polynomial may have."""


class ExactCorners:
    """Corners of M2 of a rig, exact through port and fold mirror.

    Parameters
    ----------
    rig : Rig
        With mirrors.

    Raises
    ------
    ValueError
        For a rig without mirrors.
    """

    def __init__(self, rig: Rig):
        self.rig = rig
        self._layout = Layout.from_rig(rig)
        train = OpticalTrain.from_rig(rig, q1=_middle(self._layout.pan), q2=_middle(self._layout.tilt))
        self._before_m2 = replace(train, mirrors=train.mirrors[:1])
        self._outline = np.column_stack([crop_outline_m(rig), np.zeros(4)])
        limits = np.radians([[j.min_deg, j.max_deg] for j in (self._layout.pan, self._layout.tilt)])
        self._centre, self._half = limits.mean(axis=1), np.diff(limits, axis=1)[:, 0] / 2 + MARGIN
        self._table = self._tabulated()
        self._orders = np.arange(len(self._table)) if self._table is not None else np.arange(0)

    def corners(self, q: ArrayLike) -> FloatArray:
        """Pixels, shape (..., 4, 2), in the crop's order for joint values of shape (..., 2), radians.

        Corners that the image's border or M1's edge cuts off keep the pixel at which they would appear, so that the
        crop stays in its place. All four are nan where the camera does not see M2's face.
        """
        q = check_joint_values(q)
        scaled = (q - self._centre) / self._half
        if self._table is None or np.abs(scaled).max(initial=0) > 1:
            return self._projected(q)
        basis = np.cos(np.arccos(scaled)[..., np.newaxis] * self._orders)
        along_tilt = np.tensordot(basis[..., 0, :], self._table, axes=1)
        corners = (basis[..., 1, np.newaxis, :] @ along_tilt)[..., 0, :].reshape(*q.shape[:-1], CORNER_COUNT, 2)
        return _without_backs(corners)

    def seen(self, q: ArrayLike) -> NDArray[np.bool_]:
        """Which of the corners the camera sees, inside the image and M1, shape (..., 4); hull and mount not asked."""
        q = check_joint_values(q)
        image = self._before_m2.project(self._points(q.reshape(-1, 2)).reshape(-1, 3))
        found = image.status.reshape(*q.shape[:-1], CORNER_COUNT) == Status.OK
        return np.asarray(found & runs_clockwise(self.corners(q))[..., np.newaxis])

    def _projected(self, q: FloatArray) -> FloatArray:
        """The same without polynomials, by the train itself."""
        pixels = self._before_m2.project(self._points(q.reshape(-1, 2)).reshape(-1, 3)).pixels
        return _without_backs(pixels.reshape(*q.shape[:-1], CORNER_COUNT, 2))

    def _points(self, q: FloatArray) -> FloatArray:
        """Corners in the camera frame, shape (n, 4, 3), for joint values of shape (n, 2)."""
        poses = (self._layout.camera_from_m2(q1, q2) for q1, q2 in q.tolist())
        return np.array([pose.apply(self._outline) for pose in poses]).reshape(-1, CORNER_COUNT, 3)

    def _grid_points(self, q1: FloatArray, q2: FloatArray) -> FloatArray:
        """Corners in the camera frame, shape (len(q1), len(q2), 4, 3): each joint's pose is made once."""
        in_pan = np.array([pan_from_m2(self._layout.tilt.angle(each)).apply(self._outline) for each in q2.tolist()])
        camera_from_body = self._layout.body_from_camera.inv()
        poses = [camera_from_body * self._layout.body_from_pan(each) for each in q1.tolist()]
        return np.array([pose.apply(in_pan.reshape(-1, 3)) for pose in poses]).reshape(len(q1), len(q2), 4, 3)

    def _tabulated(self) -> FloatArray | None:
        """Chebyshev coefficients, shape (n, n, 8): pan, tilt, corner coordinates; None when they do not fall off.

        They do not when a corner has no pixel somewhere: it passes behind the camera or inside the port.
        """
        for count in NODE_COUNTS:
            angles = (np.arange(count) + 0.5) * np.pi / count
            q1, q2 = self._centre[:, np.newaxis] + self._half[:, np.newaxis] * np.cos(angles)
            pixels = self._before_m2.project(self._grid_points(q1, q2).reshape(-1, 3)).pixels.reshape(count, count, 8)
            if np.isnan(pixels).any():
                return None
            # Discrete orthogonality at the nodes (Trefethen, Approximation Theory and Approximation Practice, ch. 3).
            to_coefficients = np.cos(np.outer(np.arange(count), angles)) * 2 / count
            to_coefficients[0] /= 2
            table = np.einsum("ai,bj,ijk->abk", to_coefficients, to_coefficients, pixels, optimize=True)
            last = 3 * count // 4
            if max(np.abs(table[last:]).max(), np.abs(table[:, last:]).max()) < TOLERANCE_PX:
                # What is left out is as small as what was found small.
                return np.ascontiguousarray(table[:last, :last])
        return None


@lru_cache(maxsize=8)
def corners_of(rig: Rig) -> ExactCorners:
    """`ExactCorners` of a rig, which in one process many ask for: a dive alone six times."""
    return ExactCorners(rig)


def crop_outline_m(rig: Rig) -> FloatArray:
    """Corners of the rectangle that M2 fills, shape (4, 2), along its x and y, in the crop's order.

    `ValueError` for a rig without mirrors.
    """
    gaze = rig.require_gaze()
    sense = -1.0 if gaze.fold_mirror.direction == "up" else 1.0
    return np.asarray(
        sense * CROP_CORNERS_IN_M2 * [gaze.gaze_mirror.width_mm / 2000, gaze.gaze_mirror.height_mm / 2000]
    )


def _middle(joint: Joint) -> float:
    return float(np.radians((joint.min_deg + joint.max_deg) / 2))


def _without_backs(corners: FloatArray) -> FloatArray:
    """All nan where the outline does not run clockwise: the mirror turns its back or its edge."""
    return np.where(runs_clockwise(corners)[..., np.newaxis, np.newaxis], corners, np.nan)
