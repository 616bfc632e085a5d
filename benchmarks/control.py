"""The loop without images: how long it holds a target that its detector finds wherever it is shown, in arena dives.

Nothing is rendered. The detector is told where the target truly is, and finds what the crop shows of it past the robot,
in nine of ten images that show a third of it. So a dive takes seconds and tells of gate, filter, pointing and search
what rendered dives tell; of what is found in images it tells nothing. There are no decoys, and dives that have a red
one are left out.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from cad.assembly.meshes import rig_meshes
from dives.arena.distribution import arena_dive, arena_rig
from dives.arena.judged import SHORTEST_AVAILABLE_S, SHORTEST_LOSS_S
from dives.metrics.frames import BoolArray
from dives.metrics.holding import runs
from dives.metrics.search_time import gaze_view
from dives.planning.availability import availability
from dives.planning.followable import SERVO_SHARE, longest_in_view_s
from dives.timed_mirrors import TimedMirrors
from dives.views.robot_view import robot_view
from optics.gaze.motion import JointSpeeds
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from scenes.stage.targets import Ball
from tracking.control.crop_scale import crop_scale, level_pose
from tracking.estimation.gimbal import Gimbal
from tracking.estimation.lines_of_sight import LinesOfSight
from tracking.loop.loop import TrackingLoop
from tracking.mirrors.simulated import SimulatedMirrors
from tracking.perception import Crop, ExactCorners
from tracking.perception.colour import Mask
from tracking.protocols import CameraFrame
from tracking.records import Blob, Detection, Mode

FIRST, DIVES, STREAM = 300, 80, 5
EXPOSED_S = 0.005

LEAST_SHOWN, FOUND, LOG_ODDS = 1 / 3, 0.9, 4.0
"""Share of a target that must be shown to be found, that of images in which it then is, and the odds that it has."""

LONGEST_TOLD = 5


@dataclass(frozen=True, kw_only=True)
class Held:
    """How long the loop held the target of a dive after it had acquired it.

    Attributes
    ----------
    seed : int
    possible_s, held_s : float
        Longest that a mirror could have shown it, and for how long the loop did.
    lost : list of tuple
        When it was lost, how long it was available then, seconds, and whether it was found again.
    """

    seed: int
    possible_s: float
    held_s: float
    lost: list[tuple[float, float, bool]]

    @property
    def share(self) -> float:
        """Of what is possible."""
        return min(self.held_s / self.possible_s, 1.0)


@dataclass
class ToldDetector:
    """Finds a disc in the crop, where it is told that it is.

    Attributes
    ----------
    rng : Generator
    centre_px : array, shape (2,), optional
        In the crop; None for a target that nothing shows.
    radius_px : float
    shown : float
        Share of the disc that the last crop showed.
    """

    rng: np.random.Generator
    centre_px: FloatArray | None = None
    radius_px: float = 0.0
    shown: float = field(default=0.0, init=False)

    def __call__(self, crop: NDArray[np.uint8], ignored: Mask | None, _: tuple[float, float] | None) -> Detection:
        """Find it in a crop, where `ignored` leaves enough of it (`tracking.perception.detectors.Detector`)."""
        height, width = crop.shape[:2]
        shown = np.zeros((height, width), bool)
        if self.centre_px is not None:
            x, y = np.ogrid[:width, :height]
            shown = ((x - self.centre_px[0]) ** 2 + (y - self.centre_px[1]) ** 2 <= self.radius_px**2).T
        if ignored is not None:
            shown &= ignored == 0
        mask = np.zeros((height, width), np.uint8)
        area_px = np.count_nonzero(shown)
        self.shown = area_px / (math.pi * self.radius_px**2) if area_px else 0.0
        if self.shown < LEAST_SHOWN or self.rng.random() > FOUND:
            return Detection(mask=mask, blobs=(), centroid_px=None)
        mask[shown] = 255
        rows, columns = shown.nonzero()
        (top, bottom), (left, right) = ((int(each.min()), int(each.max())) for each in (rows, columns))
        blob = Blob(
            area_px=float(area_px),
            centroid_px=(float(columns.mean()), float(rows.mean())),
            box_px=(left, top, right - left + 1, bottom - top + 1),
            circularity=1.0,
            log_odds=LOG_ODDS,
        )
        return Detection(mask=mask, blobs=(blob,), centroid_px=blob.centroid_px)


def main(arguments: Sequence[str]) -> int:
    """Print how much of what is possible is held, and the longest losses."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks control", description=__doc__)
    parser.add_argument("--first", type=int, default=FIRST, help="seed of the first dive")
    parser.add_argument("--dives", type=int, default=DIVES)
    options = parser.parse_args(arguments)
    if options.first < 0 or options.dives < 1:
        parser.error(f"expected --first of at least 0 and --dives of at least 1, got {options.first}, {options.dives}")
    seeds = range(options.first, options.first + options.dives)
    counted = [seed for seed in seeds if arena_dive(seed).factors["red decoy"] != "yes"]
    dives = [each for each in map(held, counted) if each is not None]
    if not dives:
        parser.error(f"expected dives that are acquired, got none of {options.dives} from seed {options.first} on")
    shares = np.array([each.share for each in dives])
    lost = sorted((seconds, each.seed, at_s, again) for each in dives for at_s, seconds, again in each.lost)[::-1]
    table = Table("dives", "held of possible", "held 95 %", "losses", "found again", "lost, s")
    again = f"{np.mean([each[-1] for each in lost]):.3f}" if lost else ""
    table.add_row(
        str(len(dives)),
        f"{shares.mean():.3f}",
        f"{np.mean(shares >= 0.95):.2f}",
        str(len(lost)),
        again,
        f"{sum(each[0] for each in lost):.0f}",
    )
    console = Console()
    console.print(table)
    for seconds, seed, at_s, _ in lost[:LONGEST_TOLD]:
        console.print(f"seed {seed}: lost for {seconds:.1f} s at {at_s:.1f} s")
    return 0


