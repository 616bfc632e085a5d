"""How large the target is: a ball's size in the dive file, and how small a blob of it may be."""

from __future__ import annotations

from pathlib import Path

import pytest

from dives.dive import Dive, DiveError, parse_dive, varied
from dives.target_size import LEAST_SHARE, LEAST_WEIGHED_SHARE, least_area_px, sized
from rigs import Rig
from scenes.stage.targets import Ball

RIG = Rig.load("aqua2")

DIVE = """
name = "size"
rig = "aqua2"
world = "blue"
depth_m = 5.0
duration_s = 1.0
[robot]
motion = "hover"
[target]
{target}
[target.path]
shape = "straight"
start_m = [2.0, 0.3, 0.1]
velocity_m_per_s = [0.0, 0.1, 0.0]
"""


def dive_of(target: str) -> Dive:
    return parse_dive(DIVE.format(target=target), source="size", folder=Path())


def test_a_ball_is_as_large_as_the_dive_says():
    assert dive_of("diameter_m = 0.3").target.load_shape() == Ball(radius_m=0.15)
    assert dive_of("").target.load_shape() == Ball()


def test_a_diameter_of_what_is_no_ball_is_refused():
    with pytest.raises(DiveError, match="diameter_m and colour for a ball only, got one for 'buoy'; leave it out"):
        dive_of('shape = "buoy"\ndiameter_m = 0.3')


def test_the_least_area_is_that_of_most_of_the_ball():
    """aqua2's crop shows 22 degrees on 320 px and 17 on 240, each pixel 1.2 mrad: the ball fills 2350 px at 3 m."""
    area = least_area_px(RIG, Ball(), 1.0)
    assert area == pytest.approx(2350, rel=0.05)
    assert least_area_px(RIG, Ball(radius_m=0.2), 0.25) == pytest.approx(area, abs=1)


def test_what_the_dive_says_counts_and_what_is_no_ball_stays():
    assert sized(dive_of(""), RIG).detector.area_min_px == least_area_px(RIG, Ball(), LEAST_WEIGHED_SHARE)
    preset = Dive.load("wide-hue")
    assert sized(preset, RIG) == preset
    buoy = dive_of('shape = "buoy"')
    assert sized(buoy, RIG) == buoy


def test_a_window_of_colours_asks_for_most_of_the_ball():
    windowed = varied(dive_of(""), variant="paper")
    assert sized(windowed, RIG).detector.area_min_px == least_area_px(RIG, Ball(), LEAST_SHARE)
