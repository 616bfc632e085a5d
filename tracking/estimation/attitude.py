"""Steady axes: the body's own turn taken out of directions, where an attitude sensor tells it.

A target that swims evenly, or stays, does not do so among the directions of a body that sways: to a filter of constant
rate each sway is a target that turns back. Among *steady* axes, which do not turn with the body, it does. Which ones
they are does not matter: they are the body's own as they were at the first report. Where there is none they stay the
body's own.

Reports that fail leave the body turning on at the last known rate for half a second. Then nobody knows any more: the
axes go with the body, as they do without a sensor, until the next report, from which on they are steady again.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from optics.kernels.arrays import FloatArray
from tracking.estimation.bearing import Bearing
from tracking.protocols import AttitudeReport

RATE_S = 0.08
"""Over which the body's rate is taken, at least: three images at 30 a second. From one image to the next the 0.05
degrees of noise of an attitude sensor would make 2 degrees/s of it; of a sway of 5 degrees in 4 s the rate changes by
half a degree/s within half this time."""

COAST_S = 0.5
"""For which the last rate is good: a sway of 4 s turns at another one after an eighth of it. A report that is farther
than this from its image says nothing about it."""

UNIT_WITHIN = 0.01
"""A quaternion's length may differ from one by so much: sensors send few digits."""


@dataclass(frozen=True, kw_only=True)
class TurningBearing(Bearing):
    """A bearing in the axes of a body that turns.

    Attributes
    ----------
    direction, rate : array, shape (3,)
        In the body frame as it is now, the body's own turn left out of the rate.
    still : Bearing
        The same as if the body did not turn.
    body_rate : array, shape (3,)
        Of the body's turn about its own axes, rad/s.
    turning_s : float
        For how long the body turns on. A robot that sways has turned back when pan has come round, so that its rate is
        fed forward no longer than commands are late.
    """

    still: Bearing
    body_rate: FloatArray
    turning_s: float

    def after(self, seconds: float) -> Bearing:
        """The same target later, in the axes that the body has by then."""
        return self.still.after(seconds).turned(_turned(-min(seconds, self.turning_s) * self.body_rate))

    def directions_after(self, seconds: Sequence[float]) -> FloatArray:
        """Its direction at later times, shape (n, 3), as `after` has it of one."""
        turned_s = [min(each, self.turning_s) for each in seconds]
        back = {each: _turned(-each * self.body_rate) for each in set(turned_s)}
        later = self.still.directions_after(seconds)
        return np.array([back[each] @ direction for each, direction in zip(turned_s, later, strict=True)])


class SteadyAxes:
    """Turns vectors from the body frame into axes that do not turn with it, and back."""

    def __init__(self) -> None:
        self._reports: list[tuple[float, FloatArray]] = []
        self._anchor: FloatArray = np.eye(3)
        self._turn: FloatArray = np.eye(3)
        self._body_rate: FloatArray = np.zeros(3)

    def note(self, report: AttitudeReport | None, time_s: float) -> None:
        """Take in what is known of the attitude when an image was taken.

        A report is passed over that is missing, not finite, no rotation, not later than the one before, or more than
        half a second from the image. Meanwhile the axes turn at the last known rate, for half a second; then they go
        with the body.

        Parameters
        ----------
        report : AttitudeReport, optional
        time_s : float
            Of the image, on the clock of the reports.
        """
        if report is not None and _is_usable(report, time_s):
            self._take_in(report)
        if not self._reports:
            return
        last_s, last = self._reports[-1]
        if time_s - last_s > COAST_S:
            self._body_rate = np.zeros(3)
            return
        self._turn = self._anchor @ last @ _turned((time_s - last_s) * self._body_rate)

    def to_steady(self, vector: FloatArray) -> FloatArray:
        """A vector of the body frame, shape (3,), in steady axes, at the time of the last image."""
        return self._turn @ vector if self._reports else vector

    def to_body(self, vector: FloatArray) -> FloatArray:
        """A vector of steady axes, shape (3,), in the body frame, at the time of the last image."""
        return self._turn.T @ vector if self._reports else vector

    def bearing_to_body(self, bearing: Bearing) -> Bearing:
        """A bearing of steady axes in the body frame as it is now, as if the body did not turn."""
        return bearing.turned(self._turn.T) if self._reports else bearing

    def bearing_ahead(self, bearing: Bearing, ahead_s: float) -> Bearing:
        """A bearing of steady axes in the frame of the body, which turns on for some seconds."""
        still = self.bearing_to_body(bearing)
        if not self._reports:
            return still
        return TurningBearing(
            direction=still.direction, rate=still.rate, still=still, body_rate=self._body_rate, turning_s=ahead_s
        )

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""
        return {
            "reports": [[time_s, turn.tolist()] for time_s, turn in self._reports],
            "anchor": self._anchor.tolist(),
            "turn": self._turn.tolist(),
            "body_rate": self._body_rate.tolist(),
        }

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot."""
        self._reports = [(time_s, np.array(turn)) for time_s, turn in snapshot["reports"]]
        self._anchor, self._turn = np.array(snapshot["anchor"]), np.array(snapshot["turn"])
        self._body_rate = np.array(snapshot["body_rate"])

    def _take_in(self, report: AttitudeReport) -> None:
        """Put a report to those from which the rate is taken; after a gap they begin again."""
        turn = Rotation.from_quat(report.quaternion).as_matrix()
        last_s = self._reports[-1][0] if self._reports else -math.inf
        if report.time_s <= last_s:
            return
        if report.time_s - last_s > COAST_S:
            self._reports, self._anchor = [], self._turn @ turn.T
        self._reports.append((report.time_s, turn))
        while len(self._reports) > 2 and report.time_s - self._reports[1][0] >= RATE_S:
            del self._reports[0]
        first_s, first = self._reports[0]
        turned = Rotation.from_matrix(first.T @ turn).as_rotvec()
        self._body_rate = turned / (report.time_s - first_s) if len(self._reports) > 1 else np.zeros(3)


def _is_usable(report: AttitudeReport, time_s: float) -> bool:
    """Whether a report is a rotation, of about the time of the image; what is not finite fails every comparison."""
    length = float(np.linalg.norm(report.quaternion))
    return abs(length - 1) <= UNIT_WITHIN and abs(report.time_s - time_s) <= COAST_S


def _turned(rotation_vector: FloatArray) -> FloatArray:
    """Matrix of a turn, shape (3, 3)."""
    return np.asarray(Rotation.from_rotvec(rotation_vector).as_matrix())
