"""How long a search should take beside how long it took: expected from the plan, planned for this target, measured.

All times count from the first image that is no functional check, at which the search begins with the joints in the
middle of their ranges. The planned search is broken off by nothing; a target is looked at when the gaze mirror shows
its direction past the robot, whatever else hides it there.
"""

from __future__ import annotations

import numpy as np

from dives.metrics.frames import Frames, unit_vectors
from optics.gaze.motion import JointSpeeds
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from rigs import Rig
from tracking.control.belief import Directions, likely_directions
from tracking.control.crop_scale import crop_scale, level_pose
from tracking.control.gaze_view import GazeView
from tracking.control.search import Search
from tracking.estimation.gimbal import Gimbal
from tracking.estimation.lines_of_sight import LinesOfSight
from tracking.loop.variants import Variant
from tracking.perception import Crop
from tracking.perception.corners.exact import corners_of
from tracking.perception.robot_view import RobotView

SEARCH_DEFINITIONS = {
    "expected_first_look_s": "mean time until the search has a target in its view that stands still anywhere within"
    " reach, more often level than high (`tracking.control.belief.likely_directions`)",
    "planned_first_look_s": "when the search, broken off by nothing, first has this target's true direction in its"
    " view; None when not within the dive",
    "first_visible_s": "until the first frame in which a pixel of the target is seen over the gaze mirror",
}

INTERVAL_S = 1 / 30
"""From image to image of the planned search."""

LONGEST_SEARCH_S = 60.0
"""A direction that is not seen by then is counted with this time: the presets' searches leave out 0.005 of where a
target may be."""


def search_time_metrics(
    rig: Rig, variant: Variant, frames: Frames, robot_view: RobotView | None = None
) -> dict[str, object]:
    """Everything of `SEARCH_DEFINITIONS`.

    Parameters
    ----------
    rig : Rig
        With mirrors and servos.
    variant : Variant
        Whose search it is.
    frames : Frames
    robot_view : RobotView, optional
        Where the crop shows the robot, as the loop was told.
    """
    looking = np.flatnonzero(frames.looking)
    if len(looking) == 0:
        return dict.fromkeys(SEARCH_DEFINITIONS)
    gimbal, view = Gimbal(Layout.from_rig(rig)), gaze_view(rig, variant, robot_view)
    times_s = frames.time_s[looking] - frames.time_s[looking[0]]
    azimuth, elevation = (frames.numbers[f"true_{angle}_deg"][looking] for angle in ("azimuth", "elevation"))
    true = gimbal.in_gimbal(unit_vectors(azimuth, elevation))
    gazes = _gazes(rig, variant, view)
    planned_s: FloatArray = INTERVAL_S * np.arange(len(gazes), dtype=np.float64)
    now = np.interp(planned_s, times_s, np.arange(len(times_s))).round().astype(int)
    seen = [view.shows_at(q, true[place : place + 1])[0] for q, place in zip(gazes, now.tolist(), strict=True)]
    return {
        "expected_first_look_s": _expected_first_look_s(gazes, likely_directions(gimbal, view), view),
        "planned_first_look_s": _first(planned_s, np.array(seen) & (planned_s <= times_s[-1])),
        "first_visible_s": _first(times_s, frames.visible[looking]),
    }


def expected_first_look_s(rig: Rig, variant: Variant, robot_view: RobotView | None = None) -> float:
    """Mean over where a target may be of the time until the search first has it in view, seconds."""
    gimbal, view = Gimbal(Layout.from_rig(rig)), gaze_view(rig, variant, robot_view)
    return _expected_first_look_s(_gazes(rig, variant, view), likely_directions(gimbal, view), view)


def gaze_view(rig: Rig, variant: Variant, robot_view: RobotView | None) -> GazeView:
    """What each pose of a rig shows."""
    corners = corners_of(rig)
    return GazeView(
        Gimbal(Layout.from_rig(rig)),
        LinesOfSight(rig, variant.target_distance_m),
        lambda q: Crop.of(corners.corners(q)),
        robot_view,
    )


def level_view(rig: Rig, variant: Variant) -> FloatArray:
    """Field of view of the crop at a level gaze, across and upwards, radians, shape (2,)."""
    corners, level = corners_of(rig), level_pose(Gimbal(Layout.from_rig(rig)))
    crop = Crop.of(corners.corners(level))
    lines_of_sight = LinesOfSight(rig, variant.target_distance_m)
    return np.asarray(
        crop_scale(lines_of_sight, lambda q: Crop.of(corners.corners(q)), level) * [crop.width_px, crop.height_px]
    )


def _gazes(rig: Rig, variant: Variant, view: GazeView) -> list[FloatArray]:
    """Joint values every `INTERVAL_S` of a search that finds nothing, of servos that are where they are asked to be."""
    gimbal = Gimbal(Layout.from_rig(rig))
    search = Search(
        gimbal,
        JointSpeeds.from_rig(rig),
        level_view(rig, variant),
        likely=view if variant.likely_first else None,
        interval_s=INTERVAL_S,
    )
    gazes = [gimbal.middle]
    search.begin(gimbal.middle)
    while len(gazes) * INTERVAL_S < LONGEST_SEARCH_S:
        gazes.append(search.advance(INTERVAL_S, gazes[-1]))
    return gazes


def _expected_first_look_s(gazes: list[FloatArray], there: Directions, view: GazeView) -> float:
    first = np.full(len(there.probability), LONGEST_SEARCH_S)
    unseen = np.arange(len(first))
    for index, q in enumerate(gazes):
        seen = view.shows_at(q, there.direction[unseen])
        first[unseen[seen]] = index * INTERVAL_S
        unseen = unseen[~seen]
    return float(first @ there.probability)


def _first(times_s: FloatArray, flags: np.typing.NDArray[np.bool_]) -> float | None:
    found = np.flatnonzero(flags)
    return float(times_s[found[0]]) if len(found) else None
