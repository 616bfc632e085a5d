"""The light field: its radiance must solve the radiative-transfer equation that it claims to solve."""

import numpy as np
import pytest

from optics.backend import Array3f32, Float32
from optics.materials import aluminium_index
from optics.scattering import fournier_forand, fournier_forand_backscattered_fraction
from rigs import Water
from scenes.light import SMALLEST_SCATTERING_ANGLE, Sun, underwater_light
from scenes.shading import light_parameters, scattered_in, surface_light
from scenes.spectrum import camera_bands, reflectance

SINGLE_PRECISION = 2e-5
"""The kernels work in float32; exp and the table's interpolation leave a few units in the last place."""


@pytest.fixture(scope="module")
def light():
    return underwater_light(Water(jerlov_type="II"), Sun(elevation_deg=50.0, azimuth_deg=30.0))


@pytest.fixture(scope="module")
def parameters(light):
    return light_parameters(light, aluminium_index(camera_bands().wavelength_nm))


def line_of_sight(light, direction, depth, length, steps=20001):
    """Light scattered into a line of sight, by adding it up along the way (trapezoidal rule)."""
    s = np.linspace(0, length, steps)[:, np.newaxis]
    angle = np.arccos(np.clip(light.towards_sun @ direction, -1, 1))
    phase = fournier_forand(max(angle, SMALLEST_SCATTERING_ANGLE))
    irradiance = (light.sun_irradiance + light.sky_irradiance) / light.towards_sun[2]
    local = irradiance * np.exp(-light.diffuse_attenuation * (depth - direction[2] * s))
    return np.trapezoid(light.scattering * phase * local * np.exp(-light.beam_attenuation * s), s, axis=0)


@pytest.mark.parametrize("length", [0.1, 2.0, 15.0])
@pytest.mark.parametrize("direction", [[1.0, 0.0, 0.0], [0.6, 0.0, -0.8], [0.0, 0.8, 0.6], [-0.5, 0.5, -(0.5**0.5)]])
def test_light_scattered_into_a_segment_is_its_integral(light, parameters, direction, length):
    """Rationale: F(z0, w) - exp(-c r) F(z1, w) is exact for this source; the integral is an independent way there.

    Expected: equal to the quadrature within the table's interpolation of the phase function.
    """
    depth = 12.0
    ones = [Float32(1) for _ in parameters["c"]]
    added, left = scattered_in(parameters, ones, Array3f32(*direction), Float32(depth), Float32(length))
    expected = line_of_sight(light, np.array(direction), depth, length)
    # The table's cells are 0.25 degrees wide: linear interpolation of a convex function, measured below 2e-4.
    np.testing.assert_allclose([a[0] for a in added], expected, rtol=3e-4)
    np.testing.assert_allclose([t[0] for t in left], np.exp(-light.beam_attenuation * length), rtol=SINGLE_PRECISION)


def test_two_segments_are_one(parameters):
    """A line of sight may be cut anywhere: water does not know where our segments end."""
    direction, depth = Array3f32(0.48, 0.6, -0.64), 6.0
    ones = [Float32(1) for _ in parameters["c"]]
    whole, left_whole = scattered_in(parameters, ones, direction, Float32(depth), Float32(5.0))
    near, left = scattered_in(parameters, ones, direction, Float32(depth), Float32(2.0))
    far, left_parts = scattered_in(parameters, left, direction, Float32(depth + 0.64 * 2), Float32(3.0))
    for a, b, c in zip(whole, near, far, strict=True):
        assert a[0] == pytest.approx(b[0] + c[0], rel=SINGLE_PRECISION)
    for a, b in zip(left_whole, left_parts, strict=True):
        assert a[0] == pytest.approx(b[0], rel=SINGLE_PRECISION)


def test_sea_surface_passes_light_only_within_snells_window(light, parameters):
    """From below, sin(critical) = 1/n; radiance of the passed sky is the sky's times n^2 T."""
    ones = [Float32(1) for _ in parameters["c"]]
    critical = np.arcsin(1 / light.n_water)
    for angle, open_ in ((critical - 0.01, True), (critical + 0.01, False)):
        direction = Array3f32(float(np.sin(angle)), 0.0, float(np.cos(angle)))
        sky, reflected, passes = surface_light(parameters, ones, direction)
        assert bool(passes[0]) is open_
        assert (sky[0][0] > 0) is open_
        assert (reflected[0][0] < 1) is open_
    sky, reflected, _ = surface_light(parameters, ones, Array3f32(0, 0, 1))
    normal_transmittance = 4 * light.n_water / (1 + light.n_water) ** 2
    assert sky[3][0] == pytest.approx(
        normal_transmittance * light.n_water**2 * light.sky_radiance[3], rel=SINGLE_PRECISION
    )
    assert reflected[3][0] == pytest.approx(1 - normal_transmittance, rel=1e-4)  # a small difference of large numbers


def test_phase_function_scatters_everything_somewhere():
    """Fournier-Forand integrates to 1 over the sphere; what is missing below 1e-6 rad is analytic in the head."""
    angle = np.geomspace(1e-9, np.pi, 400_001)
    ring = 2 * np.pi * np.sin(angle) * fournier_forand(angle)
    # The forward peak goes as angle^(-1.7): logarithmic steps integrate it to 1e-3.
    assert np.trapezoid(ring * angle, np.log(angle)) == pytest.approx(1, abs=2e-3)
    behind = angle > np.pi / 2
    backscattered = np.trapezoid(ring[behind], angle[behind])
    assert backscattered == pytest.approx(fournier_forand_backscattered_fraction(), rel=1e-3)
    # Petzold's average: bb/b = 0.0183 (Mobley, Sundman & Boss 2002).
    assert fournier_forand_backscattered_fraction() == pytest.approx(0.0183, abs=5e-5)


def test_red_dies_with_depth_and_blue_does_not():
    """Type IB: water absorbs red some ten times as much as blue (Pope & Fry 1997)."""
    light = underwater_light(Water(jerlov_type="IB"), Sun())
    shallow, deep = light.white_radiance(1.0), light.white_radiance(10.0)
    red, _, blue = deep / shallow
    assert red < 0.3 * blue


def test_bands_integrate_a_quintic_exactly():
    """Three-point Gauss-Hermite: moments of a normal distribution up to the fifth, about each channel's peak."""
    bands = camera_bands()
    for row, peak in zip(bands.weight, (600.0, 540.0, 460.0), strict=True):
        offset = bands.wavelength_nm - peak
        moments = [row @ offset**k for k in range(6)]
        np.testing.assert_allclose(moments, [1, 0, 30.0**2, 0, 3 * 30.0**4, 0], atol=1e-4, rtol=1e-12)


def test_reflectance_comes_from_the_chart():
    """ColorChecker red at 600 nm: 0.178 (BabelColor average)."""
    assert reflectance("red", np.array([600.0]))[0] == pytest.approx(0.178)
    with pytest.raises(ValueError, match=r"expected a ColorChecker patch .*got 'crimson'"):
        reflectance("crimson", np.array([600.0]))


@pytest.mark.parametrize("elevation", [0.0, -5.0, 91.0])
def test_sun_must_be_above_the_horizon(elevation):
    with pytest.raises(ValueError, match="elevation_deg above 0 and at most 90"):
        Sun(elevation_deg=elevation)
