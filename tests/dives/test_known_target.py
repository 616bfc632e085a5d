"""What is known of a target: how small a blob of a ball may be, what its water leaves of red, how fast it swims."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from dives.dive import Dive, DiveError, parse_dive, varied
from dives.known_target import (
    LEAST_SHARE,
    LEAST_WEIGHED_SHARE,
    least_area_px,
    least_speed,
    not_looked_for,
    with_known_target,
    without_colour,
)
from dives.rendered_camera import dive_scene
from dives.specification import BALL_MATERIALS
from rigs import Rig
from rigs.lamps import Lamp
from scenes.light.inherent_contrast import inherent_contrast
from scenes.stage.targets import Ball
from tracking.perception.target_colours import TARGET_COLOURS

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
    said = '\n[detector]\narea_min_px = 300.0\nover_water = 0.4\ncolour = "red"\nleast_speed_m_per_s = 0.3\n[target]'
    given = parse_dive(DIVE.format(target="").replace("\n[target]", said), source="size", folder=Path())
    assert with_known_target(given, RIG) == given
    assert with_known_target(dive_of(""), RIG).detector.area_min_px == least_area_px(RIG, Ball(), LEAST_WEIGHED_SHARE)


@pytest.mark.parametrize(
    ("target", "colour"),
    [
        ("", "red"),
        ('shape = "ball"\ncolour = "yellow"', "yellow"),
        ('shape = "ball"\ncolour = "grey"', "red"),  # stands out along none
        ('shape = "buoy"', "orange"),
        ('shape = "diver"', "red"),
    ],
)
def test_a_target_stands_out_along_its_colour_and_its_water_says_by_how_much(target, colour):
    dive = dive_of(target)
    found = with_known_target(dive, RIG).detector
    contrast = inherent_contrast(dive_scene(dive, RIG).light, dive.depth_m, BALL_MATERIALS[colour])
    assert found.colour == colour
    assert found.over_water == pytest.approx(contrast @ TARGET_COLOURS[colour].over_water, abs=0.005)
    assert (found.area_min_px is None) is (target in ('shape = "buoy"', 'shape = "diver"'))


def test_lamps_bring_their_own_red_alone():
    lit = RIG.model_copy(
        update={"lamps": (Lamp(position_mm=(200.0, 0.0, 0.0), angle_deg=60.0, luminous_flux_lm=1500.0),)}
    )
    assert with_known_target(dive_of(""), lit).detector.over_water is None
    assert with_known_target(dive_of('colour = "yellow"'), lit).detector.over_water is not None


PATHS = {
    "along a line": ('shape = "straight"\nstart_m = [2.0, 0, 0]\nvelocity_m_per_s = [0.0, 0.09, 0.12]', 0.15),
    "to and fro": ('shape = "waypoints"\npoints_m = [[2, 0, 0], [2, 1, 0], [2, 0, 0]]\nspeed_m_per_s = 0.25', 0.25),
    "and then it rests": ('shape = "waypoints"\npoints_m = [[2, 0, 0], [2, 1, 0]]\nspeed_m_per_s = 0.25', None),
    "twice as far": ('shape = "straight"\nstart_m = [-2.0, 5.0, 0]\nvelocity_m_per_s = [0.5, 0.0, 0.0]', 0.27),
    "waits": ('shape = "straight"\nstart_m = [2, 0, 0]\nvelocity_m_per_s = [0, 0.3, 0]\nwait_s = 2.0', None),
    "rests": ('shape = "straight"\nstart_m = [2.0, 0, 0]\nvelocity_m_per_s = [0.0, 0.0, 0.0]', None),
    "around it": (
        'shape = "circle"\ncentre_m = [0, 0, 0]\nradius_m = 2.0\nstart_bearing_deg = 0\nturning_deg_per_s = 10',
        0.34,
    ),
}


@pytest.mark.parametrize(("path", "speed"), PATHS.values(), ids=PATHS)
def test_a_target_that_never_rests_swims_at_its_least_speed(path, speed):
    """On a circle of 2 m at 10 degrees/s: 0.349 m/s, of which two digits are known.

    What swims at 0.5 m/s 5.4 m away seems to go at 3 / 5.4 of it from where others are.
    """
    document = DIVE.format(target="").split("[target.path]")[0] + "[target.path]\n" + path
    dive = parse_dive(document, source="path", folder=Path())
    dive = dive.model_copy(update={"duration_s": 8.0})
    assert least_speed(dive) == speed
    assert with_known_target(dive, RIG).detector.least_speed_m_per_s == speed
    assert with_known_target(varied(dive, variant="paper"), RIG).detector.least_speed_m_per_s is None


def test_a_dive_of_less_than_a_second_has_a_speed_too():
    dive = dive_of("").model_copy(update={"duration_s": 0.4})
    assert least_speed(dive) == 0.1


def test_beside_a_robot_that_swims_nothing_is_known_of_the_targets_speed():
    swims = 'motion = "waypoints"\npoints_m = [[0, 0, 0], [5, 0, 0]]\nspeed_m_per_s = 0.3'
    dive = parse_dive(DIVE.format(target="").replace('motion = "hover"', swims), source="robot", folder=Path())
    assert least_speed(dive) is None


def test_a_colour_that_no_target_stands_out_along_is_a_sentence():
    with pytest.raises(DiveError, match=r"expected colour to be one of red, orange, yellow, green, white, got 'pink'"):
        parse_dive(DIVE.format(target="") + '[detector]\ncolour = "pink"', source="size", folder=Path())


def test_a_window_of_colours_asks_for_most_of_the_ball():
    windowed = with_known_target(varied(dive_of(""), variant="paper"), RIG).detector
    assert windowed.area_min_px == least_area_px(RIG, Ball(), LEAST_SHARE)
    assert windowed.over_water is None
    preset = Dive.load("wide-hue")
    assert with_known_target(preset, RIG) == preset


def test_depth_says_what_is_left_of_red():
    clear, deep = (with_known_target(dive_of("").model_copy(update={"depth_m": each}), RIG) for each in (5.0, 20.0))
    assert clear.detector.over_water > 0.5
    assert deep.detector.over_water < 0


@pytest.mark.parametrize(
    ("target", "detector", "told"),
    [
        ('shape = "ball"', "", False),
        ('shape = "ball"\ncolour = "yellow"', "", False),
        ('shape = "ball"\ncolour = "blue"', "", True),
        ('shape = "ball"\ncolour = "blue"', "[detector.window]\nhue_from_deg = 200\nhue_to_deg = 250", False),
        ('shape = "diver"', "", False),
    ],
)
def test_a_ball_that_the_loop_does_not_look_for_is_told(target, detector, told):
    sentence = not_looked_for(dive_of(target, detector))
    assert (sentence is not None) is told
    if sentence is not None:
        assert sentence.startswith("target.colour 'blue'")


@pytest.mark.parametrize(
    ("depth_m", "target", "told"),
    [(5.0, "", False), (20.0, "", True), (20.0, 'shape = "ball"\ncolour = "yellow"', False)],
)
def test_a_depth_without_the_targets_colour_is_told(depth_m, target, told):
    dive = with_known_target(dive_of(target).model_copy(update={"depth_m": depth_m}), RIG)
    sentence = without_colour(dive)
    assert (sentence is not None) is told
    assert without_colour(varied(dive, variant="paper")) is None
    if sentence is not None:
        assert sentence.startswith("depth_m 20 in type")
        assert f"({math.exp(dive.detector.over_water):.2f} times as bright)" in sentence
