"""Evaluation of a detector: images of a world with the target at random places, and how often it is found there."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from dives.known_target import over_water
from optics.gaze.kinematics import forward_gaze
from optics.layout import Layout
from optics.mirror_outline import mirror_outline
from optics.status import Region
from scenes.renderer import FastRenderer
from scenes.sensor import ImageSensor, capture, frame_key, settled_settings
from scenes.stage.frame import Label
from scenes.stage.scene import on_gaze
from tracking.perception.clusters import detect, taken
from tracking.perception.colour import DEG_PER_STEP, DETECTORS, DetectorSettings
from tracking.perception.contrast import ACQUIRED_LOG_ODDS, detect_by_contrast
from tracking.perception.corners.exact import ExactCorners
from tracking.perception.crop import Crop
from tracking.perception.learned import LEARNED, LearnedModel, detect_by_model
from tracking.perception.robot_view import RobotView
from tracking.records import Detection

BoolImage = NDArray[np.bool_]

DISTANCES_M = (1.0, 5.0)
RANGES_M = ((1.0, 2.0), (2.0, 3.0), (3.0, 4.0), (4.0, 5.0), DISTANCES_M)
"""Distances in which images are counted together."""

PAN_DEG, TILT_DEG = (-70.0, 70.0), (-25.0, 30.0)
"""Range of the poses: all of the view ahead, from 50 degrees down to 60 up."""

ASIDE = 0.06
"""Standard deviation of the target's place from the axis, as a share of its distance."""

EMPTY_EVERY = 6
"""One image in this number shows no target."""

LEAST_PX = 60
"""Of the target in the crop, to count as seen: less hides behind something, or leaves the mirror."""

LEAST_RADIUS_PX = 8.0

HALF = 127

SHALLOWEST_M = 0.3
"""Depth of the target at least."""

FAR_BELOW_M = -1000.0
"""Where the target is when it is nowhere."""

CLOCK_S = 20.0
"""Waves and flicker are seen at moments up to this."""


@dataclass(frozen=True, kw_only=True)
class EvaluationImage:
    """One image of an evaluation.

    Attributes
    ----------
    image : array, shape (height, width, 3)
        uint8 sRGB, as the image sensor takes it with settled exposure and white balance.
    crop : array, shape (crop height, crop width, 3)
        uint8 sRGB.
    target : array, shape (crop height, crop width)
        Which pixels of the crop show the target, by ground truth.
    robot : array, shape (crop height, crop width), optional
        uint8: 255 in the pixels in which the robot may show; None when it was not asked for.
    corners_px : array, shape (4, 2)
    distance_m, elevation_deg : float
        Of the target, and of the gaze.
    over_water : float
        Of the target (`tracking.perception.DetectorSettings`).
    empty : bool
        There is no target to be seen anywhere.
    """

    image: NDArray[np.uint8]
    crop: NDArray[np.uint8]
    target: BoolImage
    robot: NDArray[np.uint8] | None
    corners_px: NDArray[np.float64]
    distance_m: float
    elevation_deg: float
    over_water: float
    empty: bool

    @property
    def clear(self) -> BoolImage:
        """Pixels of the crop that show the target where the robot does not show."""
        return self.target if self.robot is None else self.target & (self.robot == 0)

    @property
    def seen(self) -> bool:
        """Whether enough of the target is in the crop."""
        return int(self.clear.sum()) >= LEAST_PX


Detector = Callable[[EvaluationImage], Detection]
"""What finds the target in an image."""


def by_window(settings: DetectorSettings) -> Detector:
    """The detector of a colour window, which takes all blobs for the target."""
    return lambda each: detect(each.crop, settings, each.robot)


def by_contrast(each: EvaluationImage) -> Detection:
    """The default loop's detector, as long as nothing is followed: the likeliest blob, if it is likely enough."""
    return _acquired(detect_by_contrast(each.crop, ignored=each.robot, over_water=each.over_water))


def by_model(file: str) -> Detector:
    """The detector of a learned model, as the loop uses it as long as nothing is followed."""
    model = LearnedModel(file)
    return lambda each: _acquired(detect_by_model(each.crop, model, ignored=each.robot))


def _acquired(detection: Detection) -> Detection:
    """The likeliest blob alone, if it is likely enough."""
    return taken(detection, tuple(blob for blob in detection.blobs[:1] if blob.log_odds >= ACQUIRED_LOG_ODDS))