def held(seed: int) -> Held | None:
    """How long the default loop holds the target of a seed's dive; None where it never does, or nothing shows it."""
    dive = arena_dive(seed).dive
    rig = dive.at_frame_rate(arena_rig(dive.rig))
    parts = rig_meshes(rig)
    view, layout, sights = robot_view(rig, parts), Layout.from_rig(rig), LinesOfSight(rig)
    gimbal, corners = Gimbal(layout), ExactCorners(rig)
    mirrors = TimedMirrors(SimulatedMirrors.from_rig(rig, seed=dive.seed, checked=not dive.functional_check))
    detector = ToldDetector(np.random.default_rng((seed, STREAM)))
    variant = dive.loop_variant()
    loop = TrackingLoop(rig, variant, detector=detector, robot_view=view)
    times_s = np.arange(dive.frames) / dive.frame_rate_hz
    there = availability(dive, rig, parts, times_s)
    available = there.available
    if available.sum() / dive.frame_rate_hz < SHORTEST_AVAILABLE_S:
        return None
    scale = crop_scale(sights, lambda q: Crop.of(corners.corners(q)), level_pose(gimbal))
    ball = dive.target.load_shape()
    assert isinstance(ball, Ball)  # the arena draws no other targets
    radius_rad = np.arcsin(np.minimum(ball.radius_m / there.distance_m, 1.0))
    image = np.zeros((rig.camera.height_px, rig.camera.width_px, 3), np.uint8)
    is_held, tracks = np.zeros((2, dive.frames), bool)
    poses = []
    for frame, time_s in enumerate(times_s.tolist()):
        report = mirrors.report(time_s)
        (q,) = mirrors.q(times_s[frame : frame + 1])
        pixel = sights.pixel(there.direction[frame], q) if available[frame] else None
        crop = Crop.of(loop.corners_px(report))
        shown = pixel is not None and not crop.empty
        detector.centre_px = crop.from_image(pixel[np.newaxis])[0] if shown and pixel is not None else None
        detector.radius_px = radius_rad[frame] / math.sqrt(scale.prod())
        step = loop.step(CameraFrame(image=image, time_s=time_s), report)
        mirrors.command(step.q_command, time_s + EXPOSED_S + dive.control_latency_ms / 1000)
        poses.append(q)
        tracks[frame] = step.mode is Mode.TRACK
        is_held[frame] = detector.shown > 0 and step.mode in (Mode.TRACK, Mode.PREDICT)
    if not tracks.any():
        return None
    after = np.arange(dive.frames) >= tracks.argmax()
    possible_s = longest_in_view_s(
        gimbal,
        gaze_view(rig, variant, view),
        JointSpeeds.from_rig(rig).slowed(SERVO_SHARE),
        start=poses[tracks.argmax()],
        times_s=times_s[after],
        direction=there.direction[after],
        available=available[after],
    )
    if not possible_s:
        return None
    lasts_s = 1 / dive.frame_rate_hz
    held_s = float((is_held & available & after).sum() * lasts_s)
    return Held(seed=seed, possible_s=possible_s, held_s=held_s, lost=_losses(is_held | ~after, available, lasts_s))


def _losses(is_held: BoolArray, available: BoolArray, lasts_s: float) -> list[tuple[float, float, bool]]:
    """When the target was not held, how long it was available then, seconds, and whether it was found again."""
    found = ((first, end, float(available[first:end].sum() * lasts_s)) for first, end in runs(~is_held))
    return [(first * lasts_s, s, end < len(is_held)) for first, end, s in found if s >= SHORTEST_LOSS_S]
