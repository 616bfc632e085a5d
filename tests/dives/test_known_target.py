"""What is known of a target: how small a blob of a ball may be, and what its water leaves of red."""

from __future__ import annotations

from pathlib import Path

import pytest

from dives.dive import Dive, DiveError, parse_dive, varied
from dives.known_target import (
    LEAST_SHARE,
    LEAST_WEIGHED_SHARE,
    least_area_px,
    looked_for_as_red,
    with_known_target,
)
from dives.rendered_camera import dive_scene
from rigs import Rig
from rigs.lamps import Lamp
from scenes.light.inherent_contrast import red_over_water
from scenes.light.materials import Material
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


def dive_of(target: str, detector: str = "") -> Dive:
    return parse_dive(DIVE.format(target=target) + detector, source="size", folder=Path())


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


def test_what_the_dive_says_counts():
    said = "\n[detector]\narea_min_px = 300.0\nred_over_water = 0.4\n[target]"
    given = parse_dive(DIVE.format(target="").replace("\n[target]", said), source="size", folder=Path())
    assert with_known_target(given, RIG) == given
    assert with_known_target(dive_of(""), RIG).detector.area_min_px == least_area_px(RIG, Ball(), LEAST_WEIGHED_SHARE)


def test_what_is_no_ball_has_no_size_but_a_colour():
    found = with_known_target(dive_of('shape = "buoy"'), RIG).detector
    assert (found.area_min_px, found.red_over_water) == (
        None,
        with_known_target(dive_of(""), RIG).detector.red_over_water,
    )


def test_a_window_of_colours_asks_for_most_of_the_ball():
    windowed = with_known_target(varied(dive_of(""), variant="paper"), RIG).detector
    assert windowed.area_min_px == least_area_px(RIG, Ball(), LEAST_SHARE)
    assert windowed.red_over_water is None
    preset = Dive.load("wide-hue")
    assert with_known_target(preset, RIG) == preset


def test_water_and_depth_say_what_is_left_of_red():
    """As the scene of the dive is lit."""
    clear, deep = dive_of(""), dive_of("").model_copy(update={"depth_m": 20.0})
    for dive in (clear, deep):
        found = with_known_target(dive, RIG).detector.red_over_water
        assert found == pytest.approx(
            red_over_water(dive_scene(dive, RIG).light, dive.depth_m, Material.TARGET), abs=0.005
        )
    lit = RIG.model_copy(
        update={"lamps": (Lamp(position_mm=(200.0, 0.0, 0.0), angle_deg=60.0, luminous_flux_lm=1500.0),)}
    )
    assert with_known_target(deep, lit).detector.red_over_water is None


@pytest.mark.parametrize(
    ("target", "detector", "told"),
    [
        ('shape = "red ball"', "", False),
        ('shape = "red ball"\ncolour = "yellow"', "", True),
        ('shape = "red ball"\ncolour = "yellow"', "[detector.window]\nhue_from_deg = 40\nhue_to_deg = 75", False),
        ('shape = "diver"', "", False),
    ],
)
def test_a_ball_that_the_loop_does_not_look_for_is_told(target, detector, told):
    sentence = looked_for_as_red(dive_of(target, detector))
    assert (sentence is not None) is told
    if sentence is not None:
        assert sentence.startswith("target.colour 'yellow'")
