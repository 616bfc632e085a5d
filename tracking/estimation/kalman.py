"""The linear Kalman filter, eqs. 8 and 9 of the paper, as two functions.

State ``x_k = A x_(k-1) + B u_(k-1) + w``, measurement ``z_k = H x_k + v``, with white noise w of covariance Q and v of
covariance R (Kalman 1960). The update is in Joseph's form, which keeps the covariance symmetric and positive whatever
rounding does to the gain.

A mean may have columns: each column is a state of its own, and all share one covariance because they share A, H, Q
and R. The components of a direction are such columns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from optics.kernels.arrays import FloatArray


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """What is estimated of a state.

    Attributes
    ----------
    mean : array, shape (n,) or (n, k)
        k independent columns of one covariance.
    covariance : array, shape (n, n)
    """

    mean: FloatArray
    covariance: FloatArray


@dataclass(frozen=True, kw_only=True)
class Correction:
    """What a measurement made of an estimate.

    Attributes
    ----------
    estimate : Estimate
    gain : array, shape (n, m)
    innovation : array, shape (m,) or (m, k)
        The measurement less what was expected.
    spread : array, shape (m, m)
        Covariance of the innovation.
    """

    estimate: Estimate
    gain: FloatArray
    innovation: FloatArray
    spread: FloatArray

    @property
    def innovation_squared(self) -> float:
        """Normalised innovation squared, summed over the columns.

        Chi-square distributed with m (times k) degrees of freedom while the model holds.
        """
        return float((self.innovation * np.linalg.solve(self.spread, self.innovation)).sum())


class TimedEstimate:
    """What a filter knows, and when it was so: nothing before its first measurement."""

    def __init__(self) -> None:
        self._estimate: Estimate | None = None
        self._time_s = math.nan

    def forget(self) -> None:
        """Start again without an estimate."""
        self._estimate = None

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""
        known = self._estimate
        return {
            "time_s": None if math.isnan(self._time_s) else self._time_s,
            "mean": None if known is None else known.mean.tolist(),
            "covariance": None if known is None else known.covariance.tolist(),
        }

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot."""
        self._time_s = math.nan if snapshot["time_s"] is None else snapshot["time_s"]
        self._estimate = (
            None
            if snapshot["mean"] is None
            else Estimate(mean=np.array(snapshot["mean"]), covariance=np.array(snapshot["covariance"]))
        )


def predict(estimate: Estimate, transition: ArrayLike, process_noise: ArrayLike, moved: ArrayLike = 0.0) -> Estimate:
    """Eq. 8: the estimate one step later.

    Parameters
    ----------
    estimate : Estimate
    transition : array, shape (n, n)
        A.
    process_noise : array, shape (n, n)
        Q, the covariance of w.
    moved : array, of the mean's shape
        B u: what is known to have moved the state.
    """
    a = np.asarray(transition, dtype=np.float64)
    return Estimate(
        mean=a @ estimate.mean + np.asarray(moved, dtype=np.float64),
        covariance=a @ estimate.covariance @ a.T + np.asarray(process_noise, dtype=np.float64),
    )


def update(
    estimate: Estimate, measurement: ArrayLike, observation: ArrayLike, measurement_noise: ArrayLike
) -> Correction:
    """Eq. 9, solved for the state: the estimate with one more measurement.

    Parameters
    ----------
    estimate : Estimate
        Predicted to the moment of the measurement.
    measurement : array, shape (m,) or (m, k)
        z.
    observation : array, shape (m, n)
        H.
    measurement_noise : array, shape (m, m)
        R, the covariance of v.
    """
    observation = np.asarray(observation, dtype=np.float64)
    noise = np.asarray(measurement_noise, dtype=np.float64)
    innovation = np.asarray(measurement, dtype=np.float64) - observation @ estimate.mean
    cross = estimate.covariance @ observation.T
    spread = observation @ cross + noise
    gain = np.linalg.solve(spread, cross.T).T
    kept = np.eye(len(estimate.covariance)) - gain @ observation
    return Correction(
        estimate=Estimate(
            mean=estimate.mean + gain @ innovation,
            covariance=kept @ estimate.covariance @ kept.T + gain @ noise @ gain.T,
        ),
        gain=gain,
        innovation=innovation,
        spread=spread,
    )
