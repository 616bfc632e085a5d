"""Light in the kernels: what they add to a line of sight must be what the radiance field says."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import interpn

from optics.kernels.backend import Array3f32, Bool, Float32
from optics.kernels.packing import on_device
from optics.water.mirror_coatings import FILMS, mirror_reflectance
from optics.water.radiative_transfer.column import multiple_radiance, once_radiance, solve_columns
from optics.water.radiative_transfer.field import WINDOW_STREAMS
from optics.water.radiative_transfer.quadrature import window_cosines_air
from rigs import Water
from scenes.kernels.shading import (
    Segment,
    ambient_irradiance,
    channels,
    mirror_throughput,
    scattered_in,
    seen_through_surface,
)
from scenes.light.field_table import layer
from scenes.light.light import underwater_light
from scenes.light.sky import Daylight
from scenes.light.spectrum import reflectance, water_bands
from scenes.light.sun import Sun

SINGLE_PRECISION = 2e-5
"""The kernels work in float32; exp and interpolation leave a few units in the last place."""

DEPTH = 6.0


@pytest.fixture(scope="module")
def light():
    sun = Sun(elevation_deg=50.0, azimuth_deg=30.0)
    wavelength = water_bands().wavelength_nm
    return underwater_light(Water(jerlov_type="II"), Daylight(wavelength_nm=wavelength, sun=sun, cloud=0.0))


@pytest.fixture(scope="module")
def kernel(light):
    """Uniforms for a robot at DEPTH, and the tables."""
    uniforms, tables = on_device(light.uniforms(DEPTH)), light.tables()
    return uniforms, replace(tables, field_layer=layer(uniforms, tables.field, Float32(DEPTH)))


@pytest.fixture(scope="module")
def columns(light):
    return solve_columns(
        light.optics,
        sun_cosine_air=light.daylight.sun.cosine,
        sun_irradiance=light.daylight.sun_irradiance,
        sky_radiance=light.daylight.sky_radiance(window_cosines_air(WINDOW_STREAMS)),
    )


def piece(direction, depth, length, *, end_radius=0.0, veiling_light=0.0):
    return Segment(
        direction=Array3f32(*direction),
        depth=Float32(depth),
        length=Float32(length),
        active=Bool(True),
        sunlit=Float32(1),
        end_radius=Float32(end_radius),
        leans=Bool(False),
        veiling_light=[Float32(veiling_light)] * 3,
    )


def seen(kernel, direction, depth, length):
    uniforms, tables = kernel
    ones = [Float32(1) for _ in uniforms.beam_attenuation]
    segment = piece(direction, depth, length)
    added, left = scattered_in(uniforms, tables, ones, segment)
    return np.array([channel[0] for channel in added]), np.array([value[0] for value in left])


def open_water(light, columns, direction, depth):
    """Radiance of open water by wavelength, straight from the solution."""
    sun = np.radians(light.daylight.sun.azimuth_deg)
    azimuth = np.abs((np.arctan2(direction[1], direction[0]) - sun + np.pi) % (2 * np.pi) - np.pi)
    where = np.array([depth]), np.array([direction[2]]), np.array([azimuth])
    return np.array([(multiple_radiance(c, *where) + once_radiance(c, *where))[0, 0, 0] for c in columns])


DIRECTIONS = {
    "level, across the sun": (0.5, -(0.75**0.5), 1e-6),
    "down": (0.6, 0.0, -0.8),
    "up, beside the window": (0.0, 0.8, 0.6),
    "up, in the window": (-0.3, 0.2, 0.87**0.5),
    "level, towards the sun": (0.75**0.5, 0.5, 1e-6),
}


@pytest.mark.parametrize("length", [0.1, 0.4, 2.0, 5.5])
@pytest.mark.parametrize("direction", DIRECTIONS.values(), ids=DIRECTIONS.keys())
def test_light_scattered_into_a_segment_is_the_difference_of_open_waters(light, kernel, columns, direction, length):
    """Rationale: F(z0, w) - exp(-c r) F(z1, w), with F evaluated from the modes of the solution without any table.

    Expected: equal within 3 % of the light of open water. The tables interpolate within 1.6 % (99 % of directions,
    `docs/explanation/radiative_transfer.md`), and light is divided among a channel's wavelengths as at the robot's
    depth.
    """
    near = open_water(light, columns, direction, DEPTH)
    far = open_water(light, columns, direction, DEPTH - direction[2] * length)
    expected = light.bands.weight @ (near - np.exp(-light.field.beam_attenuation * length) * far)
    added, left = seen(kernel, direction, DEPTH, length)
    scale = light.bands.weight @ near
    assert (np.abs(added - expected) < 0.03 * scale).all(), (added / expected, expected / scale)
    # A short segment's light is a small part of open water's. Between the mirrors, where every view has such segments,
    # nobody looks up into the window: there the near end says least about how light falls off (measured 26 %).
    np.testing.assert_allclose(added, expected, rtol=0.09 if direction[2] < 0.66 else 0.3)
    np.testing.assert_allclose(left, np.exp(-light.field.beam_attenuation * length), rtol=SINGLE_PRECISION)


def test_two_segments_are_one(kernel):
    """A line of sight may be cut anywhere: water does not know where our segments end."""
    direction, depth = (0.48, 0.6, -0.64), 6.0
    whole, left_whole = seen(kernel, direction, depth, 5.0)
    near, left_near = seen(kernel, direction, depth, 2.0)
    uniforms, tables = kernel
    throughput = [Float32(float(t)) for t in left_near]
    segment = piece(direction, depth + 0.64 * 2, 3.0)
    added, left = scattered_in(uniforms, tables, throughput, segment)
    # The cut's own term is divided among wavelengths once with 2 m of water before it and once without.
    np.testing.assert_allclose(near + [a[0] for a in added], whole, rtol=1e-4)
    np.testing.assert_allclose([t[0] for t in left], left_whole, rtol=SINGLE_PRECISION)


@pytest.mark.parametrize("length", [0.3, 2.0])
def test_a_veil_is_added_and_dimmed_no_more(kernel, length):
    """A segment's veiling light is what arrives at its near end: it is added as it is, by the channel's weights."""
    uniforms, tables = kernel
    ones = [Float32(1) for _ in uniforms.beam_attenuation]
    without, with_veil = (
        scattered_in(uniforms, tables, ones, piece((0.6, 0.0, -0.8), DEPTH, length, veiling_light=each))
        for each in (0.0, 0.01)
    )
    more = [b[0] - a[0] for a, b in zip(without[0], with_veil[0], strict=True)]
    np.testing.assert_allclose(more, 0.01, rtol=1e-3)
    np.testing.assert_array_equal([t[0] for t in without[1]], [t[0] for t in with_veil[1]])


@pytest.mark.parametrize("length", [0.3, 2.0])
def test_a_thing_as_bright_as_open_water_is_not_seen(light, kernel, length):
    """What a thing hides from the water before it, it sends itself: a disc as bright as the water changes nothing.

    Its gain and the water's loss are the same share of different things, the one of what is scattered at the end, the
    other of what is scattered all along, and the sun's part of open water is not hidden: they agree within 5 % of the
    light, looking level across the sun.
    """
    uniforms, tables = kernel
    direction = DIRECTIONS["level, across the sun"]
    ones = [Float32(1) for _ in uniforms.beam_attenuation]
    hidden = scattered_in(uniforms, tables, ones, piece(direction, DEPTH, length, end_radius=0.1))
    plain = scattered_in(uniforms, tables, ones, piece(direction, DEPTH, length))
    far = scattered_in(uniforms, tables, ones, piece(direction, DEPTH, np.inf))[0]
    water = np.array([f[0] for f in far])
    seen = []
    for added, left in (hidden, plain):
        passed = np.array([t[0] for t in left]).reshape(3, -1) * light.bands.weight.sum(axis=0).reshape(3, -1)
        seen.append(np.array([a[0] for a in added]) + passed.sum(axis=1) * water)
    np.testing.assert_allclose(seen[0], seen[1], rtol=0.05)
    assert all(h[0] < p[0] for h, p in zip(hidden[0], plain[0], strict=True))


@pytest.mark.parametrize("normal", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (-0.6, 0.0, 0.8)])
def test_ambient_irradiance_is_the_fields(light, kernel, normal):
    """Against the field's own table, interpolated at the direction: nodes differ, the light may not (2 %)."""
    uniforms, tables = kernel
    found = ambient_irradiance(uniforms, tables.ambient, Array3f32(*map(float, normal)), Float32(DEPTH))
    field = light.field
    across = np.arctan2(normal[1], normal[0]) - np.radians(light.daylight.sun.azimuth_deg)
    azimuth = np.abs((across + np.pi) % (2 * np.pi) - np.pi)
    axes = field.depth_m, field.cosine, field.azimuth_rad
    where = (DEPTH, normal[2], azimuth)
    by_wavelength = [np.exp(interpn(axes, np.log(table), where)[0]) for table in field.irradiance]
    expected = light.bands.weight @ by_wavelength
    np.testing.assert_allclose([f[0] for f in found], expected, rtol=0.02)


