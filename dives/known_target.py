"""What is known of a target before the dive: colour, size in the crop, how much water leaves of it, how fast it swims.

On a reef its size tells it from red corals, and how much red the water leaves it tells it from black things; that it
swims tells it from a second ball that does not.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dives.dive import Dive
from dives.paths import body_pose, target_pose
from dives.specification import BALL_MATERIALS, DiveTarget
from optics.layout import Layout
from rigs import Rig
from scenes.light.inherent_contrast import inherent_contrast
from scenes.light.light import Light
from scenes.light.sun import Sun
from scenes.stage.scene import scene_light
from scenes.stage.targets import Ball
from tracking.control.crop_scale import crop_scale, level_pose
from tracking.estimation.gimbal import Gimbal
from tracking.estimation.lines_of_sight import LinesOfSight
from tracking.loop.variants import VARIANTS
from tracking.perception import RED_IN_WATER, Crop
from tracking.perception.corners.exact import corners_of
from tracking.perception.detectors import keeps_colour, weighs_contrast
from tracking.perception.target_colours import TARGET_COLOURS

LEAST_SHARE = 0.6
"""Of the ball's area where it is farthest: a smaller blob in a window of colours is something else of that colour."""

LEAST_WEIGHED_SHARE = 0.15
"""The same of a blob whose odds say what it is, and which may be the rest of a ball that robot or crop's edge cuts. Of
stills of the arena's dives 100 to 189 log odds from 2 and this share find 91 % of the pieces of targets, and 2.0
other things in 100 images, another red ball not counted."""

LEAST_SPEED_M_PER_S = 0.03
"""That tells a target from what stands still within a minute."""

SPEED_STEP_S = 0.05

FARTHEST_M = 3.0
"""At which a dive's ball is looked for unless the dive says how small it may be: beyond, less than half of it keeps a
colour that tells it from the water (docs/explanation/perception.md)."""


def least_area_px(rig: Rig, ball: Ball, share: float) -> float:
    """Pixels of the crop, at a level gaze, of a share of a ball's area where it is farthest from the gaze mirror.

    Raises
    ------
    ValueError
        For a rig without mirrors, or one whose camera does not see the gaze mirror at a level gaze.
    """
    corners = corners_of(rig)
    lines_of_sight = LinesOfSight(rig, VARIANTS["default"].target_distance_m)
    scale = crop_scale(lines_of_sight, lambda q: Crop.of(corners.corners(q)), level_pose(Gimbal(Layout.from_rig(rig))))
    if not np.isfinite(scale).all():
        raise ValueError(f"expected a camera that sees the gaze mirror at a level gaze, got rig {rig.name!r}")
    return float(round(share * math.pi * (ball.radius_m / FARTHEST_M) ** 2 / float(scale.prod())))


def colour_of(target: DiveTarget) -> str:
    """Along which a target stands out: a ball's own colour, a buoy's orange, of anything else red."""
    colour = "orange" if target.shape == "buoy" else target.colour
    return colour if colour in TARGET_COLOURS else "red"


def over_water(light: Light, depth_m: float, colour: str) -> float:
    """`over_water` of a target of a colour (`tracking.perception.DetectorSettings`), to two digits."""
    contrast = inherent_contrast(light, depth_m, BALL_MATERIALS[colour])
    return round(float(np.dot(TARGET_COLOURS[colour].over_water, contrast)), 2)


def least_speed(dive: Dive) -> float | None:
    """Speed in m/s, to a hundredth, that the target never falls below beside a robot that hovers.

    Of one that gets farther away than `FARTHEST_M` it is as much less as it seems from there
    (`tracking.estimation.own_motion.WAY_M`). None where it rests, or nearly so (`LEAST_SPEED_M_PER_S`), or where the
    robot swims: then what stands still seems to move as well, and a target may seem to stay.
    """
    if dive.robot.motion != "hover":
        return None
    steps = max(math.floor(dive.duration_s / SPEED_STEP_S + 1e-6), 1)
    places = target_pose(dive, np.arange(steps + 1) * SPEED_STEP_S).translation
    # Along the path, over a second: where it turns back it does not rest.
    ways = np.linalg.norm(np.diff(places, axis=0), axis=1)
    taken = min(round(1 / SPEED_STEP_S), steps)
    slowest = float(np.convolve(ways, np.ones(taken), mode="valid").min()) / (taken * SPEED_STEP_S)
    farthest_m = float(np.linalg.norm(places - body_pose(dive, 0.0).translation, axis=1).max())
    slowest = math.floor(100 * slowest * min(FARTHEST_M / farthest_m, 1) + 1e-6) / 100
    return slowest if slowest >= LEAST_SPEED_M_PER_S else None


def with_known_target(dive: Dive, rig: Rig) -> Dive:
    """The dive with what its `[detector]` leaves open: colour and area of a ball, contrast with its water, and speed.

    Lamps bring their own red: on a rig that has any the detector's own number stays for a red target.
    """
    shape, given = dive.target.load_shape(), dive.detector
    weighed = weighs_contrast(dive.detector_settings(), contrast=dive.loop_variant().contrast)
    known: dict[str, Any] = {}
    colour = given.colour or colour_of(dive.target)
    if given.colour is None and weighed:
        known["colour"] = colour
    if given.area_min_px is None and isinstance(shape, Ball):
        known["area_min_px"] = least_area_px(rig, shape, LEAST_WEIGHED_SHARE if weighed else LEAST_SHARE)
    if given.over_water is None and weighed and not (rig.lamps and colour == "red"):
        known["over_water"] = over_water(scene_light(rig, **above_water(dive)), dive.depth_m, colour)
    if given.least_speed_m_per_s is None and weighed and (speed := least_speed(dive)) is not None:
        known["least_speed_m_per_s"] = speed
    return dive.model_copy(update={"detector": given.model_copy(update=known)}) if known else dive


def not_looked_for(dive: Dive) -> str | None:
    """A sentence where the target is a ball of a colour that the loop does not look for; else None."""
    settings, colour = dive.detector_settings(), dive.target.colour or "red"
    if colour in TARGET_COLOURS or settings.onnx is not None or settings.window != RED_IN_WATER:
        return None
    return (
        f"target.colour {colour!r}: this loop tells {', '.join(TARGET_COLOURS)} from the water and may never find this"
        " one. [detector.window] names the target's hues, [detector] onnx a learned detector"
        " (docs/explanation/perception.md)"
    )


def without_colour(dive: Dive) -> str | None:
    """A sentence where the water leaves a target, known by `with_known_target`, too little of its colour; else None."""
    settings = dive.detector_settings()
    if not weighs_contrast(settings, contrast=dive.loop_variant().contrast):
        return None
    if not math.isfinite(TARGET_COLOURS[settings.colour].plain_from) or keeps_colour(settings, contrast=True):
        return None
    return (
        f"depth_m {dive.depth_m:g} in type {dive.jerlov_type}: even in {settings.colour} light the target is darker"
        f" than the water behind it ({math.exp(settings.over_water):.2f} times as bright), so the loop cannot tell it"
        " from black and grey things and may follow one. Nearer to the surface or in clearer water more of that light"
        " is left; lamps bring it a metre or so far (docs/explanation/perception.md)"
    )


def above_water(dive: Dive) -> dict[str, Any]:
    """What of a dive its light comes from, as `scenes.stage.scene.make_scene` takes it."""
    sun = Sun(elevation_deg=dive.sun.elevation_deg, azimuth_deg=dive.sun.azimuth_deg)
    return {"jerlov_type": dive.jerlov_type, "sun": sun, "cloud": dive.cloud}
