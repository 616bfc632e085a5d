"""How far inverse-distance weighting (eq. 6) is from the exact corners, over the joints' range."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.layout import Layout, joint_pairs
from rigs import Rig
from tracking.perception.corners.exact import ExactCorners
from tracking.perception.corners.inverse_distance import InverseDistanceCorners
from tracking.perception.corners.samples import CornerSamples


@dataclass(frozen=True, kw_only=True)
class CornerError:
    """Error of the corners on a grid of joint values.

    Attributes
    ----------
    q1, q2 : array, shape (n,)
        Radians.
    error_px : array, shape (n, n)
        Of the pose (q1, q2): root mean square over the four corners of their distances from the exact ones; nan where
        the mirror is not seen.
    """

    q1: FloatArray
    q2: FloatArray
    error_px: FloatArray

    @property
    def rms_px(self) -> float:
        """Over the whole range."""
        return float(np.sqrt(np.nanmean(self.error_px**2)))

    @property
    def p95_px(self) -> float:
        """95 of 100 poses have no more."""
        return float(np.nanpercentile(self.error_px, 95))

    @property
    def largest_px(self) -> float:
        """Over the whole range."""
        return float(np.nanmax(self.error_px))


def pose_grid(rig: Rig, columns: int, rows: int) -> FloatArray:
    """Joint values spread evenly from limit to limit, shape (columns * rows, 2), radians; tilt runs fastest."""
    layout = Layout.from_rig(rig)
    return joint_pairs(layout.pan.values(columns), layout.tilt.values(rows))


def exact_samples(rig: Rig, columns: int, rows: int) -> CornerSamples:
    """Samples without any error of their own, at the poses of `pose_grid` at which the mirror is seen."""
    q = pose_grid(rig, columns, rows)
    corners = ExactCorners(rig).corners(q)
    seen = np.isfinite(corners).all(axis=(1, 2))
    return CornerSamples(q=q[seen], corners_px=corners[seen])


def corner_error(rig: Rig, count: int, power: float, grid: int = 61) -> CornerError:
    """Error of eq. 6 with exact samples on a square grid over the joints' range.

    Parameters
    ----------
    rig : Rig
    count : int
        Of samples, a square number.
    power : float
        p of eq. 6.
    grid : int
        Poses along each joint at which the error is told. An odd number meets some of the samples, where it is zero.
    """
    side = round(count**0.5)
    if side < 2 or side**2 != count:
        raise ValueError(f"expected a square number of samples from 4, got {count}")
    model = InverseDistanceCorners(samples=exact_samples(rig, side, side), power=power)
    q = pose_grid(rig, grid, grid)
    away = model.corners(q) - ExactCorners(rig).corners(q)
    error = np.sqrt((away**2).sum(axis=-1).mean(axis=-1))
    q1, q2 = q.reshape(grid, grid, 2)[:, 0, 0], q[:grid, 1]
    return CornerError(q1=q1, q2=q2, error_px=error.reshape(grid, grid))
