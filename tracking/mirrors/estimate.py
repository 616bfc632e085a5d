"""Where the joints of a rig must be, by its servos' speed: all that a driver without sensors can know."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from optics.kernels.arrays import FloatArray
from rigs import Joint, Rig, Servo
from tracking.protocols import MirrorReport
from tracking.servos import ServoBehaviour, ServoPlant

JOINTS = ("pan", "tilt")
ROUNDING = 1e-9
"""Radians by which a joint value may pass its limit: limits in degrees come back from radians a little off."""


def jointed_servos(rig: Rig) -> tuple[tuple[Servo, Joint], tuple[Servo, Joint]]:
    """Servo and joint of pan and of tilt; `ValueError` for a rig without mirrors."""
    gaze = rig.require_gaze()
    return (gaze.servos.pan, gaze.joints.pan), (gaze.servos.tilt, gaze.joints.tilt)


def expected_latency_s(rig: Rig) -> float:
    """From a command to the motors' answer on average: half a period of the pulses, and the servos' own latency."""
    return sum((servo.pulse_period_ms / 2 + servo.latency_ms) / 1000 for servo, _ in jointed_servos(rig)) / 2


def checked_joints(rig: Rig, q: ArrayLike) -> FloatArray:
    """Pan and tilt, radians, shape (2,), if they are two finite numbers within the rig's limits.

    Raises
    ------
    ValueError
        With everything that is wrong with them.
    """
    values = np.asarray(q, dtype=np.float64)
    if values.shape != (2,):
        raise ValueError(f"expected q of shape (2,), got {values.shape}")
    problems = []
    for number, (value, (_, joint)) in enumerate(zip(values, jointed_servos(rig), strict=True), start=1):
        low, high = math.radians(joint.min_deg), math.radians(joint.max_deg)
        if not low - ROUNDING <= value <= high + ROUNDING:
            problems.append(
                f"expected q{number} from {joint.min_deg:g} to {joint.max_deg:g} degrees, got {math.degrees(value):g}"
            )
    if problems:
        raise ValueError("; ".join(problems))
    return values


class JointEstimate:
    """Joint values by dead reckoning: each joint runs to what was commanded last, at its servo's speed.

    Knows no pulses, deadband or backlash. Where they stand at first is not known without `q`: before the first
    command, and until the first move has ended, it is then a guess: q = 0, or the limit next to it.

    Parameters
    ----------
    rig : Rig
        With mirrors.
    latency_s : float
        From a command to the motor's answer, if known: `expected_latency_s` by the rig file.
    q : array, shape (2,), optional
        Where the joints stand at first, radians, if that is known.
    """

    def __init__(self, rig: Rig, *, latency_s: float = 0.0, q: ArrayLike | None = None):
        self._rig = rig
        behaviours = [
            ServoBehaviour(
                travel=(math.radians(joint.min_deg), math.radians(joint.max_deg)),
                speed=math.radians(servo.speed_deg_per_s),
                latency_s=latency_s,
            )
            for servo, joint in jointed_servos(rig)
        ]
        start = (0.0, 0.0) if q is None else checked_joints(rig, q)
        self._servos = [
            ServoPlant(behaviour, angle=float(np.clip(angle, *behaviour.travel)))
            for behaviour, angle in zip(behaviours, start, strict=True)
        ]

    def command(self, q: ArrayLike, time_s: float) -> None:
        """Take note of a command; `ValueError` beyond the joints' limits."""
        for servo, angle in zip(self._servos, checked_joints(self._rig, q), strict=True):
            servo.command(float(angle), time_s)

    def report(self, time_s: float) -> MirrorReport:
        """Where the joints are estimated to be."""
        for servo in self._servos:
            servo.advance(time_s)
        return MirrorReport(q=np.array([servo.angle for servo in self._servos]), time_s=time_s, measured=False)

    def snapshot(self) -> dict[str, Any]:
        """Everything that `restore` needs."""
        return {name: servo.snapshot() for name, servo in zip(JOINTS, self._servos, strict=True)}

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go back to where `snapshot` was taken."""
        for name, servo in zip(JOINTS, self._servos, strict=True):
            servo.restore(snapshot[name])