def test_sea_surface_passes_light_only_within_snells_window(light, kernel):
    """From below, sin(critical) = 1/n; radiance of the passed sky is the sky's times n^2 T."""
    uniforms, tables = kernel
    ones = [Float32(1) for _ in uniforms.beam_attenuation]
    critical = np.arcsin(1 / light.n_water)
    for angle, open_ in ((critical - 0.01, True), (critical + 0.01, False)):
        direction = Array3f32(float(np.sin(angle)), 0.0, float(np.cos(angle)))
        sky, reflected, passes = seen_through_surface(uniforms, tables.sky, ones, direction, Array3f32(0, 0, 1))
        assert bool(passes[0]) is open_
        assert (sky[0][0] > 0) is open_
        assert (reflected[0][0] < 1) is open_
    straight_up = Array3f32(0, 0, 1)
    sky, reflected, _ = seen_through_surface(uniforms, tables.sky, ones, straight_up, straight_up)
    transmittance = 4 * light.n_water / (1 + light.n_water) ** 2
    zenith = light.daylight.sky_radiance([1.0])[:, 0]
    np.testing.assert_allclose([s[0] for s in sky], transmittance * light.n_water**2 * zenith, rtol=SINGLE_PRECISION)
    assert reflected[3][0] == pytest.approx(1 - transmittance, rel=1e-4)  # a small difference of large uniforms


