"""The sun: its place by closed form and by NREL's own example, its light by the standard it comes from."""

import importlib.util
from datetime import UTC, datetime, timedelta, timezone

import numpy as np
import pytest

from scenes.light.sun import Sun, air_mass, direct_irradiance, extraterrestrial_and_standard, sun_at

needs_pvlib = pytest.mark.skipif(importlib.util.find_spec("pvlib") is None, reason="pvlib is an optional extra")

OBLIQUITY_DEG = 23.44
REFRACTION_DEG = 0.04
"""Bending of light by the air at 20 degrees and more above the horizon (Bennett 1982)."""


@pytest.mark.parametrize("elevation", [0.0, -5.0, 91.0, np.nan])
def test_sun_must_be_above_the_horizon(elevation):
    with pytest.raises(ValueError, match="elevation_deg above 0 and at most 90"):
        Sun(elevation_deg=elevation)


def test_azimuth_runs_from_east_to_north():
    np.testing.assert_allclose(Sun(elevation_deg=60.0, azimuth_deg=90.0).direction, [0, 0.5, 0.75**0.5], atol=1e-15)


def test_refracted_sun_obeys_snell():
    sun = Sun(elevation_deg=25.0, azimuth_deg=200.0)
    np.testing.assert_allclose(1.34 * sun.refracted(1.34)[:2], sun.direction[:2], rtol=1e-14)
    assert np.linalg.norm(sun.refracted(1.34)) == pytest.approx(1, abs=1e-15)


@pytest.mark.parametrize(("elevation", "expected"), [(90, 1.0), (30, 1.994), (10, 5.586), (5, 10.306), (0, 37.92)])
def test_air_mass(elevation, expected):
    """Kasten & Young 1989, table II (their fit is 0.9997 at the zenith, which is the tolerance there)."""
    assert air_mass(elevation) == pytest.approx(expected, rel=5e-4)


def test_light_at_the_standards_air_mass_is_the_standards():
    wavelength = np.array([400.0, 550.0, 700.0])
    elevation = np.interp(-1.5, -air_mass(np.linspace(41, 43, 2001)), np.linspace(41, 43, 2001))
    space, ground = extraterrestrial_and_standard(wavelength)
    np.testing.assert_allclose(direct_irradiance(wavelength, elevation), ground, rtol=1e-6)  # interpolated elevation
    assert np.all(direct_irradiance(wavelength, 90.0) < space)


def test_beers_law_adds_up_and_reddens():
    """Logarithms of transmittance are in proportion to air mass; a low sun is red."""
    wavelength = np.array([450.0, 550.0, 650.0])
    space, _ = extraterrestrial_and_standard(wavelength)
    high, low = (np.log(space / direct_irradiance(wavelength, e)) for e in (70.0, 8.0))
    np.testing.assert_allclose(low / high, air_mass(8.0) / air_mass(70.0), rtol=1e-12)
    blue, _, red = direct_irradiance(wavelength, 5.0)
    assert blue < 0.5 * red


@needs_pvlib
def test_nrels_own_example():
    """Reda & Andreas 2004, table A5.1: zenith angle 50.11162, azimuth 194.34024 degrees from north.

    Theirs is at 1830 m and 820 mbar, ours at sea level: refraction differs by a fifth of 0.02 degrees.
    """
    time = datetime(2003, 10, 17, 12, 30, 30, tzinfo=timezone(timedelta(hours=-7)))
    sun = sun_at(time, latitude_deg=39.742476, longitude_deg=-105.1786)
    assert sun.elevation_deg == pytest.approx(90 - 50.11162, abs=0.006)
    assert sun.azimuth_deg == pytest.approx((90 - 194.34024) % 360, abs=1e-3)


@needs_pvlib
@pytest.mark.parametrize(("month", "declination"), [(3, 0.0), (6, OBLIQUITY_DEG), (9, 0.0), (12, -OBLIQUITY_DEG)])
@pytest.mark.parametrize("latitude", [-35.0, 20.0, 45.0])
def test_noon_at_equinox_and_solstice(month, declination, latitude):
    """Closed form: at noon the sun stands at 90 - |latitude - declination|, in the south or the north."""
    # On the 20th to 23rd the declination moves by up to 0.4 degrees a day at the equinoxes.
    day = {3: 20, 6: 21, 9: 23, 12: 21}[month]
    minutes = [datetime(2026, month, day, 11, 30, tzinfo=UTC) + timedelta(minutes=m) for m in range(60)]
    noon = max((sun_at(t, latitude_deg=latitude, longitude_deg=0.0) for t in minutes), key=lambda s: s.elevation_deg)
    tolerance = 0.4 + REFRACTION_DEG
    assert noon.elevation_deg == pytest.approx(90 - abs(latitude - declination), abs=tolerance)
    if noon.elevation_deg < 85:
        north = latitude < declination
        assert noon.azimuth_deg == pytest.approx(90 if north else 270, abs=1.5)  # one minute is up to a degree


@needs_pvlib
def test_night_is_said():
    with pytest.raises(ValueError, match=r"expected a time at which the sun is up, got 2026-03-20T00:00:00\+00:00"):
        sun_at(datetime(2026, 3, 20, tzinfo=UTC), latitude_deg=20.0, longitude_deg=0.0)


def test_all_that_is_wrong_with_time_and_place_is_said():
    with pytest.raises(ValueError, match=r"with its zone.*latitude_deg from -90 to 90, got 95.*longitude_deg.*got 200"):
        sun_at(datetime(2026, 3, 20, 12, 0), latitude_deg=95.0, longitude_deg=200.0)


def test_without_pvlib_a_sentence_says_what_to_install(monkeypatch):
    def missing(name):
        raise ModuleNotFoundError(name)

    monkeypatch.setattr("scenes.light.sun.importlib.import_module", missing)
    with pytest.raises(ImportError, match=r"pip install 'mirrorgaze\[sun\]', or give its elevation and azimuth"):
        sun_at(datetime(2026, 3, 20, 12, 0, tzinfo=UTC), latitude_deg=20.0, longitude_deg=0.0)
