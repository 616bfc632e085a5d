"""How soon the search for a lost target finds it again, without images: 60 dives of the arena in half a minute.

The target goes as the arena's dives have it. It is lost where a gaze can show it, at random times, and cannot be found
for 0.3 to 2.5 s; or where it goes past the end of pan. From then on it is found when three images running show it past
the robot (`GazeView.shows_at`). Its rate is known to 1.5 degrees/s. Beside it a gaze that knows where it is.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from rich.console import Console
from rich.table import Table

from cad.assembly.meshes import rig_meshes
from dives.arena.distribution import arena_dive, arena_rig
from dives.paths import body_pose, target_pose
from dives.views.robot_view import robot_view
from optics.gaze.motion import JointSpeeds
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from tracking.control.crop_scale import crop_scale, level_pose
from tracking.control.gaze_view import GazeView
from tracking.control.pointing import Pointing
from tracking.control.search import Search
from tracking.estimation.direction_filter import Bearing
from tracking.estimation.gimbal import Gimbal
from tracking.estimation.lines_of_sight import LinesOfSight
from tracking.perception import Crop, ExactCorners

FIRST, DIVES, STREAM = 300, 60, 77
INTERVAL_S = 1 / 30
RATE_IMAGES = 15
RATE_ERROR = np.radians(1.5)
IN_VIEW, PAST_END = 3, 2
"""Losses of a dive of either kind, at most."""

UNFOUND_S = (0.3, 2.5)
WAITED_S = 0.5
"""That a lost target is waited for where it is predicted."""

LONGEST_S, LONG_S = 12.0, 3.0
IMAGES = 3


@dataclass(frozen=True)
class Loss:
    """A target that is lost.

    Attributes
    ----------
    rig : str
    in_view : bool
        Whether a gaze could show it; else it goes past the end of pan.
    direction : array, shape (n, 3)
        Unit vectors to it from M2 in the body frame, image by image from `RATE_IMAGES` before it is lost on.
    rate : array, shape (3,)
        Of the direction as far as it is known, per second.
    unfound_s : float
        For which it cannot be found where it is.
    """

    rig: str
    in_view: bool
    direction: FloatArray
    rate: FloatArray
    unfound_s: float

    @property
    def bearing(self) -> Bearing:
        """As it was last seen."""
        return Bearing(direction=self.direction[RATE_IMAGES], rate=self.rate)


class Gazes:
    """What a rig can look at."""

    def __init__(self, name: str):
        rig = arena_rig(name)
        self.layout, sights, corners = Layout.from_rig(rig), LinesOfSight(rig), ExactCorners(rig)
        self.gimbal, self.speeds = Gimbal(self.layout), JointSpeeds.from_rig(rig)
        crop_at: Callable[[FloatArray], Crop] = lambda q: Crop.of(corners.corners(q))  # noqa: E731
        level = level_pose(self.gimbal)
        view = crop_scale(sights, crop_at, level) * [crop_at(level).width_px, crop_at(level).height_px]
        self.shown = GazeView(self.gimbal, sights, crop_at, robot_view(rig, rig_meshes(rig)))
        self.pointing = Pointing(self.gimbal, self.speeds, float(view.min()) / 2)
        self.search = Search(self.gimbal, self.speeds, view, likely=self.shown)


gazes = cache(Gazes)


def main(arguments: Sequence[str]) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks lost", description=__doc__)
    parser.add_argument("--first", type=int, default=FIRST, help="seed of the first dive")
    parser.add_argument("--dives", type=int, default=DIVES)
    options = parser.parse_args(arguments)
    if options.first < 0 or options.dives < 1:
        parser.error(f"expected --first of at least 0 and --dives of at least 1, got {options.first}, {options.dives}")
    all_losses = [each for seed in range(options.first, options.first + options.dives) for each in losses(seed)]
    table = Table("lost", "times", "gaze", "found", "mean, s", f"after {LONG_S:g} s or not")
    for name, in_view in (("in view", True), ("past pan's end", False)):
        chosen = [each for each in all_losses if each.in_view == in_view]
        for gaze, of in (("search", _searching), ("knows", _knowing)):
            times_s = [_found_s(each, of(each)) for each in chosen]
            mean_s = np.mean([LONGEST_S if each is None else each for each in times_s])
            late = np.mean([each is None or each > LONG_S for each in times_s])
            again = np.mean([each is not None for each in times_s])
            table.add_row(name, str(len(chosen)), gaze, f"{again:.3f}", f"{mean_s:.2f}", f"{late:.3f}")
    Console().print(table)
    return 0


def losses(seed: int) -> Iterator[Loss]:
    """Losses in the arena's dive of a seed."""
    dive, rng = arena_dive(seed).dive, np.random.default_rng((seed, STREAM))
    its = gazes(dive.rig)
    times_s = np.arange(0, dive.duration_s, INTERVAL_S).tolist()
    from_body = [body_pose(dive, time_s).inv() * target_pose(dive, time_s) for time_s in times_s]
    to_target = np.array([pose.translation for pose in from_body]) - its.layout.body_from_gimbal.translation
    direction = to_target / np.linalg.norm(to_target, axis=1)[:, np.newaxis]
    past = np.array([its.pointing.past_the_end(each) for each in direction])
    first, last = RATE_IMAGES + 5, len(times_s) - 240
    in_view = [at for at in rng.choice(np.arange(first, last), IN_VIEW).tolist() if not past[at]]
    past_end = [at for at in range(first, last) if past[at] and not past[at - 3 : at].any()][:PAST_END]
    for at in in_view + past_end:
        rate = (direction[at] - direction[at - RATE_IMAGES]) / (RATE_IMAGES * INTERVAL_S)
        rate += RATE_ERROR * rng.standard_normal(3)
        rate -= direction[at] * (rate @ direction[at])
        yield Loss(dive.rig, at in in_view, direction[at - RATE_IMAGES :], rate, float(rng.uniform(*UNFOUND_S)))


