"""Stills of the arena: what the gaze mirror shows at random times of its dives, while it searches, follows or rests.

The odds of the default's detector come from them (`benchmarks.detector --fit`). Every dive is drawn by its seed
(`dives.arena_dive`), in half of them with three balls of any other colour instead of its own decoys, so that what is no
target is met as often as what is. For targets of other colours than red there are five balls of different colours in
each, of which any may be taken for the target.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import get_args

import cv2
import numpy as np
from numpy.typing import NDArray

from cad.assembly.meshes import rig_meshes
from dives.arena.distribution import arena_dive, arena_rig
from dives.checks import dive_problems
from dives.dive import Dive
from dives.known_target import above_water, over_water, with_known_target
from dives.looked_at import pixels_around
from dives.paths import body_pose, decoy_pose, target_pose
from dives.rendered_camera import RenderedCamera
from dives.specification import BallColour
from dives.views.robot_view import robot_view
from optics.gaze.kinematics import inverse_gaze
from optics.gaze.motion import JointSpeeds
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mirror_outline import mirror_outline
from rigs import Rig
from scenes.stage.scene import scene_light
from tracking.estimation.gimbal import Gimbal
from tracking.estimation.lines_of_sight import LinesOfSight
from tracking.perception import Crop, ExactCorners
from tracking.perception.target_colours import TARGET_COLOURS

STREAM, COLOURS_STREAM = 5, 77
"""Second number of the seed of what is drawn here; with balls of all colours."""

EVERY, COLOURS_EVERY = 6, 9
"""Frames of a dive from one still to the next."""

AIMS = ("target", "decoy", "anywhere")
PROBABILITIES, COLOURS_PROBABILITIES = (0.35, 0.35, 0.3), (0.1, 0.65, 0.25)
"""Of what a gaze is turned to; without decoys anywhere instead."""

OFF = 0.09
"""Standard deviation of the gaze from what it is turned to, along each axis, radians."""

SLEWING, STEADY_RAD_PER_S = 0.35, 0.15
"""Share of stills in which one joint turns at up to its highest speed, as in a search, and how fast both turn in
others, standard deviation."""

OTHERS_COUNT = 3

OTHERS = (*(colour for colour in get_args(BallColour) if colour != "red"), *2 * ("black", "grey"))
"""Colours of what is no target, dark and grey ones three times: so is most that is met under water."""

COLOURED, COLOURED_DIAMETER_M = 5, (0.12, 0.4)
"""Balls of different colours, none of them red."""

OTHERS_DIAMETER_M, OTHERS_DISTANCE_M, OTHERS_ELEVATION_DEG = (0.12, 0.5), (0.9, 3.0), 20.0

MARGIN_S = 0.1
"""Before and after a still, for which the joints stay within their limits."""

FULL_EVERY = 50
"""Stills after which exposure and white balance have seen a whole image again."""


@dataclass(frozen=True, kw_only=True)
class Still:
    """A crop with what its pixels show.

    Attributes
    ----------
    crop : array, shape (height, width, 3)
        uint8 sRGB.
    label : array, shape (height, width)
        `scenes.stage.frame.Label`.
    robot : array, shape (height, width)
        uint8: 255 where the robot may show.
    red_decoy : bool
        Whether another red ball is about, that cannot be told from the target.
    over_water : dict of str to float
        Of targets of each colour (`tracking.perception.DetectorSettings`).
    balls : tuple of (str, tuple)
        Colour and place in the crop of each decoy that is before the gaze.
    """

    crop: NDArray[np.uint8]
    label: NDArray[np.uint8]
    robot: NDArray[np.uint8]
    red_decoy: bool
    over_water: dict[str, float]
    balls: tuple[tuple[str, tuple[float, float]], ...]


def stills(seed: int, *, others: bool) -> Iterator[Still]:
    """Stills of the dive of a seed, with balls of other colours instead of its decoys or not."""
    rng = np.random.default_rng(np.random.SeedSequence((seed, STREAM)))
    dive = arena_dive(seed).dive
    if others:
        dive = _with_balls(dive, rng, [None] * OTHERS_COUNT, OTHERS_DIAMETER_M)
    return _taken(dive, rng, EVERY, PROBABILITIES)


def colour_stills(seed: int) -> Iterator[Still]:
    """Stills of the dive of a seed, with balls of different colours instead of its decoys."""
    rng = np.random.default_rng(np.random.SeedSequence((seed, COLOURS_STREAM)))
    chosen = [str(each) for each in rng.permutation([each for each in get_args(BallColour) if each != "red"])]
    dive = _with_balls(arena_dive(seed).dive, rng, chosen[:COLOURED], COLOURED_DIAMETER_M)
    return _taken(dive, rng, COLOURS_EVERY, COLOURS_PROBABILITIES)


def _taken(dive: Dive, rng: np.random.Generator, every: int, probabilities: Sequence[float]) -> Iterator[Still]:
    """Stills of a dive, so many frames apart, of gazes that are turned to `AIMS`."""
    rig = dive.at_frame_rate(arena_rig(dive.rig))
    dive = with_known_target(dive, rig)
    parts = rig_meshes(rig)
    view, corners, sights = robot_view(rig, parts), ExactCorners(rig), LinesOfSight(rig)
    layout, outline = Layout.from_rig(rig), mirror_outline(rig.require_gaze().gaze_mirror)
    gazes = _Gazes(dive, rig, rng, every, probabilities)
    camera = RenderedCamera(dive, rig, parts, gazes)
    light = scene_light(rig, **above_water(dive))
    known = {colour: over_water(light, dive.depth_m, colour) for colour in TARGET_COLOURS}
    red_decoy = any(decoy.colour == "red" for decoy in dive.decoys)
    for number, (frame, q) in enumerate(zip(gazes.frames.tolist(), gazes.poses, strict=True)):
        corners_px = corners.corners(q)
        crop = Crop.of(corners_px, outline=outline)
        if crop.empty:
            continue
        camera.restore(camera.snapshot() | {"next": frame})
        whole = number % FULL_EVERY == 0
        image = camera.read(None if whole else pixels_around([corners_px], camera.renderer.shape[::-1]))
        assert image is not None and camera.exposure is not None  # the dive is longer
        size = (crop.width_px, crop.height_px)
        flags = cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
        label = cv2.warpPerspective(camera.exposure.label, crop.image_from_crop, size, flags=flags)
        yield Still(
            crop=crop.take(image.image),
            label=np.asarray(label),
            robot=view.mask(q, *size),
            red_decoy=red_decoy,
            over_water=known,
            balls=tuple(_balls(dive, layout, sights, crop, time_s=frame / dive.frame_rate_hz, q=q)),
        )


def _balls(
    dive: Dive, layout: Layout, sights: LinesOfSight, crop: Crop, *, time_s: float, q: FloatArray
) -> Iterator[tuple[str, tuple[float, float]]]:
    """Colour and place in the crop of each decoy that is before the gaze."""
    for decoy in dive.decoys:
        pose = body_pose(dive, time_s).inv() * decoy_pose(dive, decoy, time_s)
        to_decoy = pose.translation - layout.body_from_gimbal.translation
        pixel = sights.pixel(to_decoy / np.linalg.norm(to_decoy), q)
        if pixel is not None:
            x, y = crop.from_image(np.array([pixel]))[0].tolist()
            yield decoy.colour or "red", (x, y)


def _with_balls(
    dive: Dive, rng: np.random.Generator, colours: Sequence[str | None], diameter_m: tuple[float, float]
) -> Dive:
    """The dive with balls for decoys, of these colours or of any, none in the way of robot, target or surface."""
    document = dive.model_dump(mode="json", exclude_none=True)
    while True:
        balls = []
        for colour in colours:
            azimuth, elevation = rng.uniform(-np.pi, np.pi), np.radians(rng.normal(0, OTHERS_ELEVATION_DEG))
            level, up = np.cos(elevation), np.sin(elevation)
            place = rng.uniform(*OTHERS_DISTANCE_M) * np.array([level * np.cos(azimuth), level * np.sin(azimuth), up])
            diameter = float(np.exp(rng.uniform(*np.log(diameter_m))))
            balls.append(
                {"diameter_m": diameter, "colour": colour or str(rng.choice(OTHERS)), "position_m": place.tolist()}
            )
        with_balls = Dive.model_validate(document | {"decoys": balls})
        if not dive_problems(with_balls):
            return with_balls


class _Gazes:
    """A gaze for each still, of joints that turn evenly about its time; in place of mirrors that are driven.

    Attributes
    ----------
    frames : array, shape (n,)
    poses : array, shape (n, 2)
        Joint values at the stills, radians.
    """

    def __init__(self, dive: Dive, rig: Rig, rng: np.random.Generator, every: int, probabilities: Sequence[float]):
        layout = Layout.from_rig(rig)
        gimbal, speeds = Gimbal(layout), JointSpeeds.from_rig(rig)
        self.frames = np.arange(every, dive.frames - 1, every)
        self._times_s = self.frames / dive.frame_rate_hz
        self.poses = np.array(
            [_gaze(dive, layout, gimbal, time_s, rng, probabilities=probabilities) for time_s in self._times_s.tolist()]
        )
        rates = np.array([_rates(speeds, rng) for _ in self.frames])
        within = [
            (self.poses + ahead_s * rates >= gimbal.lowest) & (self.poses + ahead_s * rates <= gimbal.highest)
            for ahead_s in (-MARGIN_S, MARGIN_S)
        ]
        self._rates = np.where(np.all(within, axis=(0, 2))[:, np.newaxis], rates, 0.0)

    def advance(self, time_s: float) -> None:
        """They turn by themselves."""

    def q(self, times_s: FloatArray) -> FloatArray:
        """Joint values at times, shape (n,), radians, shape (n, 2): those of the nearest still go on."""
        nearest = np.abs(self._times_s - times_s[:, np.newaxis]).argmin(axis=1)
        return np.asarray(
            self.poses[nearest] + (times_s - self._times_s[nearest])[:, np.newaxis] * self._rates[nearest]
        )


def _gaze(
    dive: Dive,
    layout: Layout,
    gimbal: Gimbal,
    time_s: float,
    rng: np.random.Generator,
    *,
    probabilities: Sequence[float],
) -> FloatArray:
    """Joint values of a gaze to a thing, or to any place, at a time."""
    aim = rng.choice(AIMS, p=probabilities)
    things = {"target": [target_pose(dive, time_s)], "decoy": [decoy_pose(dive, each, time_s) for each in dive.decoys]}
    if poses := things.get(aim):
        pose = body_pose(dive, time_s).inv() * poses[rng.integers(len(poses))]
        to_thing = pose.translation - layout.body_from_gimbal.translation
        x, y, z = to_thing / np.linalg.norm(to_thing) + OFF * rng.standard_normal(3)
        solutions = inverse_gaze(layout, np.arctan2(y, x), np.arctan2(z, np.hypot(x, y)))
        if len(solutions):
            return np.asarray(solutions[rng.integers(len(solutions))])
    return rng.uniform(gimbal.lowest, gimbal.highest)


def _rates(speeds: JointSpeeds, rng: np.random.Generator) -> FloatArray:
    """Of both joints: one of them in a sweep, or what following takes, radians per second."""
    if rng.random() >= SLEWING:
        return STEADY_RAD_PER_S * rng.standard_normal(2)
    return rng.permutation([1.0, 0.0]) * rng.uniform(-1, 1) * [speeds.pan, speeds.tilt]
