"""The sea surface of the reference renderer: what it lets down, and what it sends back."""

from dataclasses import replace

import numpy as np
import pytest

from optics.kernels.backend import mi
from optics.water.scattering import fournier_forand
from scenes.reference.bodies import diffuse
from scenes.reference.estimate import estimate
from scenes.reference.medium import water_medium
from scenes.reference.scene import basin
from scenes.reference.sea import Sea
from scenes.reference.surface import SeaSurface, lamps

LARGEST_Z = 4.0
"""Of some 40 comparisons in these tests none should lie outside of this (1 in 16 000 does)."""

N_WATER = 1.34
ABSORPTION = np.array([0.3, 0.1, 0.02])
SUN, SKY = np.array([1.0, 1.5, 0.5]), np.array([0.3, 0.2, 0.6])
TOWARDS_SUN = np.array([0.48, 0.36, 0.8])
DEPTH = 3.0

HIT_TOLERANCE = 1e-4
"""Mitsuba's single precision, and the steps of the sky's map."""


def check(result, expected, *, systematic, precision):
    """z-test with the estimate's own variance, which must be small enough for the test to mean something."""
    error = np.sqrt(result.variance)
    assert (np.abs(result.mean - expected) < LARGEST_Z * error + systematic * expected).all(), (result, expected)
    assert (error < precision * expected).all(), error / expected


def fresnel(cosine):
    """Transmittance of water to air: Born & Wolf 1.5.2, the amplitudes of both polarisations, in NumPy."""
    sine2 = N_WATER**2 * (1 - cosine**2)
    out = np.sqrt(np.maximum(1 - sine2, 0))
    r_s = (N_WATER * cosine - out) / (N_WATER * cosine + out)
    r_p = (cosine - N_WATER * out) / (cosine + N_WATER * out)
    return np.where(sine2 < 1, 1 - (r_s**2 + r_p**2) / 2, 0)


def clear(absorption=ABSORPTION, sun=SUN, scattering=(0.0, 0.0, 0.0)):
    return Sea(
        absorption=absorption,
        scattering=np.array(scattering),
        molecular_fraction=np.full(3, 0.5),
        phase=fournier_forand,
        n_water=np.full(3, N_WATER),
        towards_sun=TOWARDS_SUN,
        sun_irradiance=sun,
        sky_radiance=lambda cosine: np.outer(SKY, 0.5 + cosine),
    )


def under_the_surface(sea, water, **shapes):
    return mi.load_dict({"type": "scene", **lamps(sea), **basin(DEPTH, SeaSurface(N_WATER), water), **shapes})


def looking(direction):
    return lambda pixel, sampler: mi.RayDifferential3f(mi.Point3f(0, 0, 0), mi.Vector3f(*map(float, direction)))


def floor(height, albedo):
    place = mi.ScalarTransform4f().translate([0, 0, height]).scale([200, 200, 1])
    return {"type": "rectangle", "to_world": place, "bsdf": diffuse([albedo] * 3)}


def test_lambertian_floor_under_sun_and_sky():
    """Rationale: what a surface sends back is what the whole chain of sun, sky, Fresnel and water lets down.

    Expected: sun and sky through the surface by Fresnel and n^2, exponential loss on every slant path, and what floor
    and surface throw to and fro (a geometric series with G = 2 integral R(mu) exp(-2 c h / mu) mu dmu).
    """
    albedo, below = 0.4, 1.0
    sea = clear()
    water = water_medium(sea)
    scene = under_the_surface(sea, water, floor=floor(-below, albedo))
    result = estimate(scene, looking([0, 0, -1]), medium=water, pixels=1, samples=2**18, seed=(1,))
    height = DEPTH + below
    mu = (np.arange(200_000) + 0.5) / 200_000
    path = np.exp(-np.outer(ABSORPTION, height / mu))
    sky = np.outer(SKY, 0.5 + np.sqrt(np.maximum(1 - N_WATER**2 * (1 - mu**2), 0)))
    irradiance = SUN * TOWARDS_SUN[2] * np.exp(-ABSORPTION * height / TOWARDS_SUN[2])
    irradiance = irradiance + 2 * np.pi * (N_WATER**2 * sky * path * fresnel(mu) * mu).mean(axis=1)
    thrown_back = 2 * (path**2 * (1 - fresnel(mu)) * mu).mean(axis=1)
    expected = albedo / np.pi * irradiance / (1 - albedo * thrown_back) * np.exp(-ABSORPTION * below)
    error = np.sqrt(result.variance)
    assert (np.abs(result.mean - expected) < LARGEST_Z * error + HIT_TOLERANCE * expected).all(), (
        result.mean / expected,
        error,
    )
    assert (error < 0.01 * expected).all()


