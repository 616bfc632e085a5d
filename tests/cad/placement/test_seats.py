from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cad.hulls.anchors import Anchor
from cad.placement.seats import NO_HULL, SeatFinder
from tests.cad.placement.conftest import LENGTH_MM, RADIUS_MM


@pytest.mark.parametrize("side", [1, -1])
def test_a_seat_on_the_cylinder_has_its_normal(finder: SeatFinder, side: int) -> None:
    seat = finder.seat(np.array([200.0, 0.0, side * (RADIUS_MM - 1)]), side, 30)
    assert isinstance(seat, Anchor)
    assert_allclose(seat.point_mm, [200, 0, side * RADIUS_MM], atol=0.15)
    assert_allclose(seat.normal, [0, 0, side], atol=0.01)


def test_a_seat_on_the_nose_leans_forward(finder: SeatFinder) -> None:
    shoulder = LENGTH_MM / 2 - RADIUS_MM
    lean = np.radians(25)
    x, z = shoulder + RADIUS_MM * np.sin(lean), RADIUS_MM * np.cos(lean)
    seat = finder.seat(np.array([x, 0.0, z]), 1, 33)
    assert isinstance(seat, Anchor)
    assert_allclose(seat.normal, [np.sin(lean), 0, np.cos(lean)], atol=0.02)
    assert finder.seat(np.array([x, 0.0, z - 0.5]), 1, 20) == "a hull within 20 degrees of level"


def test_no_seat_hangs_over_an_edge(finder: SeatFinder) -> None:
    assert finder.seat(np.array([LENGTH_MM / 2 - 5, 0.0, 25.0]), 1, 89) == NO_HULL


def test_places_are_on_the_surface_and_have_headroom(finder: SeatFinder) -> None:
    places = finder.places(0.0, 1, 50.0, 350.0)
    assert len(places) == pytest.approx(300 / 12, abs=2)
    assert_allclose([z for _, _, z in places], RADIUS_MM, atol=finder.space.step_mm)
    assert_allclose([z for _, _, z in finder.places(0.0, -1, 50.0, 350.0)], -RADIUS_MM, atol=finder.space.step_mm)


def test_a_seat_that_is_refused_is_given_no_more_and_its_neighbours_are(finder: SeatFinder) -> None:
    ours = replace(finder, refused=[])
    seats = [ours.seat(np.array([x, 0.0, RADIUS_MM]), 1, 30) for x in (200.0, 212.0, 224.0)]
    ours.refuse(seats[0].point_mm, "too near", 15.0)
    again = [ours.seat(np.array([x, 0.0, RADIUS_MM]), 1, 30) for x in (200.0, 212.0, 224.0)]
    assert again == ["too near", "too near", seats[2]]
