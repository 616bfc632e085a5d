"""Waves: slopes of the measured variance, and a sun seen through them that loses no light."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from optics.kernels.backend import Array3f32, Float32, Float64
from optics.kernels.packing import on_device
from optics.kernels.refraction import dielectric_transmittance
from scenes.light.sky import Daylight
from scenes.light.sun import SUN_RADIUS_RAD, Sun
from scenes.light.waves import (
    SunUniforms,
    WaveUniforms,
    Wind,
    cosine_of_turns,
    sea_waves,
    slope_variance,
    sun_seen,
    surface_normal,
    wave_turns,
)

INDEX = 1.34
SINGLE_PRECISION = 1e-5
WAVELENGTH = np.array([450.0, 550.0, 650.0])


def surface_inputs(waves, time_s=0.0):
    return on_device(WaveUniforms.of(waves)), [Float32(turns) for (turns,) in wave_turns(waves, np.array([time_s])).T]


def vectors(array):
    return Array3f32(*(Float32(np.ascontiguousarray(column, dtype=np.float32)) for column in np.transpose(array)))


def total_variance(waves):
    """Covariance of the sinusoids' slopes over the plane, and of the ripples."""
    number = np.linalg.norm(waves.wave_number, axis=1, keepdims=True)
    along = waves.slope[:, np.newaxis] * waves.wave_number / number
    return along.T @ along / 2 + waves.ripple_variance


@settings(max_examples=30)
@given(speed=st.floats(0.01, 15.0), azimuth=st.floats(-360, 360), seed=st.integers(0, 1000))
def test_variance_is_cox_and_munks_for_every_sea(speed, azimuth, seed):
    """Resolved and unresolved parts add up: along the wind 0.00316 U, across it 0.003 + 0.00192 U."""
    wind = Wind(speed_m_per_s=speed, azimuth_deg=azimuth)
    covariance = total_variance(sea_waves(wind, seed))
    along, across = np.einsum("ij,jk,ik->i", wind.axes, covariance, wind.axes)
    np.testing.assert_allclose([along, across], slope_variance(wind), rtol=1e-6)
    if speed >= 1:
        np.testing.assert_allclose(slope_variance(wind), [0.00316 * speed, 0.003 + 0.00192 * speed], rtol=1e-12)


def test_long_waves_have_the_slopes_of_a_slick():
    """Cox & Munk 1954: oil took away waves shorter than 0.3 m and left 0.008 + 0.00156 U.

    Tolerance: each of the 24 waves stands for half an octave; one that falls on the other side is a twelfth of them.
    """
    for speed in (5.0, 7.0, 10.0, 14.0):
        waves = sea_waves(Wind(speed_m_per_s=speed))
        long = np.linalg.norm(waves.wave_number, axis=1) < 2 * np.pi / 0.3
        assert (waves.slope[long] ** 2 / 2).sum() == pytest.approx(0.008 + 0.00156 * speed, rel=1 / 12)


@pytest.mark.parametrize("speed", [0.2, 1.0, 4.0, 15.0])
def test_ripples_are_a_good_part_of_the_slopes(speed):
    """Waves below 0.1 m carry a quarter to a half of the variance, more in strong winds (Cox & Munk's two fits)."""
    wind = Wind(speed_m_per_s=speed)
    share = np.trace(sea_waves(wind).ripple_variance) / slope_variance(wind).sum()
    assert 0.2 < share < 0.6


def test_normals_have_the_resolved_variance():
    waves = sea_waves(Wind(speed_m_per_s=6.0, azimuth_deg=30.0), seed=3)
    # A square of 4 km: a hundred of the longest waves, so that their phases are evenly met.
    x, y = np.random.default_rng(0).uniform(-2000, 2000, (2, 400_000))
    normal = surface_normal(*surface_inputs(waves), Float32(x.astype(np.float32)), Float32(y.astype(np.float32)))
    nx, ny, nz = (np.array(component, dtype=np.float64) for component in normal)
    np.testing.assert_allclose(nx**2 + ny**2 + nz**2, 1, atol=SINGLE_PRECISION)
    covariance = np.cov(nx / nz, ny / nz)
    # Variances of 400 000 samples have a standard error of 0.2 %; four of them, of the trace.
    expected = total_variance(waves) - waves.ripple_variance
    np.testing.assert_allclose(covariance, expected, atol=0.008 * np.trace(expected))