@pytest.mark.parametrize("coating", FILMS)
def test_mirrors_reflect_as_their_films_say(light, coating):
    """Polynomials against the formula they were fitted to: 0.0012 below 84 degrees of incidence."""
    coated = replace(light, coating=coating)
    uniforms, wavelength = coated.uniforms(5.0), light.bands.wavelength_nm
    for angle in (0, 30, 45, 60, 75, 84):
        cosine = np.cos(np.radians(angle))
        found = mirror_throughput(uniforms, [Float32(1) for _ in wavelength], Float32(cosine))
        exact = mirror_reflectance(coating, wavelength, np.array([cosine]), light.n_water)[:, 0]
        np.testing.assert_allclose([f[0] for f in found], exact, atol=0.0012)


def test_channels_are_weighted_sums_of_their_own_wavelengths(light, kernel):
    uniforms, _ = kernel
    spectrum = np.linspace(1.0, 3.0, len(light.bands.wavelength_nm))
    found = channels(uniforms, [Float32(value) for value in spectrum])
    np.testing.assert_allclose([f[0] for f in found], light.bands.weight @ spectrum, rtol=SINGLE_PRECISION)


def test_red_dies_with_depth_and_blue_does_not():
    """Type IB: water absorbs red some ten times as much as blue (Pope & Fry 1997)."""
    light = underwater_light(Water(jerlov_type="IB"))
    shallow, deep = light.white_radiance(1.0), light.white_radiance(10.0)
    red, _, blue = deep / shallow
    assert red < 0.4 * blue


def test_reflectance_comes_from_the_chart():
    """ColorChecker red at 600 nm: 0.178 (BabelColor average)."""
    assert reflectance("red", np.array([600.0]))[0] == pytest.approx(0.178)
    with pytest.raises(ValueError, match=r"expected a ColorChecker patch .*got 'crimson'"):
        reflectance("crimson", np.array([600.0]))
