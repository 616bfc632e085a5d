"""The target's path and the body's sway about it: where one that is not seen will be.

What turns back within seconds does not last: among the directions of a body that sways a target that stays goes to and
fro. The state is direction and rate of a path, as `DirectionFilter` has them but with a smaller acceleration, and
displacement and rate of a sway (`tracking.estimation.sway`); their sum is measured. The path goes on along its great
circle, the sway swings about it and dies away.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from optics.kernels.arrays import FloatArray
from tracking.estimation.bearing import Bearing, SwayingBearing, on_the_sphere
from tracking.estimation.direction_filter import DirectionNoise
from tracking.estimation.kalman import Estimate, TimedEstimate, predict, update
from tracking.estimation.sway import Sway

OBSERVED = np.array([[1.0, 0.0, 1.0, 0.0]])
"""H: the sum of path and displacement is measured, no rate is."""

SUMS = np.array([[1.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 1.0]])
"""Direction and rate of what is seen."""


class SteadyFilter(TimedEstimate):
    """Path and sway of a target; without a bearing before the first measurement."""

    def __init__(self, noise: DirectionNoise, sway: Sway):
        super().__init__()
        self._measurement = np.array([[math.radians(noise.measurement_deg) ** 2]])
        self._acceleration = math.radians(noise.steady_acceleration_deg) ** 2
        self._first_rate = math.radians(noise.first_rate_deg_per_s) ** 2
        self._sway = sway

    @property
    def bearing(self) -> SwayingBearing | None:
        """At the time of the last prediction or measurement; None before the first measurement."""
        if self._estimate is None:
            return None
        direction, rate, displacement, displacement_rate = self._estimate.mean
        path = Bearing(direction=direction, rate=rate)
        return SwayingBearing.about(path, displacement, displacement_rate, self._sway)

    @property
    def lasting(self) -> Bearing | None:
        """The bearing with the rate of the path alone, which lasts; None before the first measurement."""
        bearing = self.bearing
        return None if bearing is None else Bearing(direction=bearing.direction, rate=bearing.path.rate)

    @property
    def covariance(self) -> FloatArray:
        """Of direction and rate of what is seen, on each axis, shape (2, 2).

        Raises
        ------
        ValueError
            Before the first measurement.
        """
        if self._estimate is None:
            raise ValueError("expected a measurement first")
        return np.asarray(SUMS @ self._estimate.covariance @ SUMS.T)

    def predict(self, time_s: float) -> None:
        """Go on to a later time, seconds."""
        if self._estimate is not None:
            step = time_s - self._time_s
            path = Bearing(direction=self._estimate.mean[0], rate=self._estimate.mean[1]).after(step)
            transition, process = np.zeros((4, 4)), np.zeros((4, 4))
            transition[:2, :2] = [[1.0, step], [0.0, 1.0]]
            transition[2:, 2:] = self._sway.transition(step)
            process[:2, :2] = self._acceleration * np.array([[step**3 / 3, step**2 / 2], [step**2 / 2, step]])
            process[2:, 2:] = self._sway.process_noise(step)
            predicted = predict(self._estimate, transition, process)
            mean = np.array([path.direction, path.rate, *predicted.mean[2:]])
            self._estimate = Estimate(mean=_across(mean), covariance=predicted.covariance)
        self._time_s = time_s

    def update(self, direction: ArrayLike, doubt: float = 0.0) -> None:
        """Take in a measured direction at the time of the last prediction.

        Parameters
        ----------
        direction : array, shape (3,)
            Unit vector, in the axes of all others.
        doubt : float
            Standard deviation on each axis, radians, that this measurement has beside the usual one.
        """
        measured = np.asarray(direction, dtype=np.float64)
        if self._estimate is None:
            self._estimate = Estimate(mean=np.array([measured, *np.zeros((3, 3))]), covariance=self._first())
            return
        corrected = update(self._estimate, measured[np.newaxis], OBSERVED, self._measurement + doubt**2).estimate
        self._estimate = Estimate(mean=_across(corrected.mean), covariance=corrected.covariance)

    def _first(self) -> FloatArray:
        """Covariance after the first measurement, which is of the sum: what the sway has of it the path has not."""
        covariance = np.zeros((4, 4))
        covariance[2:, 2:] = self._sway.covariance
        covariance[0, 0] = self._measurement[0, 0] + self._sway.covariance[0, 0]
        covariance[0, 2] = covariance[2, 0] = -self._sway.covariance[0, 0]
        covariance[1, 1] = self._first_rate
        return covariance


def _across(mean: FloatArray) -> FloatArray:
    """Unit direction, and the parts of rate, displacement and its rate across it."""
    direction, rate = on_the_sphere(mean[0], mean[1])
    sway = mean[2:] - np.outer(mean[2:] @ direction, direction)
    return np.array([direction, rate, *sway])
