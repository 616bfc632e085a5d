"""The paper's filter, eqs. 8 to 10: the state is the target's centroid in the crop.

The paper prints neither A, B, u nor Q and R. Read here as: A = I, so that a centroid stays where it is but for noise;
u is the turn of the joints since the last image and B what that does to the centroid (`tracking.control.crop_scale`),
or nothing (`paper-literal`). With B u the prediction of a lost target stays where it was in the world while the mirror
turns towards it; without, it stays where it was in the crop and the mirror runs on after it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from optics.kernels.arrays import FloatArray
from tracking.estimation.kalman import Estimate, predict, update


@dataclass(frozen=True, kw_only=True)
class CentroidNoise:
    """Standard deviations of w and v, crop pixels on each axis; the paper gives none.

    Attributes
    ----------
    process_px : float
        How far a target wanders in the crop from image to image: at 30 images a second, 6 px of 320 are about
        12 degrees/s.
    measurement_px : float
        How well a detected centroid is known.
    """

    process_px: float = 6.0
    measurement_px: float = 2.0


class CentroidFilter:
    """Where the target is in the crop; without an estimate before the first centroid."""

    def __init__(self, noise: CentroidNoise) -> None:
        self._process = noise.process_px**2 * np.eye(2)
        self._measurement = noise.measurement_px**2 * np.eye(2)
        self._estimate: Estimate | None = None

    @property
    def centroid_px(self) -> FloatArray | None:
        """Expected centroid, shape (2,); None before the first."""
        return None if self._estimate is None else self._estimate.mean

    def predict(self, moved_px: ArrayLike = 0.0) -> None:
        """Go on to the next image, in which the mirror's own turn has moved the target by B u, `moved_px`."""
        if self._estimate is not None:
            self._estimate = predict(self._estimate, np.eye(2), self._process, moved_px)

    def update(self, centroid_px: ArrayLike) -> None:
        """Take in a detected centroid, shape (2,)."""
        if self._estimate is None:
            mean = np.asarray(centroid_px, dtype=np.float64)
            self._estimate = Estimate(mean=mean, covariance=self._measurement)
        else:
            self._estimate = update(self._estimate, centroid_px, np.eye(2), self._measurement).estimate

    def forget(self) -> None:
        """Start again without an estimate."""
        self._estimate = None

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""
        if self._estimate is None:
            return {"mean": None, "covariance": None}
        return {"mean": self._estimate.mean.tolist(), "covariance": self._estimate.covariance.tolist()}

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot."""
        self._estimate = (
            None
            if snapshot["mean"] is None
            else Estimate(mean=np.array(snapshot["mean"]), covariance=np.array(snapshot["covariance"]))
        )
