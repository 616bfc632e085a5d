"""What an agent is asked to do: keep the gaze on the target of a dive, in episodes that begin anywhere in it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal, Self, get_args

import numpy as np

from dives.dive import Dive
from dives.known_target import with_known_target
from optics.gaze.motion import JointSpeeds
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from rigs import Rig
from tracking.estimation.gimbal import Gimbal
from tracking.mirrors.estimate import expected_latency_s

Action = Literal["speeds", "angles"]

REWARD_UNIT_RAD = 0.1
"""Gaze error that a reward of -1 stands for."""

LEAST_FRAME_PX = 8


@dataclass(frozen=True, kw_only=True)
class GazeTask:
    """A dive as a task.

    Attributes
    ----------
    dive : Dive
        Says world, light, target, robot, frame rate, and how late a command arrives.
    rig : Rig
        With mirrors.
    action : {"speeds", "angles"}
        Joint speeds, rad/s, that last until the next image, or joint values, radians.
    frame_px : int
        Size of the square image over the mirrors.
    episode_s : float
        Length of an episode, at most the dive's.
    start_error_deg : float
        How far the gaze is off the target at most when an episode begins.
    """

    dive: Dive
    rig: Rig
    action: Action = "speeds"
    frame_px: int = 64
    episode_s: float = 10.0
    start_error_deg: float = 8.0

    def __post_init__(self) -> None:
        problems = []
        if self.action not in get_args(Action):
            problems.append(f"action: expected speeds or angles, got {self.action!r}")
        if self.frame_px < LEAST_FRAME_PX:
            problems.append(f"frame_px: expected at least {LEAST_FRAME_PX}, got {self.frame_px}")
        if not self.step_s <= self.episode_s <= self.dive.duration_s:
            longest = f"{self.step_s:g} to {self.dive.duration_s:g} s, the dive's duration"
            problems.append(f"episode_s: expected {longest}, got {self.episode_s:g}")
        if not 0 <= self.start_error_deg < 90:
            problems.append(f"start_error_deg: expected 0 or more and less than 90, got {self.start_error_deg:g}")
        if problems:
            raise ValueError("; ".join(problems))

    @classmethod
    def of(
        cls,
        dive: Dive | str | Path,
        rig: Rig | None = None,
        *,
        action: Action = "speeds",
        frame_px: int = 64,
        episode_s: float = 10.0,
        start_error_deg: float = 8.0,
    ) -> Self:
        """Task of a dive, or of the name or file of one, with its own rig or another.

        Raises
        ------
        DiveError
            For a dive that cannot be made.
        FileNotFoundError
            When there is no such dive.
        ValueError
            For a rig without mirrors, or a setting outside its limits.
        """
        loaded = dive if isinstance(dive, Dive) else Dive.load(dive)
        own = loaded.load_rig() if rig is None else loaded.at_frame_rate(rig)
        return cls(
            dive=with_known_target(loaded, own),
            rig=own,
            action=action,
            frame_px=frame_px,
            episode_s=episode_s,
            start_error_deg=start_error_deg,
        )

    @property
    def step_s(self) -> float:
        """From image to image."""
        return 1 / self.dive.frame_rate_hz

    @property
    def steps(self) -> int:
        """Actions of an episode."""
        return max(1, round(self.episode_s * self.dive.frame_rate_hz))

    @cached_property
    def gimbal(self) -> Gimbal:
        """The rig's joints with their limits."""
        return Gimbal(Layout.from_rig(self.rig))

    @cached_property
    def speed_limit(self) -> FloatArray:
        """Of the servos, rad/s, shape (2,)."""
        speeds = JointSpeeds.from_rig(self.rig)
        return np.array([speeds.pan, speeds.tilt])

    @property
    def settling_s(self) -> float:
        """In which the mirrors reach any place from any other and stand, in whole images."""
        turning_s = float(
            ((self.gimbal.highest - self.gimbal.lowest) / self.speed_limit).max()
        ) + 2 * expected_latency_s(self.rig)
        return math.ceil((turning_s + 0.5) / self.step_s) * self.step_s
