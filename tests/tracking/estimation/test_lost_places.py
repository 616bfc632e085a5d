"""What may be hidden, by angles worked out by hand; and how often a target turns."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from tracking.estimation.bearing import Bearing
from tracking.estimation.lost_places import FIRST_S, LEAST_RATE, TURNED_S, Turns, in_the_open

INTERVAL_S = 1 / 30


def around(azimuth_deg, rate_deg_per_s):
    """Bearing of what goes round the horizon."""
    azimuth, rate = math.radians(azimuth_deg), math.radians(rate_deg_per_s)
    there = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    return Bearing(direction=there, rate=rate * np.cross([0.0, 0.0, 1.0], there))


def test_a_target_of_which_nothing_is_known_turns_as_likely_as_not():
    assert Turns().turning == pytest.approx(0.5)


def test_what_circles_turns_ever_less_and_what_goes_to_and_fro_as_often_as_it_did():
    """Once round at 18 degrees/s in 20 s; and 20 s to and fro, turning every 2 s: turns are counted by hand."""
    circles, to_and_fro = Turns(), Turns()
    for image in range(600):
        time_s = image * INTERVAL_S
        circles.note(around(18 * time_s, 18), time_s)
        to_and_fro.note(around(10, 18 if time_s // 2 % 2 == 0 else -18), time_s)
    assert (circles.number, to_and_fro.number) == (0, 9)
    seen_s = 599 * INTERVAL_S
    assert circles.turning == pytest.approx(1 - math.exp(-TURNED_S / (seen_s + FIRST_S)))
    assert to_and_fro.turning == pytest.approx(1 - math.exp(-TURNED_S * 10 / (seen_s + FIRST_S)))
    assert Turns.restored(json.loads(json.dumps(to_and_fro.snapshot()))).turning == to_and_fro.turning


@pytest.mark.parametrize("gap_s", [2.0, 4.9, 6.0, 12.0])
def test_what_goes_on_round_the_robot_unseen_has_not_turned(gap_s):
    """At 18 degrees/s: after 6 s it goes the other way across the view that it was lost in."""
    turns = Turns()
    turns.note(around(0, 18), 0.0)
    turns.note(around(18 * gap_s, 18), gap_s)
    assert turns.number == 0


def test_what_could_have_gone_a_quarter_circle_and_is_seen_where_it_came_from_has_turned():
    turns = Turns()
    turns.note(around(0, 25), 0.0)
    turns.note(around(-20, 25), 4.0)
    assert turns.number == 1


def test_sway_and_noise_turn_nothing_round():
    turns = Turns()
    for image in range(100):
        turns.note(around(0, 0.9 * math.degrees(LEAST_RATE) * (-1) ** image), image * INTERVAL_S)
    assert turns.number == 0


@pytest.mark.parametrize(
    ("azimuth_deg", "rate_deg_per_s", "number"), [(60, 18, 0), (-5, 18, 1), (60, -18, 1), (-5, -18, 1)]
)
def test_after_a_gap_what_came_back_has_turned_whichever_way_it_goes(azimuth_deg, rate_deg_per_s, number):
    """It was seen straight ahead, going to the left."""
    turns = Turns()
    turns.note(around(0, 18), 0.0)
    turns.note(around(azimuth_deg, rate_deg_per_s), 4.0)
    assert turns.number == number
    assert turns.seen_s == TURNED_S


def test_within_its_radius_something_hides_what_is_there():
    """Directions 0, 10 and 20 degrees aside; behind a disc of 15 degrees, of 25, and behind none."""
    aside = np.radians([0.0, 10.0, 20.0])
    direction = np.stack([np.cos(aside), np.sin(aside), np.zeros(3)], axis=-1)
    radius = np.radians([[15.0], [25.0], [0.0]])
    expected = [[False, False, True], [False, False, False], [True, True, True]]
    np.testing.assert_array_equal(in_the_open(direction, np.array([1.0, 0.0, 0.0]), radius), expected)


def test_nothing_is_hidden_at_the_very_place_by_nothing():
    """Also where rounding makes the cosine a little more than 1."""
    there = np.array([0.6, 0.8, 0.0]) * (1 + 1e-15)
    assert there @ there > 1
    assert in_the_open(there, there, np.float64(0.0))
