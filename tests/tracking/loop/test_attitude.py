"""The default loop with an attitude sensor: a body that sways about the centre of M2, a drawn ball, servos that lag."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dives.evaluation.synthetic_camera import DRAWN_BALL, SyntheticCamera
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from rigs import Rig
from tracking.estimation.gimbal import Gimbal
from tracking.loop.loop import TrackingLoop
from tracking.loop.variants import VARIANTS
from tracking.mirrors.simulated import SimulatedMirrors
from tracking.protocols import AttitudeReport, CameraFrame
from tracking.records import Mode

RIG = Rig.load("aqua2")
GIMBAL = Gimbal(Layout.from_rig(RIG))
RATE_HZ = 30.0
LATENCY_S = 0.02
SETTLED_S = 4.0
TARGET_M = np.array([1.9, 0.3, 0.4])
"""From the centre of M2, in axes that do not sway."""

VARIANT = replace(VARIANTS["default"].without_check(), likely_first=False)
HIDDEN_S = (6.0, 6.5)
"""The ball is behind something while the sway turns back, for as long as it is predicted."""


@cache
def camera() -> SyntheticCamera:
    return SyntheticCamera(RIG, 0.1)


GENTLE, STRONG = (5.0, (4.0, 5.0, 4.5)), (10.0, (2.5, 3.0, 2.8))
"""Sways: degrees about each axis, and periods of roll, pitch and yaw, s."""


class Swaying:
    """A loop on its servos, in a body that sways or stays, told so or not.

    Frame by frame `off_deg` is the angle from the estimated direction to the target, `gaze_off_deg` from the true gaze.
    """

    def __init__(self, *, told: bool, sway: tuple[float, tuple[float, ...]] = GENTLE, seed: int = 1):
        self.loop = TrackingLoop(camera().rig, VARIANT, detector=DRAWN_BALL)
        self.mirrors = SimulatedMirrors.from_rig(RIG, seed=seed)
        self.mirrors.command([0.1, 0.1], 0.0)
        self.told, self.sway, self.reported_in = told, sway, Rotation.identity()
        self.steps, self.off_deg, self.gaze_off_deg = [], [], []

    def pose(self, time_s: float) -> Rotation:
        """World from body."""
        degrees, periods_s = self.sway
        angles = [degrees * math.sin(2 * math.pi * time_s / period_s) for period_s in periods_s]
        return Rotation.from_euler("ZYX", angles[::-1], degrees=True)

    def run(self, until_s: float) -> Swaying:
        while (time_s := len(self.steps) / RATE_HZ) < until_s:
            q, target = self.mirrors.true_q(SETTLED_S + time_s), self.pose(time_s).inv().apply(TARGET_M)
            image = camera().image(q, target)
            if HIDDEN_S[0] <= time_s < HIDDEN_S[1]:
                image = np.zeros_like(image)
            quaternion = (self.reported_in * self.pose(time_s)).as_quat()
            told = AttitudeReport(quaternion=quaternion, time_s=time_s) if self.told else None
            step = self.loop.step(
                CameraFrame(image=image, time_s=time_s), self.mirrors.report(SETTLED_S + time_s), told
            )
            self.mirrors.command(step.q_command, SETTLED_S + time_s + LATENCY_S)
            self.steps.append(step)
            known = step.target_direction
            self.off_deg.append(math.nan if known is None else angle_deg(known, target))
            self.gaze_off_deg.append(angle_deg(GIMBAL.gaze(q), target))
        return self


def rms_deg(off_deg: list[float], from_s: float, to_s: float) -> float:
    """From a time to another."""
    return float(np.sqrt(np.mean(np.square(off_deg[round(from_s * RATE_HZ) : round(to_s * RATE_HZ)]))))


def angle_deg(one: FloatArray, other: FloatArray) -> float:
    return math.degrees(math.atan2(np.linalg.norm(np.cross(one, other)), one @ other))


@cache
def dived(sway: tuple[float, tuple[float, ...]], *, told: bool) -> Swaying:
    return Swaying(told=told, sway=sway).run(7.5)


def test_a_hidden_target_is_expected_where_it_is_though_the_body_sways():
    """After half a second: the rate of the sway at which it was lost leads three degrees off and more."""
    last = round(HIDDEN_S[1] * RATE_HZ) - 1
    known, unknown = (dived(GENTLE, told=told) for told in (True, False))
    assert {step.mode for step in known.steps[last - 13 : last + 1]} == {Mode.PREDICT}
    # What is left is what it was off when it was lost, and that steadily: the driver does not know the joints better.
    assert known.off_deg[last] < 1.5
    assert unknown.off_deg[last] > 2 * known.off_deg[last]


def test_a_strong_sway_is_followed_more_closely():
    """A gentle one as well as without: what is left is the servos', which no sensor of the body can take away."""
    (gentle, gentle_untold), (strong, strong_untold) = (
        [rms_deg(dived(sway, told=told).gaze_off_deg, 3.0, 6.0) for told in (True, False)] for sway in (GENTLE, STRONG)
    )
    assert gentle == pytest.approx(gentle_untold, abs=0.1)
    assert strong < 0.8 * strong_untold
    assert dived(STRONG, told=True).steps[-1].mode is Mode.TRACK


def test_a_body_that_does_not_turn_changes_no_bit():
    told, not_told = (Swaying(told=told, sway=(0.0, (1.0, 1.0, 1.0))).run(3.0) for told in (True, False))
    for one, other in zip(told.steps, not_told.steps, strict=True):
        assert one.mode is other.mode
        np.testing.assert_array_equal(one.q_command, other.q_command)
        assert (one.target_direction is None) == (other.target_direction is None)
        if one.target_direction is not None:
            np.testing.assert_array_equal(one.target_direction, other.target_direction)


def test_a_restored_loop_goes_on_to_the_same_bits():
    """From while the target is hidden on, through JSON."""
    dive = Swaying(told=True).run(6.2)
    state = json.loads(json.dumps({"loop": dive.loop.snapshot(), "mirrors": dive.mirrors.snapshot()}))
    again = Swaying(told=True)
    again.loop.restore(state["loop"])
    again.mirrors.restore(state["mirrors"])
    again.steps, again.off_deg = list(dive.steps), list(dive.off_deg)
    assert again.run(7.0).loop.snapshot() == dive.run(7.0).loop.snapshot()
    assert again.off_deg == dive.off_deg


def test_reports_that_fail_are_lived_through():
    """The sensor is silent for two seconds of a sway, then comes back in other axes: it has started again."""
    dive = Swaying(told=True).run(3.0)
    dive.told = False
    dive.run(5.0)
    dive.told, dive.reported_in = True, Rotation.from_euler("z", 100, degrees=True)
    dive.run(5.9)
    assert {step.mode for step in dive.steps[90:]} == {Mode.TRACK}
    assert rms_deg(dive.off_deg, 3.0, 5.9) < 1.0
