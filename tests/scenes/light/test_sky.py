"""Daylight: the sky's radiance must carry the irradiance that it is said to have, whatever its shape."""

import numpy as np
import pytest

from optics.kernels.backend import Float32
from scenes.light.sky import Daylight, clear_sky, clear_sky_irradiance, overcast_sky, sky_seen, sky_table
from scenes.light.spectrum import sun_irradiance
from scenes.light.sun import Sun

WAVELENGTH = np.array([420.0, 550.0, 680.0])


def irradiance_of(radiance):
    """Irradiance on a level plane: 2 pi times the integral of L cos over cos, by the midpoint rule."""
    cosine = (np.arange(4000) + 0.5) / 4000
    return 2 * np.pi * np.mean(radiance(cosine) * cosine, axis=-1)


@pytest.mark.parametrize("elevation", [5.0, 30.0, 60.0, 90.0])
@pytest.mark.parametrize("cloud", [0.0, 0.4, 1.0])
def test_radiance_carries_the_skys_irradiance(elevation, cloud):
    daylight = Daylight(wavelength_nm=WAVELENGTH, sun=Sun(elevation_deg=elevation), cloud=cloud)
    # 64 Gauss nodes across the ring of the sun's height, where the averaged sky has a kink: measured 6e-4.
    np.testing.assert_allclose(irradiance_of(daylight.sky_radiance), daylight.sky_irradiance, rtol=1e-3)


def test_overcast_sky_is_the_cardioid():
    """Moon & Spencer 1942: three times as bright overhead as at the horizon; its irradiance is 1."""
    assert overcast_sky(1.0) == pytest.approx(3 * overcast_sky(0.0), rel=1e-15)
    assert irradiance_of(overcast_sky) == pytest.approx(1, rel=1e-7)  # midpoint rule


def test_clear_sky_follows_the_cie_where_it_needs_no_average():
    """Sky type 12 with the sun overhead is the same in all azimuths; CIE S 011/E:2003, eqs. 1 to 3."""

    def relative(cosine):
        zenith = np.arccos(cosine)
        indicatrix = 1 + 10 * (np.exp(-3 * zenith) - np.exp(-3 * np.pi / 2)) + 0.45 * cosine**2
        return (1 - np.exp(-0.32 / cosine)) * indicatrix

    cosine = np.array([0.1, 0.4, 0.7, 1.0])
    np.testing.assert_allclose(
        clear_sky(cosine, 90.0) / clear_sky(np.ones(4), 90.0), relative(cosine) / relative(1.0), rtol=1e-6
    )


def test_clear_sky_is_brightest_around_the_sun_and_bright_at_the_horizon():
    shape = clear_sky(np.linspace(0.0, 1.0, 101), 60.0)
    assert shape[0] > shape[40]
    assert 80 <= 40 + np.argmax(shape[40:]) <= 88  # cos 30 degrees = 0.87


def test_standards_sky_at_the_standards_air_mass():
    """At air mass 1.5 (41.8 degrees) the sky is what G173's global spectrum has beyond its direct beam."""
    expected = sun_irradiance(WAVELENGTH)[1]
    np.testing.assert_allclose(clear_sky_irradiance(WAVELENGTH, 41.81), expected, rtol=2e-3)  # 41.81: to 0.01 degrees


def test_clouds_follow_kasten_and_czeplak():
    """Global light falls to 1 - 0.75 N^3.4 of the clear day's; under a closed cover all of it is diffuse."""
    sun = Sun(elevation_deg=50.0)

    def total(cloud):
        day = Daylight(wavelength_nm=WAVELENGTH, sun=sun, cloud=cloud)
        return day.sun_irradiance * sun.cosine + day.sky_irradiance

    for cloud in (0.3, 0.8, 1.0):
        np.testing.assert_allclose(total(cloud), (1 - 0.75 * cloud**3.4) * total(0.0), rtol=1e-12)
    overcast = Daylight(wavelength_nm=WAVELENGTH, sun=sun, cloud=1.0)
    np.testing.assert_allclose(overcast.sun_irradiance, 0, atol=1e-15)


@pytest.mark.parametrize("cloud", [-0.1, 1.1, np.nan])
def test_cloud_is_a_share(cloud):
    with pytest.raises(ValueError, match=r"cloud from 0 \(clear\) to 1 \(overcast\), got"):
        Daylight(wavelength_nm=WAVELENGTH, sun=Sun(), cloud=cloud)


@pytest.mark.parametrize("cloud", [0.0, 1.0])
def test_kernel_looks_up_the_same_sky(cloud):
    daylight = Daylight(wavelength_nm=WAVELENGTH, sun=Sun(elevation_deg=40.0), cloud=cloud)
    cosine = np.linspace(0.0, 1.0, 317)
    irradiance = [Float32(float(v)) for v in daylight.sky_irradiance]
    seen = sky_seen(irradiance, sky_table(daylight), Float32(cosine.astype(np.float32)))
    # 1023 cells, linear in between; largest at the ring of the sun's height.
    np.testing.assert_allclose([s.numpy() for s in seen], daylight.sky_radiance(cosine), rtol=1e-3)