def test_normal_is_that_of_the_height():
    """Central differences of the sum of sinusoids, and a time at which every wave has moved on by omega t."""
    waves, time = sea_waves(Wind(speed_m_per_s=3.0), seed=1), 7.3
    number = np.linalg.norm(waves.wave_number, axis=1)

    def height(x, y):
        phase = waves.wave_number @ [x, y] - np.sqrt(9.81 * number) * time + waves.phase
        return np.sum(waves.slope / number * np.cos(phase))

    x, y, h = 1.7, -0.4, 1e-4
    slope = [(height(x + h, y) - height(x - h, y)) / (2 * h), (height(x, y + h) - height(x, y - h)) / (2 * h)]
    normal = surface_normal(*surface_inputs(waves, time), Float32(x), Float32(y))
    # Float32 phases of waves of up to 10 turns per metre: 1e-5 of a slope of 0.1 each.
    np.testing.assert_allclose([normal.x[0] / normal.z[0], normal.y[0] / normal.z[0]], np.negative(slope), atol=2e-5)


def test_no_wind_is_a_flat_sea():
    normal = surface_normal(*surface_inputs(sea_waves(Wind(speed_m_per_s=0.0))), Float32(3), Float32(4))
    assert [float(component[0]) for component in normal] == [0, 0, 1]


def test_same_seed_same_sea_and_another_seed_another():
    first, again, other = (sea_waves(Wind(), seed) for seed in (5, 5, 6))
    assert np.array_equal(first.wave_number, again.wave_number)
    assert np.array_equal(first.phase, again.phase)
    assert not np.array_equal(first.phase, other.phase)


def test_cosine_of_turns():
    turns = np.linspace(-50.3, 50.7, 100_001).astype(np.float32)
    expected = np.cos(2 * np.pi * turns.astype(np.float64))
    np.testing.assert_allclose(cosine_of_turns(Float32(turns)), expected, atol=1e-6)  # polynomial 6e-7, float32 2e-7


def transmittance(cosine_air):
    return np.array(dielectric_transmittance(Float64(np.asarray(cosine_air)), 1.0, INDEX))


def sun_through(wind, sun, directions, normals=None):
    daylight = Daylight(wavelength_nm=WAVELENGTH, sun=sun)
    uniforms = on_device(SunUniforms.of(daylight, sea_waves(wind), INDEX))
    normals = np.broadcast_to([0.0, 0.0, 1.0], directions.shape) if normals is None else normals
    seen = sun_seen(uniforms, vectors(directions), vectors(normals))
    return np.array([s.numpy() for s in seen], dtype=np.float64), daylight


def around(centre, radius, rings=600, spokes=720):
    """Directions within an angle of `centre` and their solid angles: midpoint rule over polar angle and azimuth."""
    polar = radius * (np.arange(rings) + 0.5) / rings
    azimuth = 2 * np.pi * (np.arange(spokes) + 0.5) / spokes
    polar, azimuth = (grid.ravel() for grid in np.meshgrid(polar, azimuth, indexing="ij"))
    first = np.cross(centre, [0.1, 0.9, 0.2])
    first /= np.linalg.norm(first)
    frame = np.array([first, np.cross(centre, first), centre])
    local = np.column_stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])
    return local @ frame, np.sin(polar) * (radius / rings) * (2 * np.pi / spokes)


@pytest.mark.parametrize("elevation", [90.0, 60.0, 30.0])
def test_disk_of_a_flat_sea_carries_the_transmitted_sun(elevation):
    """Radiance E / (solid angle) T n^2 over the disk: what enters through a level plane is E cos T."""
    sun = Sun(elevation_deg=elevation, azimuth_deg=70.0)
    directions, solid_angle = around(sun.refracted(INDEX), 0.012, rings=400, spokes=800)
    seen, daylight = sun_through(Wind(speed_m_per_s=0.0), sun, directions)
    carried = seen @ (solid_angle * directions[:, 2])
    expected = daylight.sun_irradiance * sun.cosine * transmittance(sun.cosine)
    # The edge of the disk in steps of 3e-5 rad on a radius of 3.5e-3: half a percent at worst.
    np.testing.assert_allclose(carried, expected, rtol=5e-3)
    centre, _ = sun_through(Wind(speed_m_per_s=0.0), sun, sun.refracted(INDEX)[np.newaxis])
    solid = 2 * np.pi * (1 - np.cos(SUN_RADIUS_RAD))
    expected = daylight.sun_irradiance / solid * transmittance(sun.cosine) * INDEX**2
    np.testing.assert_allclose(centre[:, 0], expected, rtol=SINGLE_PRECISION)


