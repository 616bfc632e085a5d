"""Myring's outline: ellipse, cone and cylinder where it becomes one, and the distance from it."""

from __future__ import annotations

import numpy as np
import pytest

from optics.feasibility.torpedo import nose_stations, tail_stations, torpedo_distance, torpedo_normal, torpedo_radius
from rigs import Rig, TorpedoHull

HULL = Rig.load("torpedo").gaze.hull
"""1600 x 230 mm; its nose is half a sphere of 115 mm radius about x = 685 mm."""
SHORTENING = 1e-3 * 0.23
"""By how much the straight steps of the outline may cut into the hull, metres."""


def changed(**values) -> TorpedoHull:
    return TorpedoHull.model_validate(HULL.model_dump() | values)


def test_the_ends_are_on_the_axis_and_the_middle_is_a_cylinder():
    """To 1e-8 m at the nose, where the radius is the square root of what rounding leaves."""
    assert torpedo_radius(HULL, np.array([-0.8, -0.4, 0.0, 0.685, 0.8])) == pytest.approx(
        [0, 0.115, 0.115, 0.115, 0], abs=1e-8
    )
    assert torpedo_radius(HULL, np.array([-0.81, 0.81])).tolist() == [0, 0]


@pytest.mark.parametrize("nose_length_mm", [60.0, 115.0, 300.0])
def test_a_nose_with_exponent_2_is_an_ellipse(nose_length_mm):
    hull = changed(nose_length_mm=nose_length_mm)
    x = nose_stations(hull)
    s = (x - (0.8 - nose_length_mm / 1000)) / (nose_length_mm / 1000)
    assert s**2 + (torpedo_radius(hull, x) / 0.115) ** 2 == pytest.approx(1, abs=1e-12)


def test_a_nose_with_exponent_1_is_a_parabola_and_more_is_blunter():
    middle = np.array([0.8 - 0.115 / 2])
    assert torpedo_radius(changed(nose_exponent=1.0), middle) == pytest.approx(0.75 * 0.115)
    assert torpedo_radius(changed(nose_exponent=4.0), middle) > torpedo_radius(HULL, middle)


@pytest.mark.parametrize("angle", [5.0, 25.0, 40.0])
def test_the_tail_leaves_the_cylinder_smoothly_and_ends_in_a_cone_of_its_angle(angle):
    """Slopes by differences over 1 um, good to a part in 1e5 of curvatures below 10 / m."""
    hull, step = changed(tail_angle_deg=angle), 1e-6
    shoulder = torpedo_radius(hull, np.array([-0.4, -0.4 - step]))
    assert (shoulder[0] - shoulder[1]) / step == pytest.approx(0, abs=1e-5)
    tip = torpedo_radius(hull, np.array([-0.8, -0.8 + step]))
    assert (tip[1] - tip[0]) / step == pytest.approx(np.tan(np.radians(angle)), abs=1e-5)


def test_the_tail_grows_all_the_way():
    for angle in (1.0, 25.0, 40.0):
        assert (np.diff(torpedo_radius(changed(tail_angle_deg=angle), tail_stations(HULL))) > 0).all()


def test_the_distance_from_a_spherical_nose_and_a_cylinder():
    rng = np.random.default_rng(4)
    directions = rng.normal(size=(200, 3)) * [1, 1, 1]
    directions[:, 0] = np.abs(directions[:, 0])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    heights = rng.uniform(-0.05, 0.3, 200)
    around_nose = [0.685, 0, 0] + (0.115 + heights[:, np.newaxis]) * directions
    assert torpedo_distance(HULL, around_nose) == pytest.approx(heights, abs=SHORTENING)
    assert torpedo_distance(HULL, np.array([[0.1, 0.0, 0.2], [0.1, 0.06, -0.08]])) == pytest.approx([0.085, -0.015])


def test_distances_keep_the_shape_of_the_points():
    assert torpedo_distance(HULL, np.zeros((2, 3, 3))).shape == (2, 3)


def test_normals_of_sphere_cylinder_and_tips():
    direction = np.array([0.6, 0.48, 0.64])
    assert torpedo_normal(HULL, np.array([0.685, 0, 0]) + 0.115 * direction) == pytest.approx(direction, abs=1e-5)
    assert torpedo_normal(HULL, np.array([0.2, 0, 0.115])) == pytest.approx([0, 0, 1])
    assert torpedo_normal(HULL, np.array([0.8, 0, 0])).tolist() == [1, 0, 0]
    assert torpedo_normal(HULL, np.array([-0.8, 0, 0])).tolist() == [-1, 0, 0]


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({"nose_length_mm": 1300.0}, "within length_mm = 1600, got 1300 and 400"),
        ({"tail_angle_deg": 41.0}, r"at most 40\.8"),
        ({"fin_span_mm": 100.0}, r"above half the diameter \(115\), got 100"),
        ({"fin_chord_mm": 401.0}, "at most tail_length_mm = 400, got 401"),
    ],
)
def test_a_torpedo_that_cannot_be_is_refused(values, expected):
    with pytest.raises(ValueError, match=expected):
        changed(**values)
