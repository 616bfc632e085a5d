"""The target's direction at a constant rate: the default's filter.

In the image a target moves when the mirror turns. Among the directions of the body it does not: the mirror's own turn
is taken out of each measurement, exactly, by `LinesOfSight`, and the target's (and vehicle's) motion is left. Where an
attitude sensor tells the vehicle's turn, `SteadyAxes` takes that out as well: the axes are then steady ones, else the
body's.

The state is the direction and its rate, three columns of eqs. 8 and 9 with one covariance, since noise has no preferred
direction: the model ``A = [1 dt; 0 1]`` of a white acceleration (Bar-Shalom, Li & Kirubarajan, Estimation with
Applications to Tracking and Navigation, 2001, section 6.2.2). Only what lies across the direction means anything; the
prediction runs along the great circle, which is what a straight line of the columns would be on the sphere, and the
correction is brought back to it. There is no pole anywhere, at the zenith neither.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import ArrayLike

from optics.kernels.arrays import FloatArray
from tracking.estimation.bearing import Bearing, on_the_sphere
from tracking.estimation.kalman import Correction, Estimate, TimedEstimate, predict, update

OBSERVED = np.array([[1.0, 0.0]])
"""H: the direction is measured, the rate is not."""


@dataclass(frozen=True, kw_only=True)
class DirectionNoise:
    """What the filter expects of target and measurement.

    Attributes
    ----------
    measurement_deg : float
        Standard deviation of a measured direction on each axis: centroid, joint values and distance together.
    acceleration_deg : float
        Root of the spectral density of the target's angular acceleration, degrees/s^1.5: the rate changes by so much
        within a second. 20 is a diver at 2 m who turns round at half a knot.
    steady_acceleration_deg : float
        The same of the path that a target keeps to while it is not seen, the body's sway apart: which of its turns are
        meant to last is seen over seconds, not from image to image (`tracking.estimation.steady_filter`).
    first_rate_deg_per_s : float
        Standard deviation of the rate of a target just found.
    """

    measurement_deg: float = 0.5
    acceleration_deg: float = 20.0
    steady_acceleration_deg: float = 2.5
    first_rate_deg_per_s: float = 20.0

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"expected {name} above 0, got {value}")


class DirectionFilter(TimedEstimate):
    """Where the target is among directions; without a bearing before the first measurement."""

    def __init__(self, noise: DirectionNoise):
        super().__init__()
        self._measurement = np.array([[math.radians(noise.measurement_deg) ** 2]])
        self._acceleration = math.radians(noise.acceleration_deg) ** 2
        self._first = np.diag([math.radians(noise.measurement_deg), math.radians(noise.first_rate_deg_per_s)]) ** 2

    @property
    def bearing(self) -> Bearing | None:
        """At the time of the last prediction or measurement; None before the first measurement."""
        return (
            None if self._estimate is None else Bearing(direction=self._estimate.mean[0], rate=self._estimate.mean[1])
        )

    @property
    def expected_spread(self) -> float:
        """Standard deviation on each axis, radians, of a measurement about the bearing; infinite without a bearing."""
        if self._estimate is None:
            return math.inf
        return math.sqrt(float(self._estimate.covariance[0, 0] + self._measurement[0, 0]))

    def predict(self, time_s: float) -> None:
        """Go on to a later time, seconds."""
        if self._estimate is not None:
            step = time_s - self._time_s
            bearing = Bearing(direction=self._estimate.mean[0], rate=self._estimate.mean[1]).after(step)
            process = self._acceleration * np.array([[step**3 / 3, step**2 / 2], [step**2 / 2, step]])
            predicted = predict(self._estimate, [[1.0, step], [0.0, 1.0]], process)
            self._estimate = Estimate(mean=np.array([bearing.direction, bearing.rate]), covariance=predicted.covariance)
        self._time_s = time_s

    def update(self, direction: ArrayLike, doubt: float = 0.0) -> Correction | None:
        """Take in a measured direction at the time of the last prediction.

        Parameters
        ----------
        direction : array, shape (3,)
            Unit vector, in the axes of all others.
        doubt : float
            Standard deviation on each axis, radians, that this measurement has beside the usual one.

        Returns
        -------
        Correction, optional
            Its innovation squared has two degrees of freedom: nothing lies along the direction. None for the first.
        """
        measured = np.asarray(direction, dtype=np.float64)
        if self._estimate is None:
            self._estimate = Estimate(mean=np.array([measured, np.zeros(3)]), covariance=self._first)
            return None
        correction = update(self._estimate, measured[np.newaxis], OBSERVED, self._measurement + doubt**2)
        mean = np.array(on_the_sphere(*correction.estimate.mean))
        self._estimate = Estimate(mean=mean, covariance=correction.estimate.covariance)
        return correction

    def take_over(self, bearing: Bearing, covariance: FloatArray) -> None:
        """Go on from the estimate of another filter at the same time.

        Parameters
        ----------
        bearing : Bearing
        covariance : array, shape (2, 2)
            Of direction and rate, on each axis.
        """
        self._estimate = Estimate(mean=np.array([bearing.direction, bearing.rate]), covariance=covariance)
