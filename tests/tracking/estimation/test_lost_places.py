"""What may be hidden, by angles worked out by hand."""

from __future__ import annotations

import numpy as np

from tracking.estimation.lost_places import in_the_open


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
