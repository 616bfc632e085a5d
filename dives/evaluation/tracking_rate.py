"""The largest angular speed of a target that a loop can follow: an arc around the robot, faster and faster.

Without rendering: servos, corners, crop, detector, filter and law are the dive's own, images are drawn
(`dives.evaluation.synthetic_camera`). What light and water cost is left out; speed is a matter of time and geometry.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from dives.evaluation.synthetic_camera import DRAWN_BALL, SyntheticCamera
from dives.metrics.holding import LOSS_FRAMES
from dives.metrics.intervals import Interval, mean_interval
from optics.gaze.kinematics import inverse_gaze
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from rigs import Rig
from tracking.estimation.gimbal import Gimbal
from tracking.loop.loop import TrackingLoop
from tracking.loop.variants import Variant
from tracking.mirrors.simulated import SimulatedMirrors
from tracking.protocols import CameraFrame
from tracking.records import Mode, Step

Axis = Literal["azimuth", "elevation"]

FIRST_DEG_PER_S, SLOWEST_DEG_PER_S, FASTEST_DEG_PER_S = 16.0, 1.0, 512.0
"""Speed that is tried first; from there it is doubled or halved, until one is followed and the next is not."""

PRECISION = 0.02
"""Share of the speed to which it is found; the interval between the two is halved until then."""

LONGEST_SEARCH_S = 120.0
SETTLING_S = 1.0
"""The target rests until it is acquired, and then this long."""

LOOKS = 25
"""Places of the arc at which the joints are asked whether they reach."""

SPEEDING_SHARE = 0.25
"""Of the arc, along which the target gains its speed evenly."""

CONTROL_LATENCY_S = 0.02
"""From the middle of an exposure to the command."""


@dataclass(frozen=True, kw_only=True)
class Arc:
    """Where the target goes: level to the left around the gaze mirror, or up over the bow.

    Attributes
    ----------
    axis : {"azimuth", "elevation"}
        The angle that changes; the other one is zero.
    from_deg, to_deg : float
        Within the joints' limits.
    distance_m : float
        From the gaze mirror's centre.
    radius_m : float
        Of the ball.
    """

    axis: Axis = "azimuth"
    from_deg: float = -60.0
    to_deg: float = 60.0
    distance_m: float = 2.0
    radius_m: float = 0.1

    def __post_init__(self) -> None:
        if not self.from_deg < self.to_deg:
            raise ValueError(f"expected an arc from less to more, got {self.from_deg:g} to {self.to_deg:g} degrees")
        if not 0 < self.radius_m < self.distance_m:
            given = f"{self.radius_m:g} m at {self.distance_m:g} m"
            raise ValueError(f"expected a ball of a radius between 0 and its distance, got {given}")

    def angle_deg(self, time_s: float, speed_deg_per_s: float) -> float:
        """Where the target is on the arc, after so long; it gains its speed evenly, and keeps it."""
        speeding_deg = SPEEDING_SHARE * (self.to_deg - self.from_deg)
        speeding_s = 2 * speeding_deg / speed_deg_per_s
        if time_s < speeding_s:
            return self.from_deg + 0.5 * speed_deg_per_s * time_s**2 / speeding_s
        return self.from_deg + speeding_deg + speed_deg_per_s * (time_s - speeding_s)

    def duration_s(self, speed_deg_per_s: float) -> float:
        """How long it takes."""
        return (1 + SPEEDING_SHARE) * (self.to_deg - self.from_deg) / speed_deg_per_s

    def place_m(self, angle_deg: float) -> FloatArray:
        """Ball's centre from the gaze mirror's, body frame, shape (3,)."""
        angle = math.radians(angle_deg)
        aside = [0.0, math.sin(angle), 0.0] if self.axis == "azimuth" else [0.0, 0.0, math.sin(angle)]
        return self.distance_m * (np.array([math.cos(angle), 0.0, 0.0]) + aside)


@dataclass(frozen=True, kw_only=True)
class Trial:
    """A target that passed along the arc once.

    Attributes
    ----------
    speed_deg_per_s : float
    longest_gap_frames : int
        Most frames in a row in which the detector did not find it.
    gaze_error_rms_deg : float
        Over all frames of the arc: between the true optical axis and the direction from the gaze mirror to the target.
    """

    speed_deg_per_s: float
    longest_gap_frames: int
    gaze_error_rms_deg: float

    @property
    def followed(self) -> bool:
        """Whether it was never lost: not found in at most `LOSS_FRAMES` frames in a row."""
        return self.longest_gap_frames <= LOSS_FRAMES


@dataclass(frozen=True, kw_only=True)
class LargestSpeed:
    """Largest speed that is followed.

    Attributes
    ----------
    arc : Arc
    by_seed_deg_per_s : tuple of float
        For each seed of the servos; 0 where not even the slowest was followed, or the target was not found at rest.
    interval : Interval
        Mean over the seeds, degrees a second.
    trials : tuple of tuple of Trial
        By seed, in the order in which they were made; none for a loop that did not find the target at rest.
    """

    arc: Arc
    by_seed_deg_per_s: tuple[float, ...]
    interval: Interval
    trials: tuple[tuple[Trial, ...], ...]

    @property
    def errors_deg(self) -> list[float | None]:
        """RMS error of the gaze at the largest speed, by seed; None where there is none."""
        followed = [[trial for trial in tried if trial.followed] for tried in self.trials]
        return [
            max(tried, key=lambda trial: trial.speed_deg_per_s).gaze_error_rms_deg if tried else None
            for tried in followed
        ]


def largest_angular_speed(
    rig: Rig,
    variant: Variant,
    arc: Arc,
    *,
    seeds: int = 3,
    frame_rate_hz: float = 30.0,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> LargestSpeed:
    """Largest angular speed at which the target is not lost anywhere on the arc.

    That a slower target is followed as well is assumed.

    Parameters
    ----------
    rig : Rig
        With mirrors and servos.
    variant : Variant
        The functional check is left out.
    arc : Arc
    seeds : int
        Where the servos stand at power-on, and their pulses, come from each of 0 to `seeds` - 1.
    frame_rate_hz : float
    progress : callable, optional
        Gets the seeds done and to do.

    Raises
    ------
    ValueError
        For no seeds, a rate that is not positive, or an arc beyond the joints' limits.
    """
    if seeds < 1 or not frame_rate_hz > 0:
        raise ValueError(f"expected one seed or more and a rate above 0, got {seeds} and {frame_rate_hz:g}")
    check_reachable(rig, arc)
    trials = []
    for seed in range(seeds):
        chase = Chase(rig, variant, arc, seed=seed, frame_rate_hz=frame_rate_hz)
        trials.append(tuple(_tried(chase.trial)) if chase.acquired else ())
        progress(seed + 1, seeds)
    found = tuple(max((trial.speed_deg_per_s for trial in tried if trial.followed), default=0.0) for tried in trials)
    return LargestSpeed(arc=arc, by_seed_deg_per_s=found, interval=mean_interval(found), trials=tuple(trials))


def check_reachable(rig: Rig, arc: Arc) -> None:
    """`ValueError` for an arc along which the joints do not reach: what is lost there is not lost to speed."""
    layout = Layout.from_rig(rig)
    for angle_deg in np.linspace(arc.from_deg, arc.to_deg, LOOKS).tolist():
        x, y, z = arc.place_m(angle_deg).tolist()
        if not len(inverse_gaze(layout, math.atan2(y, x), math.atan2(z, math.hypot(x, y)))):
            raise ValueError(f"expected an arc within the joints' reach, got {arc.axis} {angle_deg:g} degrees on it")


def _tried(trial: Callable[[float], Trial]) -> list[Trial]:
    """Trials of the search for the largest speed, in order."""
    tried = [trial(FIRST_DEG_PER_S)]
    factor = 2.0 if tried[0].followed else 0.5
    while tried[-1].followed == tried[0].followed:
        speed = tried[-1].speed_deg_per_s * factor
        if not SLOWEST_DEG_PER_S <= speed <= FASTEST_DEG_PER_S:
            return tried
        tried.append(trial(speed))
    low, high = sorted(each.speed_deg_per_s for each in tried[-2:])
    while high - low > PRECISION * high:
        tried.append(trial(0.5 * (low + high)))
        low, high = (tried[-1].speed_deg_per_s, high) if tried[-1].followed else (low, tried[-1].speed_deg_per_s)
    return tried


class Chase:
    """A loop that acquires a target at rest, ready to follow it again and again.

    Parameters
    ----------
    rig, variant, arc, seed, frame_rate_hz
        As `largest_angular_speed` has them.

    Attributes
    ----------
    acquired : bool
        Whether it tracks the target at rest.
    """

    def __init__(self, rig: Rig, variant: Variant, arc: Arc, *, seed: int, frame_rate_hz: float):
        self.arc, self._step_s = arc, 1 / frame_rate_hz
        self._gimbal = Gimbal(Layout.from_rig(rig))
        self._camera = SyntheticCamera(rig, arc.radius_m)
        self._mirrors = SimulatedMirrors.from_rig(rig, seed=seed)
        without_check = replace(variant, behaviour=replace(variant.behaviour, check_s=0.0))
        self._loop = TrackingLoop(self._camera.rig, without_check, detector=DRAWN_BALL)
        self._frame = 0
        self.acquired = self._acquire()
        self._start = self._frame, self._loop.snapshot(), self._mirrors.snapshot()

    def trial(self, speed_deg_per_s: float) -> Trial:
        """Let the target pass along the arc once, from rest."""
        self._frame, loop, mirrors = self._start
        self._loop.restore(loop)
        self._mirrors.restore(mirrors)
        gap = longest = 0
        errors = []
        for frame in range(math.ceil(self.arc.duration_s(speed_deg_per_s) / self._step_s)):
            target_m = self.arc.place_m(self.arc.angle_deg(frame * self._step_s, speed_deg_per_s))
            step, q = self._advance(target_m)
            gap = 0 if step.detection.blobs else gap + 1
            longest = max(longest, gap)
            errors.append(_angle_deg(self._gimbal.gaze(q), target_m))
            if longest > LOSS_FRAMES:
                break
        rms_deg = float(np.sqrt(np.mean(np.square(errors))))
        return Trial(speed_deg_per_s=speed_deg_per_s, longest_gap_frames=longest, gaze_error_rms_deg=rms_deg)

    def _acquire(self) -> bool:
        """Search for the target at rest, and settle on it; whether it is tracked then."""
        target_m = self.arc.place_m(self.arc.from_deg)
        tracked_s = 0.0
        while tracked_s < SETTLING_S and self._frame * self._step_s < LONGEST_SEARCH_S:
            step, _ = self._advance(target_m)
            tracked_s = tracked_s + self._step_s if step.mode is Mode.TRACK else 0.0
        return tracked_s >= SETTLING_S

    def _advance(self, target_m: FloatArray) -> tuple[Step, FloatArray]:
        """Take one image and act on it; the loop's step, and the true joint values."""
        time_s = self._frame * self._step_s
        q = self._mirrors.true_q(time_s)
        camera_frame = CameraFrame(image=self._camera.image(q, target_m), time_s=time_s)
        step = self._loop.step(camera_frame, self._mirrors.report(time_s))
        self._mirrors.command(step.q_command, time_s + CONTROL_LATENCY_S)
        self._frame = self._frame + 1
        return step, q


def _angle_deg(first: FloatArray, second: FloatArray) -> float:
    return math.degrees(math.atan2(float(np.linalg.norm(np.cross(first, second))), float(first @ second)))
