"""One episode: a robot, its target and its mirrors from an instant of the dive on, and how far the gaze is off.

As in a dive, image k is taken at a time t_k, and the command that answers to it arrives the dive's control latency
later. What is known of the joints is what a driver of servos knows that report nothing.
"""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from dives.environment.task import GazeTask
from dives.ground_truth_columns import GroundTruthColumns
from dives.paths import body_pose, decoy_pose, target_pose
from dives.timed_mirrors import TimedMirrors
from optics.gaze.kinematics import inverse_gaze
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from scenes.stage.state import State
from tracking.control.crop_scale import level_pose
from tracking.mirrors.simulated import SimulatedMirrors

MOST_DRAWS = 200


class Episode:
    """An episode of a task.

    Parameters
    ----------
    task : GazeTask
    truth : GroundTruthColumns
        Of the task's rig.
    rng : Generator
        Draws the sway's phases, the servos' power-on, when in the dive the episode begins, and where the gaze is then.

    Attributes
    ----------
    steps : int
        Actions so far.
    q_command : array, shape (2,)
        Joint values that were commanded last, radians.
    report : MirrorReport
        What the driver knows of the joints, on the mirrors' own clock.
    rates : array, shape (2,)
        Of the joints since the image before, as the driver estimates them, rad/s.

    Raises
    ------
    ValueError
        When the joints reach the target from none of 200 instants that were drawn.
    """

    def __init__(self, task: GazeTask, truth: GroundTruthColumns, rng: np.random.Generator):
        self.task, self._truth = task, truth
        self.steps = 0
        self._dive = task.dive.model_copy(update={"seed": int(rng.integers(2**32))})
        self._begin_s, self.q_command = self._drawn(rng)
        self._mirrors = TimedMirrors(SimulatedMirrors.from_rig(task.rig, seed=int(rng.integers(2**32))))
        self._mirrors.command(self.q_command, 0.0)
        self.report = self._mirrors.report(task.settling_s)
        self.rates: FloatArray = np.zeros(2)

    @property
    def over(self) -> bool:
        """Whether its time is up."""
        return self.steps >= self.task.steps

    @property
    def q_true(self) -> FloatArray:
        """Where the joints are, radians, shape (2,)."""
        return np.asarray(self._mirrors.q(np.array([self._clock_s]))[0])

    def act(self, action: FloatArray) -> None:
        """Take an action of shape (2,), as the task says what it is, and go on to the next image."""
        task = self.task
        asked = np.asarray(action, dtype=np.float64)
        if task.action == "speeds":
            asked = self.q_command + np.clip(asked, -task.speed_limit, task.speed_limit) * task.step_s
        self.q_command = np.clip(asked, task.gimbal.lowest, task.gimbal.highest)
        self._mirrors.command(self.q_command, self._clock_s + task.dive.control_latency_ms / 1000)
        self.steps += 1
        before, self.report = self.report, self._mirrors.report(self._clock_s)
        rates = (self.report.q - before.q) / task.step_s
        for known in ("state", "gaze_error_rad"):
            self.__dict__.pop(known, None)
        self.rates = np.clip(rates, -task.speed_limit, task.speed_limit)

    @cached_property
    def state(self) -> State:
        """Where everything is."""
        time_s = self._begin_s + self.steps * self.task.step_s
        q1, q2 = self.q_true.tolist()
        return State(
            q1=q1,
            q2=q2,
            world_from_body=body_pose(self._dive, time_s),
            world_from_target=target_pose(self._dive, time_s),
            world_from_decoys=tuple(decoy_pose(self._dive, decoy, time_s) for decoy in self._dive.decoys),
            time_s=time_s,
        )

    @cached_property
    def gaze_error_rad(self) -> float:
        """Angle at the virtual camera between its axis and the target."""
        body, target = self.state.world_from_body, self.state.world_from_target
        assert body is not None and target is not None  # a dive knows both
        return math.radians(self._truth.directions(self.q_true, body.inv() * target)["gaze_error_deg"])

    @property
    def _clock_s(self) -> float:
        """The mirrors' clock: they have settled before the episode begins."""
        return self.task.settling_s + self.steps * self.task.step_s

    def _drawn(self, rng: np.random.Generator) -> tuple[float, FloatArray]:
        """When in the dive the episode begins, and joint values with a gaze near the target then."""
        latest_s = self._dive.duration_s - self.task.episode_s
        layout, upright = Layout.from_rig(self.task.rig), level_pose(self.task.gimbal)
        for _ in range(MOST_DRAWS):
            begin_s = float(rng.uniform(0, latest_s))
            # Evenly over the disc.
            off = math.radians(self.task.start_error_deg) * math.sqrt(rng.uniform())
            turn = rng.uniform(0, 2 * math.pi)
            place = body_pose(self._dive, begin_s).inv().apply(target_pose(self._dive, begin_s).translation)
            x, y, z = (place - layout.body_from_gimbal.translation).tolist()
            elevation = math.atan2(z, math.hypot(x, y)) + off * math.sin(turn)
            azimuth = math.atan2(y, x) + off * math.cos(turn) / max(math.cos(elevation), 0.1)
            found = inverse_gaze(layout, azimuth, elevation)
            if len(found):
                # Of the ways over the front and over the zenith, the one with an image that is upright.
                return begin_s, found[np.abs(found - upright).max(axis=1).argmin()]
        raise ValueError(
            f"dive {self._dive.name!r}: expected a target that the mirrors of {self.task.rig.name!r} can look at, but "
            f"none of {MOST_DRAWS} instants drawn shows one; `mirrorgaze dive {self._dive.name} --plan` says why"
        )