def _found_s(loss: Loss, joints: Callable[[int, FloatArray], FloatArray]) -> float | None:
    """Time from when it could be found to when it is; None when it is not."""
    its = gazes(loss.rig)
    unfound_s = loss.unfound_s if loss.in_view else 0.0
    q = its.pointing.command(loss.bearing, 0.0, its.gimbal.middle, seen=False)
    most, seen = np.array([its.speeds.pan, its.speeds.tilt]) * INTERVAL_S, 0
    for image in range(1, min(int(LONGEST_S / INTERVAL_S), len(loss.direction) - RATE_IMAGES)):
        there = its.gimbal.in_gimbal(loss.direction[RATE_IMAGES + image])[np.newaxis]
        shown = image * INTERVAL_S > unfound_s and its.shown.shows_at(q, there)[0]
        seen = seen + 1 if shown else 0
        if seen == IMAGES:
            return image * INTERVAL_S - unfound_s
        q = q + np.clip(joints(image, q) - q, -most, most)
    return None


def _searching(loss: Loss) -> Callable[[int, FloatArray], FloatArray]:
    """Joint values of the loop's search, which waits first."""
    its = gazes(loss.rig)
    waited_s = WAITED_S
    its.search.begin_lost(loss.bearing, 0.0)

    def joints(image: int, q: FloatArray) -> FloatArray:
        if image * INTERVAL_S >= waited_s:
            return its.search.advance(INTERVAL_S, q)
        its.search.note_unseen(INTERVAL_S, q)
        return its.pointing.command(loss.bearing, image * INTERVAL_S, q, seen=False)

    return joints


def _knowing(loss: Loss) -> Callable[[int, FloatArray], FloatArray]:
    """Joint values of a gaze that knows where the target is and how fast it goes."""
    its = gazes(loss.rig)

    def joints(image: int, q: FloatArray) -> FloatArray:
        here = loss.direction[RATE_IMAGES + image]
        rate = (here - loss.direction[image]) / (RATE_IMAGES * INTERVAL_S)
        q = its.pointing.command(Bearing(direction=here, rate=rate), INTERVAL_S, q)
        return its.shown.past_robot(q, here)

    return joints
