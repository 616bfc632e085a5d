"""A dive without rendering: a ball projected by the exact train into a plain picture, and servos."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from optics.gaze import forward_gaze
from optics.layout import Layout
from rigs import Rig
from tracking.loop import TrackingLoop
from tracking.metrics.drawn_camera import DrawnCamera
from tracking.mirrors.simulated import SimulatedMirrors
from tracking.protocols import FloatArray, Shot
from tracking.records import Mode, Step

RADIUS_M = 0.1

Path = Callable[[float], FloatArray]
"""Target's centre from the centre of M2, body frame, metres, at a time."""


@dataclass
class Dive:
    """What came of a dive, one entry a picture."""

    rate_hz: float
    steps: list[Step] = field(default_factory=list)
    error_deg: list[float] = field(default_factory=list)
    q_true: list[FloatArray] = field(default_factory=list)

    def acquired(self) -> int:
        """Number of the first picture in which a target is tracked."""
        return next(index for index, step in enumerate(self.steps) if step.mode is Mode.TRACK)

    def since(self, first: int) -> dict[str, float]:
        """Share of pictures with a detection, RMS error of the gaze in degrees, pictures in which it scans."""
        steps, errors = self.steps[first:], np.array(self.error_deg[first:])
        return {
            "held": float(np.mean([step.detection.centroid_px is not None for step in steps])),
            "rms_deg": float(np.sqrt(np.mean(errors**2))),
            "median_deg": float(np.median(errors)),
            "scans": sum(step.mode is Mode.SCAN for step in steps),
        }


def dive(
    rig: Rig,
    loop: TrackingLoop,
    path: Path,
    *,
    duration_s: float,
    rate_hz: float = 30.0,
    latency_s: float = 0.02,
    seed: int = 1,
    mirrors: Any = None,
    hidden: Callable[[float], bool] = lambda time_s: False,
) -> Dive:
    """Run a loop against a path with simulated servos."""
    camera, layout = DrawnCamera(rig, RADIUS_M), Layout.from_rig(rig)
    mirrors = SimulatedMirrors.from_rig(rig, seed=seed, believed_latency_s=0.015) if mirrors is None else mirrors
    result = Dive(rate_hz=rate_hz)
    for frame in range(round(duration_s * rate_hz)):
        time_s = frame / rate_hz
        q, offset = mirrors.true_q(time_s), path(time_s)
        image = camera.picture(q, offset)
        if hidden(time_s):
            image[:] = 0
        step = loop.step(Shot(image=image, time_s=time_s), mirrors.report(time_s))
        mirrors.command(step.q_command, time_s + latency_s)
        gaze = forward_gaze(layout, *q).direction
        cosine = float(gaze @ offset / np.linalg.norm(offset))
        result.steps.append(step)
        result.q_true.append(q)
        result.error_deg.append(math.degrees(math.acos(min(1.0, cosine))))
    return result


def spiral(time_s: float, *, turn_s: float = 60.0) -> FloatArray:
    """The paper's open spiral: level with the robot at 2 m to its front, rising and going away."""
    azimuth = -0.9 + 2 * np.pi * time_s / turn_s
    distance, height = 2.0 + 0.02 * time_s, 0.03 * time_s
    return np.array([distance * np.cos(azimuth), distance * np.sin(azimuth), height])
