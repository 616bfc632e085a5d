"""Corners of the gaze mirror in the image from joint values, by inverse-distance weighting (eq. 6)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from optics.kernels.arrays import FloatArray
from tracking.perception.corners.samples import CornerSamples

DEFAULT_POWER = 3.0
"""Of eq. 6; the paper does not say which it used. Larger ones are no better by more than 5 %
(docs/explanation/perception.md)."""


class CornerModel(Protocol):
    """Tells where the gaze mirror's corners appear."""

    def corners(self, q: ArrayLike) -> FloatArray:
        """Pixels, shape (..., 4, 2), in the crop's order for joint values of shape (..., 2), radians."""


@dataclass(frozen=True, kw_only=True)
class InverseDistanceCorners:
    """Eq. 6 for all eight functions at once: a mean of the samples' corners, weighted by distance^-power in (q1, q2).

    At a sample's own joint values its corners are returned exactly. Far from all samples the answer tends to their
    plain mean: the method interpolates, it knows no mirror.
    """

    samples: CornerSamples
    power: float = DEFAULT_POWER

    def __post_init__(self) -> None:
        if not (np.isfinite(self.power) and self.power > 0):
            raise ValueError(f"expected a power above 0, got {self.power}")

    def corners(self, q: ArrayLike) -> FloatArray:
        """Pixels, shape (..., 4, 2), in the crop's order for joint values of shape (..., 2), radians."""
        q = check_joint_values(q)
        away = q[..., np.newaxis, :] - self.samples.q
        squared = (away * away).sum(axis=-1)
        nearest = squared.min(axis=-1, keepdims=True)
        # Relative to the nearest sample's: weights of a tiny distance to a high power would overflow.
        with np.errstate(invalid="ignore", divide="ignore"):
            weight = (nearest / squared) ** (self.power / 2)
        weight = np.where(nearest > 0, weight, squared == 0)
        weight = weight / weight.sum(axis=-1, keepdims=True)
        flat = self.samples.corners_px.reshape(-1, 8)
        return np.asarray((weight @ flat).reshape(*q.shape[:-1], 4, 2))


def check_joint_values(q: ArrayLike) -> FloatArray:
    """Finite joint values of shape (..., 2) as float64, or a `ValueError` that says what came."""
    array = np.asarray(q, dtype=np.float64)
    if array.ndim == 0 or array.shape[-1] != 2 or not np.isfinite(array).all():
        raise ValueError(f"expected finite joint values of shape (..., 2), got {np.asarray(q).tolist()}")
    return array
