"""Virtual images of ports against ray-transfer matrices, exact rays, closed forms and the inverse."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optics.camera import PinholeCamera
from optics.port_analysis.focus import apparent_distance, focus_behind
from optics.ports.port import DomePort, FlatPort, NoPort
from optics.train import OpticalTrain

INFINITY = float("inf")

ROUNDING = 1e-12
"""Relative; a handful of products and one subtraction of vergences that are of one order."""

ROUNDING_OF_A_PRODUCT = 1e-10
"""Five matrices with entries up to 1e2 (0.01 m to 100 m) are multiplied."""

DOME = DomePort(centre_m=(0.0, 0.0, 0.004), radius_m=0.05, thickness_m=0.006)


def refraction(radius, before, behind):
    """Ray-transfer matrix of a sphere for (height, n x angle); the radius is positive for a centre behind it."""
    return np.array([[1.0, 0.0], [-(behind - before) / radius, 1.0]])


def translation(length, index):
    return np.array([[1.0, length / index], [0.0, 1.0]])


@given(
    radius=st.floats(0.02, 0.3),
    thickness=st.floats(0.001, 0.02),
    centre=st.floats(-0.015, 0.015),
    n_port=st.floats(1.4, 1.8),
    n_water=st.floats(1.3, 1.4),
    beyond=st.floats(0.01, 100.0),
)
def test_a_dome_is_two_refracting_spheres(radius, thickness, centre, *, n_port, n_water, beyond):
    """Gaussian optics with 2 x 2 matrices (Born & Wolf, 4.4) from the object to the pinhole's plane.

    Light comes from the water: its centres of curvature are behind the faces. An image at the distance q in front of
    the pinhole makes rays from one object point diverge from there: translating back by q makes B vanish.
    """
    port = DomePort(centre_m=(0, 0, centre), radius_m=radius, thickness_m=thickness, n_port=n_port, n_water=n_water)
    outer = radius + thickness
    system = (
        translation(centre + radius, 1.0)
        @ refraction(radius, n_port, 1.0)
        @ translation(thickness, n_port)
        @ refraction(outer, n_water, n_port)
        @ translation(beyond, n_water)
    )
    found = apparent_distance(port, centre + outer + beyond)
    assert system[0, 1] / system[1, 1] == pytest.approx(found, rel=ROUNDING_OF_A_PRODUCT)


def test_infinity_appears_a_few_radii_off():
    """A thin dome in water of n = 4/3: q = n R / (n - 1) = 4 R from its centre, 3 R in front of it."""
    port = DomePort(radius_m=0.05, thickness_m=1e-12, n_water=4 / 3)
    assert apparent_distance(port, INFINITY) == pytest.approx(0.2, rel=1e-9)


def test_exact_rays_meet_where_the_virtual_image_is():
    """The parallax of the exact train: a point on the port's axis, seen from 10 um beside it.

    The shift over the slope is the distance of the image, to the second order of the shift.
    """
    shift, distance = 1e-5, 1.5
    camera = PinholeCamera(width_px=1, height_px=1, fx_px=1.0, fy_px=1.0, cx_px=0.0, cy_px=0.0)
    for port, moved in (
        (DOME, DomePort(centre_m=(-shift, 0.0, 0.004), radius_m=0.05, thickness_m=0.006)),
        (FlatPort(distance_m=0.02, thickness_m=0.008), FlatPort(distance_m=0.02, thickness_m=0.008)),
    ):
        slope = OpticalTrain(camera=camera, port=moved).project([[-shift, 0.0, distance]]).pixels[0, 0]
        assert -shift / slope == pytest.approx(apparent_distance(port, distance), rel=1e-6)


def test_behind_a_flat_port_things_are_n_times_nearer():
    port = FlatPort(distance_m=0.02, thickness_m=0.008, n_port=1.5, n_water=4 / 3)
    assert apparent_distance(port, 0.028 + 4.0) == pytest.approx(0.02 + 0.008 / 1.5 + 3.0, rel=ROUNDING)
    assert apparent_distance(port, INFINITY) == INFINITY


def test_without_a_port_things_are_where_they_are():
    assert apparent_distance(NoPort(), 0.7) == 0.7
    assert apparent_distance(NoPort(), INFINITY) == INFINITY


@given(nearest=st.floats(0.06, 0.19))
def test_the_nearest_object_in_focus_appears_at_the_nearest_focus(nearest):
    focus = focus_behind(DOME, nearest)
    assert focus.infinity_is_sharp
    assert apparent_distance(DOME, focus.nearest_object_m) == pytest.approx(nearest, rel=1e3 * ROUNDING)


@given(nearest=st.floats(0.03, 5.0))
def test_a_flat_port_moves_the_nearest_focus_out(nearest):
    port = FlatPort(distance_m=0.02, thickness_m=0.008)
    focus = focus_behind(port, nearest)
    assert focus.infinity_is_sharp
    assert apparent_distance(port, focus.nearest_object_m) == pytest.approx(nearest, rel=1e3 * ROUNDING)


def test_a_lens_that_focuses_inside_the_housing_focuses_up_to_the_port():
    for port, face in ((DOME, 0.06), (FlatPort(distance_m=0.02, thickness_m=0.008), 0.028)):
        assert focus_behind(port, 0.001).nearest_object_m == pytest.approx(face, rel=ROUNDING)


def test_a_lens_that_does_not_focus_near_sees_nothing_sharp_in_a_dome():
    focus = focus_behind(DOME, 0.3)
    assert not focus.infinity_is_sharp
    assert focus.nearest_object_m == INFINITY


def test_a_dry_dome_is_a_weak_negative_lens():
    """A concentric shell in air: 1 / q = (1 - 1 / n) (1 / R1 - 1 / R2), here 50 and 56 mm of n = 1.5."""
    port = DomePort(radius_m=0.05, thickness_m=0.006, n_port=1.5, n_water=1.0)
    expected = 1 / ((1 - 1 / 1.5) * (1 / 0.05 - 1 / 0.056))
    assert apparent_distance(port, INFINITY) == pytest.approx(expected, rel=100 * ROUNDING)


@pytest.mark.parametrize("distance", [0.06, -1.0, float("nan")])
def test_objects_in_the_housing_are_refused(distance):
    with pytest.raises(ValueError, match=r"expected object_distance_m beyond the port's outer face, 0\.06 m off, got"):
        apparent_distance(DOME, distance)


@pytest.mark.parametrize("nearest", [0.0, -0.1, INFINITY, float("nan")])
def test_a_nearest_focus_is_a_distance(nearest):
    with pytest.raises(ValueError, match="expected nearest_focus_m > 0, got"):
        focus_behind(DOME, nearest)
