"""What a dive asks of rig and servos, before anything is rendered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dives.dive import Dive
from dives.metrics.frames import BoolArray
from dives.metrics.holding import runs
from dives.metrics.search_time import expected_first_look_s
from dives.paths import body_pose, target_pose
from dives.planning.availability import Availability, availability, covered_cells
from dives.views.robot_view import robot_view
from optics.gaze.motion import JointSpeeds
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mesh import PartMesh
from rigs import Rig

STEP_S = 0.05
"""Between the times that are looked at: a target at 1 m/s goes on by a quarter of a ball."""

REASONS = {
    "shown": "no gaze shows it past hull and mount",
    "behind_world": "the world hides it",
    "behind_decoy": "a decoy hides it",
}
"""Why a target is not available, the first that applies."""


@dataclass(frozen=True, kw_only=True)
class Gap:
    """A time in which the target is not available: from and to, seconds, and why."""

    from_s: float
    to_s: float
    reason: str


@dataclass(frozen=True, kw_only=True)
class DivePlan:
    """Where a dive's target goes, and how much of that can be seen and followed.

    Attributes
    ----------
    dive : Dive
    availability : Availability
        Every 0.05 s.
    robot_m, target_m : arrays, shape (n, 3)
        Places of the robot's body and the target, from the robot's start: x ahead, y left, z up.
    rate_deg_per_s : array, shape (n,)
        Of the target's direction in the body frame.
    within_speeds : array, shape (n,)
        Whether pan and tilt can keep up with it at their speeds, where they can reach it.
    covered : array, shape (cells,)
        Cells of the sphere of directions that some gaze shows (HEALPix, `dives.planning.availability.NSIDE`).
    expected_first_look_s : float
        Mean time until the loop's search first looks at a target anywhere within reach.
    """

    dive: Dive
    availability: Availability
    robot_m: FloatArray
    target_m: FloatArray
    rate_deg_per_s: FloatArray
    within_speeds: BoolArray
    covered: BoolArray
    expected_first_look_s: float

    @property
    def gaps(self) -> list[Gap]:
        """Times in which the target is not available, one after the other."""
        return [
            Gap(from_s=float(self.availability.time_s[first]), to_s=self._end_s(end), reason=REASONS[name])
            for first, end, name in sorted(
                (first, end, name) for name, flags in self._why().items() for first, end in runs(flags)
            )
        ]

    def numbers(self) -> dict[str, Any]:
        """Plain numbers, units at the end of their names."""
        there, available = self.availability, self.availability.available
        why = self._why()
        return {
            "duration_s": self.dive.duration_s,
            "available_fraction": float(available.mean()),
            "not_shown_fraction": float(why["shown"].mean()),
            "behind_world_fraction": float(why["behind_world"].mean()),
            "behind_decoy_fraction": float(why["behind_decoy"].mean()),
            "first_available_s": float(there.time_s[available.argmax()]) if available.any() else None,
            "expected_first_look_s": self.expected_first_look_s,
            "nearest_m": float(there.distance_m.min()),
            "farthest_m": float(there.distance_m.max()),
            "rate_p95_deg_per_s": float(np.percentile(self.rate_deg_per_s, 95)),
            "rate_max_deg_per_s": float(self.rate_deg_per_s.max()),
            "within_speeds_fraction": float(self.within_speeds[available].mean()) if available.any() else None,
            "gaps": [{"from_s": gap.from_s, "to_s": gap.to_s, "reason": gap.reason} for gap in self.gaps],
        }

    def _why(self) -> dict[str, BoolArray]:
        """Times at which each reason is the one that keeps the target from being available."""
        there = self.availability
        return {
            "shown": ~there.shown,
            "behind_world": there.shown & there.behind_world,
            "behind_decoy": there.shown & ~there.behind_world & there.behind_decoy,
        }

    def _end_s(self, end: int) -> float:
        times_s = self.availability.time_s
        return float(times_s[end]) if end < len(times_s) else self.dive.duration_s


def plan_dive(dive: Dive, rig: Rig, parts: Sequence[PartMesh]) -> DivePlan:
    """Plan of a dive; nothing is rendered.

    Parameters
    ----------
    dive : Dive
    rig : Rig
        That it is dived with, with mirrors and servos.
    parts : sequence of PartMesh
        Hull and mount, as of `cad.rig_meshes`.
    """
    times_s = np.arange(0.0, dive.duration_s, STEP_S)
    there = availability(dive, rig, parts, times_s)
    turning = np.gradient(there.direction, times_s, axis=0) if len(times_s) > 1 else np.zeros((len(times_s), 3))
    start_m = np.array([0.0, 0.0, -dive.depth_m])
    return DivePlan(
        dive=dive,
        availability=there,
        robot_m=body_pose(dive, times_s).translation - start_m,
        target_m=target_pose(dive, times_s).translation - start_m,
        rate_deg_per_s=np.degrees(np.linalg.norm(turning, axis=1)),
        within_speeds=_within_speeds(rig, there.direction, turning),
        covered=covered_cells(rig, parts),
        expected_first_look_s=expected_first_look_s(rig, dive.loop_variant(), robot_view(rig, parts)),
    )


def _within_speeds(rig: Rig, direction: FloatArray, turning: FloatArray) -> BoolArray:
    """Whether azimuth and elevation in the gimbal's frame turn no faster than pan, and twice as fast as tilt, can.

    Over the front as over the zenith: pan turns by the azimuth either way, tilt by half the elevation.
    """
    to_gimbal = Layout.from_rig(rig).body_from_gimbal.rotation.inv()
    (x, y, z), (dx, dy, dz) = to_gimbal.apply(direction).T, to_gimbal.apply(turning).T
    level2 = x**2 + y**2
    with np.errstate(divide="ignore", invalid="ignore"):
        azimuth_rate = np.abs(x * dy - y * dx) / level2
        elevation_rate = np.abs(dz - z * (z * dz + x * dx + y * dy)) / np.sqrt(level2)
    speeds = JointSpeeds.from_rig(rig)
    return np.asarray((azimuth_rate <= speeds.pan) & (elevation_rate <= 2 * speeds.tilt))