@pytest.mark.parametrize("speed", [0.5, 3.0, 10.0])
@pytest.mark.parametrize("elevation", [80.0, 50.0])
def test_glitter_carries_the_transmitted_sun(speed, elevation):
    """Rationale: facets only redistribute sunlight, so over all directions the glitter's irradiance is what they pass.

    Expected: E times the mean over the slopes of T(s.n) (s.n) / n_z, by Gauss-Hermite quadrature: an independent
    integral, over slopes instead of directions.
    """
    wind, sun = Wind(speed_m_per_s=speed, azimuth_deg=20.0), Sun(elevation_deg=elevation, azimuth_deg=100.0)
    waves = sea_waves(wind)
    disk = (SUN_RADIUS_RAD / (2 * (INDEX - 1))) ** 2
    spread = np.linalg.cholesky(waves.ripple_variance + disk * np.eye(2))
    # Facets that are seven standard deviations off turn the image by a quarter of that.
    directions, solid_angle = around(sun.refracted(INDEX), min(1.2, 0.6 * 7 * spread.max()))
    seen, daylight = sun_through(wind, sun, directions)
    carried = seen @ (solid_angle * np.maximum(directions[:, 2], 0))
    nodes, weights = np.polynomial.hermite_e.hermegauss(24)
    slope = np.stack(np.meshgrid(nodes, nodes), axis=-1) @ spread.T
    normal = np.concatenate([-slope, np.ones((24, 24, 1))], axis=-1)
    projected = normal @ sun.direction
    passed = projected * transmittance((projected / np.linalg.norm(normal, axis=-1)).ravel()).reshape(24, 24)
    expected = daylight.sun_irradiance * np.einsum("i,j,ij", weights, weights, passed) / (2 * np.pi)
    # Float32 in n w - s, 0.34 long, and the midpoint rule.
    np.testing.assert_allclose(carried, expected, rtol=2e-3)


def test_glitter_is_centred_on_the_sun_of_the_resolved_wave():
    """A tilted wave moves the glitter to where that facet refracts the sun, by vector Snell in NumPy."""
    sun, tilt = Sun(elevation_deg=70.0, azimuth_deg=0.0), np.array([0.1, -0.05, 1.0])
    tilt /= np.linalg.norm(tilt)
    directions, _ = around(sun.refracted(INDEX), 0.3)
    seen, _ = sun_through(Wind(speed_m_per_s=0.3), sun, directions, np.broadcast_to(tilt, directions.shape))
    cosine = sun.direction @ tilt
    tangent = (sun.direction - cosine * tilt) / INDEX
    expected = tangent + np.sqrt(1 - tangent @ tangent) * tilt
    # The density peaks there up to the slow factors; the spread is some 0.01.
    assert directions[np.argmax(seen[1])] @ expected > np.cos(0.004)


def test_looking_at_the_sun_outshines_a_white_card():
    """A card lit by the sun has E cos / pi; the ripples of 4 m/s spread its image to about that brightness times 20."""
    sun = Sun(elevation_deg=60.0)
    seen, daylight = sun_through(Wind(speed_m_per_s=4.0), sun, sun.refracted(INDEX)[np.newaxis])
    assert np.all(seen[:, 0] > 20 * daylight.sun_irradiance / np.pi)
    assert np.all(np.isfinite(seen))


@pytest.mark.parametrize("speed", [-1.0, 15.1, np.nan])
def test_wind_is_within_what_was_measured(speed):
    with pytest.raises(ValueError, match="speed_m_per_s from 0 to 15, got"):
        Wind(speed_m_per_s=speed)