DETECTORS_BY_NAME: dict[str, Detector] = {"contrast": by_contrast} | {
    name: by_window(settings) for name, settings in DETECTORS.items()
}


def evaluated_detector(name: str) -> Detector:
    """The detector of a name, or of ``onnx:FILE``; `ValueError` when there is none of that name."""
    if name.startswith(LEARNED):
        return by_model(name.removeprefix(LEARNED))
    if name not in DETECTORS_BY_NAME:
        raise ValueError(f"detector {name!r}: expected one of {', '.join(DETECTORS_BY_NAME)}, {LEARNED}FILE")
    return DETECTORS_BY_NAME[name]


@dataclass(frozen=True, kw_only=True)
class Score:
    """What a detector made of the images.

    Attributes
    ----------
    seen, found, wrong : int
        Images that show the target; those in which the centroid lies within the target's radius of the true one;
        those in which it lies elsewhere.
    empty, false_alarms : int
        Images without a target, and those of them in which there was said to be one.
    precision, recall : float
        Of the mask's pixels in the images that show the target.
    """

    seen: int
    found: int
    wrong: int
    empty: int
    false_alarms: int
    precision: float
    recall: float


def evaluation_images(
    renderer: FastRenderer,
    count: int,
    seed: int,
    progress: Callable[[int, int], None] = lambda done, total: None,
    *,
    view: RobotView | None = None,
) -> list[EvaluationImage]:
    """Images with heading, gaze, and the target's place drawn at random; the same for the same seed.

    Parameters
    ----------
    renderer : FastRenderer
        Of a rig with mirrors, with a target in its scene.
    count, seed : int
    progress : callable
        Told how many images are made, and of how many.
    view : RobotView, optional
        Where the crop shows the robot (`dives.views.robot_view`): what is there is not looked at.
    """
    rng = np.random.default_rng(seed)
    sensor, model = ImageSensor.from_rig(renderer.rig), ExactCorners(renderer.rig)
    card = renderer.scene.light.white_radiance(renderer.scene.depth_m)
    assert renderer.scene.target is not None  # as is said above
    contrast = over_water(renderer.scene.light, renderer.scene.depth_m, "red")
    images = []
    layout, outline = Layout.from_rig(renderer.rig), mirror_outline(renderer.rig.require_gaze().gaze_mirror)
    for number in range(count):
        progress(number, count)
        drawn = _drawn(renderer, rng, empty=number % EMPTY_EVERY == EMPTY_EVERY - 1)
        q1, q2 = drawn.q
        frame = renderer.render(
            q1=q1,
            q2=q2,
            world_from_body=drawn.world_from_body,
            world_from_target=drawn.world_from_target,
            time_s=drawn.time_s,
        )
        exposure = settled_settings(frame.radiance, sensor, card_radiance=card)
        image = capture(frame.radiance, sensor, exposure, frame_key(seed, number)).image
        corners = model.corners(drawn.q)
        crop = Crop.of(corners, outline=outline)
        target = (frame.label == Label.TARGET) & (frame.region == Region.GAZE)
        shown = crop.take(np.repeat(np.where(target, np.uint8(255), np.uint8(0))[..., np.newaxis], 3, axis=2))
        images.append(
            EvaluationImage(
                image=image,
                crop=crop.take(image),
                target=shown[..., 0] > HALF,
                robot=None if view is None else view.mask(drawn.q, crop.width_px, crop.height_px),
                corners_px=corners,
                distance_m=drawn.distance_m,
                elevation_deg=float(np.degrees(forward_gaze(layout, q1, q2).elevation)),
                over_water=contrast,
                empty=drawn.empty,
            )
        )
    progress(count, count)
    return images


@dataclass(frozen=True, kw_only=True)
class _Drawn:
    q: tuple[float, float]
    world_from_body: RigidTransform
    world_from_target: RigidTransform
    distance_m: float
    time_s: float
    empty: bool