def test_even_sky_over_white_walls_fills_the_water_with_its_radiance_times_n_squared():
    """Energy: basic radiance L / n^2 is the same everywhere when nothing absorbs, whatever scatters and reflects."""
    sea = replace(
        clear(np.zeros(3), np.zeros(3), np.array([0.2, 0.3, 0.4])),
        sky_radiance=lambda cosine: np.outer(SKY, np.ones_like(cosine)),
    )
    water = water_medium(sea)
    # Walls reach beyond the floor and each other, so that nothing leaks where they meet; none stands above the surface.
    size, white = mi.ScalarTransform4f().scale([1.2, 1.2, 1]), diffuse(np.ones(3))
    upright = [
        mi.ScalarTransform4f().translate(place).rotate(axis, 90)
        for axis, places in (([0, 1, 0], ([1, 0, -0.2], [-1, 0, -0.2])), ([1, 0, 0], ([0, 1, -0.2], [0, -1, -0.2])))
        for place in places
    ]
    flat = mi.ScalarTransform4f()
    walls = [*upright, flat.translate([0, 0, -1])]
    pool = {
        f"wall_{at}": {"type": "rectangle", "to_world": wall @ size, "bsdf": white} for at, wall in enumerate(walls)
    }
    sheet = flat.translate([0, 0, 1]) @ size
    pool["surface"] = {"type": "rectangle", "to_world": sheet, "bsdf": SeaSurface(N_WATER), "interior": water}
    scene = mi.load_dict({"type": "scene", **lamps(sea), **pool})
    result = estimate(scene, looking([0.6, 0.0, -0.8]), medium=water, pixels=1, samples=2**17, seed=(5,))
    expected = N_WATER**2 * SKY
    error = np.sqrt(result.variance)
    assert (np.abs(result.mean - expected) < LARGEST_Z * error + HIT_TOLERANCE * expected).all(), (
        result.mean / expected,
        error,
    )
    assert (error < 0.005 * expected).all()


@pytest.mark.parametrize("from_zenith_deg", [20.0, 47.0, 60.0])
def test_looking_up_sees_the_sky_and_the_floor_by_fresnel(from_zenith_deg):
    """Inside Snell's window (48.3 degrees) sky and a weak image of the floor, outside the floor alone, undimmed."""
    sea = clear(sun=np.zeros(3))
    water = water_medium(sea)
    shining = np.array([0.7, 0.8, 0.9])
    lamp = floor(-1.0, 0.0) | {"emitter": {"type": "area", "radiance": {"type": "rawconstant", "value": list(shining)}}}
    scene = under_the_surface(sea, water, lamp=lamp)
    cosine, sine = np.cos(np.radians(from_zenith_deg)), np.sin(np.radians(from_zenith_deg))
    result = estimate(scene, looking([sine, 0, cosine]), medium=water, pixels=1, samples=2**16, seed=(3,))
    passed = fresnel(cosine)
    sky = N_WATER**2 * SKY * (0.5 + np.sqrt(np.maximum(1 - (N_WATER * sine) ** 2, 0)))
    up = np.exp(-ABSORPTION * DEPTH / cosine)
    down = np.exp(-ABSORPTION * (DEPTH + 1.0) / cosine)
    expected = up * (passed * sky + (1 - passed) * down * shining)
    error = np.sqrt(result.variance)
    # Rows of the sky's map are a quarter of a degree apart, and the sky's radiance bends near the window's edge.
    steps = 5e-3 if from_zenith_deg == 47.0 else HIT_TOLERANCE
    assert (np.abs(result.mean - expected) < LARGEST_Z * error + steps * expected).all(), (
        result.mean / expected,
        error,
    )
    assert (error < 0.02 * expected).all()
