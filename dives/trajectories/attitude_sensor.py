"""The robot's attitude sensor: what its reports make of how the body is really turned."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation

from rigs.section import NotNegative, Number, Section
from tracking.estimation.attitude import COAST_S
from tracking.protocols import AttitudeReport

STREAM = 2
"""Second number of the seed of the reports' noise, before the time: the sway's phases have another one, and the seed of
a frame's noise has no third."""


class AttitudeSettings(Section):
    """White noise about each axis in each report, a heading that drifts to the left, and the age of a report.

    The defaults are assumptions about a small AHRS: 0.05 degrees of noise between its reports and 5 ms until one is
    there, neither of them from a data sheet; and a heading that turns by 10 degrees an hour, which is the most that the
    gyro's bias of Moog Crossbow's NAV440 drifts in a run (data sheet, rev. B), since without its compass, which servos
    and thrusters disturb, nothing corrects it. What a sensor is off by all the time is left out: only turns are used.
    """

    noise_deg: NotNegative = 0.05
    drift_deg_per_min: Number = 0.17
    latency_ms: Annotated[Number, Field(ge=0, le=1000 * COAST_S)] = 5.0


class SimulatedAttitude:
    """An attitude sensor that reports in the world's axes (east, north, up).

    It has no state: the noise of a report comes from the seed and the time that it is asked for at.

    Parameters
    ----------
    settings : AttitudeSettings
    seed : int
    world_from_body : callable
        How the body is really turned at a time, s.
    """

    def __init__(self, settings: AttitudeSettings, seed: int, world_from_body: Callable[[float], Rotation]):
        self._settings, self._seed, self._world_from_body = settings, seed, world_from_body

    def report(self, time_s: float) -> AttitudeReport:
        """The newest report at a time that is not below zero."""
        settings = self._settings
        taken_s = time_s - settings.latency_ms / 1000
        rng = np.random.default_rng(np.random.SeedSequence((self._seed, STREAM, round(1e6 * time_s))))
        noise = Rotation.from_rotvec(settings.noise_deg * rng.standard_normal(3), degrees=True)
        drift = Rotation.from_rotvec([0.0, 0.0, settings.drift_deg_per_min * taken_s / 60], degrees=True)
        turn = drift * self._world_from_body(taken_s) * noise
        return AttitudeReport(quaternion=turn.as_quat(), time_s=taken_s)