def _drawn(renderer: FastRenderer, rng: np.random.Generator, *, empty: bool) -> _Drawn:
    """One state, drawn at random; places of the target above the surface are drawn again."""
    at = renderer.scene.world_from_body.translation
    while True:
        q1, q2 = np.radians([rng.uniform(*PAN_DEG), rng.uniform(*TILT_DEG)]).tolist()
        distance = float(rng.uniform(*DISTANCES_M))
        place = on_gaze(renderer.rig, q1=q1, q2=q2, distance_m=distance) + rng.normal(0, ASIDE * distance, 3)
        body = RigidTransform.from_components(at, Rotation.from_euler("z", rng.uniform(-np.pi, np.pi)))
        target = body.apply(place)
        if target[2] < -SHALLOWEST_M:
            break
    return _Drawn(
        q=(q1, q2),
        world_from_body=body,
        world_from_target=RigidTransform.from_translation([*target[:2], FAR_BELOW_M] if empty else target),
        distance_m=distance,
        time_s=float(rng.uniform(0, CLOCK_S)),
        empty=empty,
    )


def score(images: Sequence[EvaluationImage], detector: Detector) -> Score:
    """Score a detector on images."""
    detections = [detector(each) for each in images]
    shown = [(each.clear, found) for each, found in zip(images, detections, strict=True) if each.seen]
    alarms = [found.centroid_px is not None for each, found in zip(images, detections, strict=True) if each.empty]
    hits = [_is_hit(target, found.centroid_px) for target, found in shown if found.centroid_px is not None]
    both, marked, true = (
        sum(int(np.count_nonzero(mask)) for mask in masks)
        for masks in (
            [(found.mask > 0) & target for target, found in shown],
            [found.mask for _, found in shown],
            [target for target, _ in shown],
        )
    )
    return Score(
        seen=len(shown),
        found=sum(hits),
        wrong=len(hits) - sum(hits),
        empty=len(alarms),
        false_alarms=sum(alarms),
        precision=both / marked if marked else math.nan,
        recall=both / true if true else math.nan,
    )


def _is_hit(target: BoolImage, centroid_px: tuple[float, float]) -> bool:
    v, u = np.nonzero(target)
    radius = max(math.sqrt(len(u) / math.pi), LEAST_RADIUS_PX)
    return math.dist(centroid_px, (u.mean(), v.mean())) < radius


@dataclass(frozen=True, kw_only=True)
class Colours:
    """Colours of the target in the images, each image's by the median of its pixels.

    Attributes
    ----------
    hue_deg, saturation, value : tuple of float
        5, 50 and 95 of 100 images have less; hue is counted from its mean, so that red has no gap: it may be
        negative, or beyond 360.
    """

    hue_deg: tuple[float, float, float]
    saturation: tuple[float, float, float]
    value: tuple[float, float, float]


def target_colours(images: Sequence[EvaluationImage]) -> Colours | None:
    """What a colour window has to let through: hue, saturation and value of the target; None where it is not seen."""
    medians = []
    for each in images:
        if each.seen:
            pixels = cv2.cvtColor(each.crop, cv2.COLOR_RGB2HSV)[each.clear].astype(np.float64)
            hues = _unwrapped(DEG_PER_STEP * pixels[:, 0])
            medians.append([np.median(hues), *np.median(pixels[:, 1:], axis=0) / 255])
    if not medians:
        return None
    table = np.array(medians)
    table[:, 0] = _unwrapped(table[:, 0])
    hue, saturation, value = map(tuple, np.percentile(table, (5, 50, 95), axis=0).T.tolist())
    return Colours(hue_deg=hue, saturation=saturation, value=value)


def _unwrapped(hue_deg: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same hues within half a turn of their mean direction, which is in [-180, 180] degrees."""
    mean = np.degrees(np.angle(np.exp(1j * np.radians(hue_deg)).mean()))
    return np.asarray(mean + (hue_deg - mean + 180) % 360 - 180)


@dataclass(frozen=True, kw_only=True)
class DetectorResults(Score):
    """Score of a detector, and the target's colours, in the images of a range of distances."""

    from_m: float
    to_m: float
    colours: Colours | None


def results_by_distance(
    images: Sequence[EvaluationImage],
    detector: Detector,
    ranges_m: Sequence[tuple[float, float]] = RANGES_M,
) -> list[DetectorResults]:
    """Results of a detector for each range of distances."""
    results = []
    for low, high in ranges_m:
        within = [each for each in images if low <= each.distance_m < high]
        counted = vars(score(within, detector))
        results.append(DetectorResults(from_m=low, to_m=high, colours=target_colours(within), **counted))
    return results
