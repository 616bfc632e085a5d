"""Magnification, field of view and the summary of a port: closed forms against the exact train."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from optics.camera import FisheyeCamera, PinholeCamera
from optics.port_analysis.properties import axial_magnification, field_of_view, port_properties, traced_magnification
from optics.ports.port import DomePort, FlatPort, NoPort
from optics.train import OpticalTrain
from rigs import Rig
from rigs.port import NoPortSpec

CAMERA = PinholeCamera(width_px=800, height_px=600, fx_px=400.0, fy_px=400.0, cx_px=399.5, cy_px=299.5)

CENTRAL_DIFFERENCE = 1e-7
"""Step 1e-4: squared, times a third derivative that is below ten for these ports."""

ROUNDING = 1e-12


@given(n_water=st.floats(1.0, 1.4), n_port=st.floats(1.4, 1.8), distance=st.floats(0.005, 0.2))
def test_a_flat_port_lengthens_the_focal_length_by_n(n_water, n_port, distance):
    port = FlatPort(distance_m=distance, thickness_m=0.008, n_port=n_port, n_water=n_water)
    np.testing.assert_allclose(axial_magnification(port), n_water, rtol=ROUNDING)
    np.testing.assert_allclose(traced_magnification(port), n_water, rtol=CENTRAL_DIFFERENCE)


@given(x=st.floats(-0.5, 0.5), y=st.floats(-0.5, 0.5), n_water=st.floats(1.2, 1.4))
def test_a_tilted_flat_port_is_anamorphic(x, y, n_water):
    """Rays of the exact train; across the plane of refraction sin a / sin w is n, whatever the tilt."""
    port = FlatPort(distance_m=0.02, thickness_m=0.008, normal=(x, y, 1.0), n_water=n_water)
    closed = axial_magnification(port)
    np.testing.assert_allclose(closed, traced_magnification(port), rtol=CENTRAL_DIFFERENCE)
    assert closed[0] == pytest.approx(n_water, rel=ROUNDING)


def test_a_centred_dome_changes_nothing():
    port = DomePort(radius_m=0.05, thickness_m=0.006)
    assert axial_magnification(port) == (1.0, 1.0)
    np.testing.assert_allclose(traced_magnification(port), 1, rtol=CENTRAL_DIFFERENCE)


@given(x=st.floats(-0.02, 0.02), y=st.floats(-0.02, 0.02), z=st.floats(-0.03, 0.03), n_port=st.floats(1.4, 1.8))
@example(x=5e-324, y=0.0, z=0.01, n_port=1.5)
@example(x=0.0, y=2e-60, z=0.0156, n_port=1.5)
def test_a_decentred_dome_against_exact_rays(x, y, z, n_port):
    port = DomePort(centre_m=(x, y, z), radius_m=0.05, thickness_m=0.006, n_port=n_port)
    np.testing.assert_allclose(axial_magnification(port), traced_magnification(port), rtol=CENTRAL_DIFFERENCE)


@given(backwards=st.floats(1e-4, 0.0499))
def test_a_dome_goes_from_one_to_n_as_the_pinhole_moves_to_its_wall(backwards):
    """Centre behind the pinhole: between centred dome (1) and a pinhole at the wall of a thin one, as flat (n)."""
    port = DomePort(centre_m=(0, 0, -backwards), radius_m=0.05, thickness_m=1e-9)
    smallest, largest = axial_magnification(port)
    assert smallest == largest
    assert 1 < largest < 1.333
    # In closed form for a thin dome: 1 / (1 - (e / R) (1 - 1 / n)).
    assert largest == pytest.approx(1 / (1 - backwards / 0.05 * (1 - 1 / 1.333)), rel=1e-6)


def test_a_pinhole_behind_the_centre_sees_more_than_in_air():
    assert max(axial_magnification(DomePort(centre_m=(0, 0, 0.01), radius_m=0.05, thickness_m=0.006))) < 1


def test_without_a_port_nothing_changes():
    assert axial_magnification(NoPort()) == (1.0, 1.0)
    np.testing.assert_allclose(traced_magnification(NoPort()), 1, rtol=CENTRAL_DIFFERENCE)


def test_an_axis_that_is_totally_reflected_is_refused():
    flat = FlatPort(distance_m=0.02, thickness_m=0.008, normal=(2.0, 0, 1.0), n_inside=1.333, n_water=1.0)
    with pytest.raises(ValueError, match="expected an optical axis that gets through the port"):
        axial_magnification(flat)
    dome = DomePort(centre_m=(0.049, 0, 0), radius_m=0.05, thickness_m=0.001, n_inside=1.333, n_water=1.0)
    with pytest.raises(ValueError, match="expected an optical axis that gets through the dome"):
        axial_magnification(dome)


def test_the_field_behind_a_flat_port_is_snells():
    """The image reaches 400 px left and right of its middle at 400 px focal length: 45 degrees in air."""
    port = FlatPort(distance_m=0.02, thickness_m=0.008)
    field = field_of_view(CAMERA, port)
    for angle, half_size in ((field.horizontal, 400), (field.vertical, 300), (field.diagonal, 500)):
        in_air = np.arctan(half_size / 400)
        assert angle == pytest.approx(2 * np.arcsin(np.sin(in_air) / 1.333), rel=ROUNDING)
    dry = field_of_view(CAMERA, replace(port, n_water=1.0))
    assert dry.horizontal == pytest.approx(np.pi / 2, rel=ROUNDING)


def test_the_rim_bounds_the_field():
    """A thin window 20 mm off with 10 mm clear radius: 26.6 degrees, which is inside the image."""
    port = FlatPort(distance_m=0.02, thickness_m=1e-9, n_water=1.0, aperture_radius_m=0.01)
    one_sample = 500 / 2000 / 400
    assert field_of_view(CAMERA, port).horizontal == pytest.approx(2 * np.arctan(0.5), abs=2 * one_sample)


def test_a_fisheye_can_see_behind_itself():
    """400 px at 100 px per radian: 4 radians from edge to edge, 229 degrees."""
    wide = FisheyeCamera(width_px=400, height_px=400, fx_px=100.0, fy_px=100.0, cx_px=199.5, cy_px=199.5)
    assert field_of_view(wide, NoPort()).horizontal == pytest.approx(4.0, rel=ROUNDING)


def test_a_port_that_hides_the_axis_is_refused():
    port = FlatPort(distance_m=0.02, thickness_m=0.008, normal=(1.0, 0, 1.0), aperture_radius_m=0.005)
    with pytest.raises(ValueError, match="expected the principal point to see through the port, got MISSED_PORT"):
        field_of_view(CAMERA, port)


@pytest.mark.parametrize("name", ["bench", "aqua2", "bluerov2"])
def test_the_presets_have_consistent_properties(name):
    """The summary repeats the functions; small fields shrink by the magnification."""
    rig = Rig.load(name)
    found = port_properties(rig, object_distance_m=1.0, nearest_focus_m=0.1)
    port = OpticalTrain.from_rig(rig).port
    assert found.n_water == port.n_water
    np.testing.assert_allclose(found.magnification, found.traced_magnification, rtol=CENTRAL_DIFFERENCE)
    assert found.focus is not None
    assert found.appears_at_m < found.object_distance_m
    assert found.field_in_water.diagonal <= found.field_in_air.diagonal + ROUNDING
    assert np.isfinite(found.lateral_colour_px)


def test_a_rig_without_a_port_has_properties_too():
    rig = Rig.load("bench").model_copy(update={"port": NoPortSpec(shape="none")})
    found = port_properties(rig, object_distance_m=1.0)
    assert (found.magnification, found.appears_at_m, found.focus) == ((1.0, 1.0), 1.0, None)
    assert found.field_in_air == found.field_in_water
    assert found.lateral_colour_px == pytest.approx(0, abs=1e-9)
