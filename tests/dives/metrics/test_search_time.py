"""Times of a search: beside the plan's own, where a target is at once in view, and where it never is."""

import numpy as np
import pytest

from dives.metrics.frames import Frames
from dives.metrics.search_time import (
    LONGEST_SEARCH_S,
    SEARCH_DEFINITIONS,
    expected_first_look_s,
    gaze_view,
    level_view,
    search_time_metrics,
)
from optics.gaze.motion import JointSpeeds
from optics.layout import Layout
from rigs import Rig
from tracking.control.belief import likely_directions
from tracking.control.search import Search
from tracking.estimation.gimbal import Gimbal
from tracking.loop.variants import VARIANTS

RIG = Rig.load("aqua2")
DEFAULT = VARIANTS["default"]


def test_expected_time_is_that_of_a_search_of_images():
    """Of one image after the other, with the first look at each place where a target may be kept."""
    gimbal, view = Gimbal(Layout.from_rig(RIG)), gaze_view(RIG, DEFAULT, None)
    there = likely_directions(gimbal, view)
    search = Search(gimbal, JointSpeeds.from_rig(RIG), level_view(RIG, DEFAULT), likely=view)
    search.begin(gimbal.middle)
    q, first = gimbal.middle, np.full(len(there.probability), np.inf)
    for image in range(60 * 30):
        first[np.isinf(first) & view.shows_at(q, there.direction)] = image / 30
        q = search.advance(1 / 30, q)
    never = ~np.isfinite(first)
    assert there.probability[never].sum() < 0.005
    sooner, later = (np.where(never, other_s, first) @ there.probability for other_s in (60.0, LONGEST_SEARCH_S))
    assert sooner - 1e-6 < expected_first_look_s(RIG, DEFAULT) < later + 1e-6


def test_a_likely_search_is_sooner_than_the_papers():
    assert expected_first_look_s(RIG, DEFAULT) < 0.75 * expected_first_look_s(RIG, VARIANTS["paper"])


def found(make_log, azimuth_deg, elevation_deg, **columns):
    frames = Frames.of(
        make_log(
            300,
            true_azimuth_deg=np.full(300, azimuth_deg),
            true_elevation_deg=np.full(300, elevation_deg),
            **columns,
        )
    )
    return search_time_metrics(RIG, DEFAULT, frames)


def test_a_target_ahead_is_looked_at_at_once_and_times_count_from_the_check_on(make_log):
    """A search begins in the middle of the joints' ranges: what aqua2 looks at there is straight up."""
    gimbal = Gimbal(Layout.from_rig(RIG))
    assert gimbal.gaze(gimbal.middle)[2] == pytest.approx(1.0)
    visible = np.where(np.arange(300) < 90, 0, 50)
    times = found(make_log, 0.0, 90.0, mode=["check"] * 60 + ["scan"] * 240, target_visible_px=visible)
    assert times.keys() == SEARCH_DEFINITIONS.keys()
    assert times["planned_first_look_s"] == 0.0
    # Ten images a second: 60 of the check, 30 more without the target.
    assert times["first_visible_s"] == pytest.approx(3.0)


def test_a_target_that_no_gaze_shows_is_never_looked_at(make_log):
    """Straight down to the rear is beyond aqua2's tilt."""
    assert found(make_log, 180.0, -80.0)["planned_first_look_s"] is None


def test_without_a_search_there_is_nothing_to_time(make_log):
    frames = Frames.of(make_log(10, mode=["check"] * 10))
    assert set(search_time_metrics(RIG, DEFAULT, frames).values()) == {None}
