"""What is known of a target before a dive: whether it looks plainly like one, and whether it shines by its colour."""

from dataclasses import replace

import pytest

from tracking.perception import RED_BALL, ColourWindow
from tracking.perception.detectors import keeps_colour, plainness
from tracking.perception.target_colours import RED


@pytest.mark.parametrize(
    ("over_water", "plain", "shines"), [(0.85, 1.0, True), (0.5 * RED.plain_from, 0.5, True), (-0.1, 0.0, False)]
)
def test_the_less_colour_the_water_leaves_the_less_is_known(over_water, plain, shines):
    """A ball darker than the water is as red as black things, and those look like it overhead."""
    settings = replace(RED_BALL, over_water=over_water)
    assert plainness(settings, contrast=True) == pytest.approx(plain)
    assert keeps_colour(settings, contrast=True) is shines


WINDOW = ColourWindow(hue_from_deg=300, hue_to_deg=30)


@pytest.mark.parametrize(
    ("changed", "contrast"), [({"window": WINDOW}, True), ({"colour": "yellow"}, True), ({}, False)]
)
def test_nothing_is_known_of_other_colours_and_by_other_ways(changed, contrast):
    settings = replace(RED_BALL, **changed)
    assert plainness(settings, contrast=contrast) == 0
    assert not keeps_colour(settings, contrast=contrast)
