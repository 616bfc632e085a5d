"""Water as a medium of the reference renderer: its phase function, a white furnace, and light scattered once."""

import numpy as np
import pytest

from optics.kernels.backend import dr, mi
from optics.water.pure_water import molecular_phase
from optics.water.scattering import fournier_forand, fournier_forand_backscattered_fraction
from scenes.reference import estimate as estimating
from scenes.reference.estimate import estimate
from scenes.reference.medium import SMALLEST_SCATTERING_ANGLE, WaterPhase, scattering_table, water_medium
from scenes.reference.scene import basin
from scenes.reference.sea import Sea
from scenes.reference.surface import SeaSurface, lamps

LARGEST_Z = 4.0
"""Of some 40 comparisons in these tests none should lie outside of this (1 in 16 000 does)."""

FRACTIONS = np.array([0.1, 0.5, 0.9])

TABLE_TOLERANCE = 2e-3
"""Bins of the table: 300 of them share the 2 % that are scattered backwards."""


def along(origin, direction):
    """Rays that are all the same."""
    return lambda pixel, sampler: mi.RayDifferential3f(mi.Point3f(origin), mi.Vector3f(direction))


def z_scores(result, expected):
    return (result.mean - expected) / np.sqrt(result.variance)


def sea(**changes):
    numbers = {
        "absorption": np.zeros(3),
        "scattering": np.zeros(3),
        "molecular_fraction": FRACTIONS,
        "phase": fournier_forand,
        "n_water": np.full(3, 1.34),
        "towards_sun": np.array([0.0, 0.6, 0.8]),
        "sun_irradiance": np.zeros(3),
        "sky_radiance": lambda cosine: np.zeros((3, len(cosine))),
    }
    return Sea(**(numbers | changes))


@pytest.fixture(scope="module")
def tables():
    return scattering_table(fournier_forand, SMALLEST_SCATTERING_ANGLE), scattering_table(molecular_phase, 1e-5)


def interaction(direction, count):
    found = dr.zeros(mi.MediumInteraction3f, count)
    found.wi = -mi.Vector3f(direction)
    found.sh_frame = mi.Frame3f(found.wi)
    return found


def test_table_keeps_the_backscattered_fraction(tables):
    """Mobley, Sundman & Boss 2002, eq. 7, against the bins above 90 degrees and what was left out in front."""
    particles, _ = tables
    bins_behind = (particles.edges > 1).sum() / (len(particles.edges) - 1)
    # Half a bin at the edge.
    assert bins_behind * (1 - particles.left_out) == pytest.approx(
        fournier_forand_backscattered_fraction(), abs=1.0 / len(particles.edges)
    )


def test_phase_function_is_the_mixture_at_each_wavelength(tables):
    """Rationale: value and density feed the light's estimate; every wavelength has its own share of molecules."""
    phase = WaterPhase(*tables, FRACTIONS)
    angle = np.radians([0.6, 1.0, 3.0, 10.0, 45.0, 90.0, 120.0, 175.0])
    incoming = np.array([0.6, 0.0, 0.8])
    outgoing = np.outer(np.cos(angle), incoming) + np.outer(np.sin(angle), [0.8, 0.0, -0.6])
    ctx = mi.PhaseFunctionContext()
    value, _ = phase.eval_pdf(ctx, interaction(incoming, len(angle)), mi.Vector3f(outgoing.T), True)
    particles, _ = tables
    clipped = fournier_forand(angle) / (1 - particles.left_out)
    expected = (1 - FRACTIONS[:, None]) * clipped + FRACTIONS[:, None] * molecular_phase(angle)
    np.testing.assert_allclose(np.array(value), expected, rtol=TABLE_TOLERANCE)


def test_samples_are_spread_as_the_phase_function_says(tables):
    """Means of 1, cos and cos^2 under the weights, for each wavelength, against a quadrature of the formula."""
    phase = WaterPhase(*tables, FRACTIONS)
    count = 2**18
    random = mi.load_dict({"type": "independent"})
    random.seed(3, count)
    incoming = np.array([0.6, 0.0, 0.8])
    direction, weight, density = phase.sample(
        mi.PhaseFunctionContext(), interaction(incoming, count), random.next_1d(), random.next_2d(), True
    )
    cosine = np.array(dr.dot(direction, mi.Vector3f(incoming)))
    particles, _ = tables
    spread = {
        lambda x: fournier_forand(x) / (1 - particles.left_out): SMALLEST_SCATTERING_ANGLE,
        molecular_phase: 1e-5,
    }
    for power in range(3):
        seen = np.array(weight) * cosine**power
        expected = [
            np.trapezoid(2 * np.pi * np.sin(x) * np.cos(x) ** power * density_of(x), x)
            for density_of, x in ((p, np.geomspace(first, np.pi, 200_001)) for p, first in spread.items())
        ]
        mixed = (1 - FRACTIONS) * expected[0] + FRACTIONS * expected[1]
        error = seen.std(axis=1) / np.sqrt(count)
        # Where the sampled mixture is the wavelength's own, weights do not spread: single precision is left.
        assert (np.abs(seen.mean(axis=1) - mixed) < LARGEST_Z * error + 1e-5).all(), (power, seen.mean(axis=1), mixed)
    value, again = phase.eval_pdf(mi.PhaseFunctionContext(), interaction(incoming, count), direction, True)
    # Single precision puts a few samples into the neighbouring bin.
    close = np.isclose(np.array(again), np.array(density), rtol=0.02)
    assert close.mean() > 0.999
    assert np.isfinite(np.array(value)).all()


def test_white_furnace():
    """Walls of albedo 0.5 that shine with 0.5, and water that only scatters: radiance is 1 whatever happens inside.

    L = Le + albedo L everywhere; scattering keeps an even radiance as it is.
    """
    water = water_medium(sea(scattering=np.array([0.3, 0.5, 0.8])))
    furnace = mi.load_dict(
        {
            "type": "scene",
            "box": {
                "type": "cube",
                "flip_normals": True,
                "bsdf": {"type": "diffuse", "reflectance": {"type": "rawconstant", "value": [0.5, 0.5, 0.5]}},
                "emitter": {"type": "area", "radiance": {"type": "rawconstant", "value": [0.5, 0.5, 0.5]}},
                "exterior": water,
            },
        }
    )
    result = estimate(
        furnace, along([0.1, 0.2, 0.0], [0.6, 0.0, 0.8]), medium=water, pixels=1, samples=2**16, seed=(1,)
    )
    assert (np.abs(z_scores(result, 1.0)) < LARGEST_Z).all()
    assert (np.sqrt(result.variance) < 0.01).all()


def test_light_scattered_once(monkeypatch):
    """Looking level into thin water lit by the sun: b p E exp(-c z / mu) / c, from single-scattering theory.

    Mitsuba is told to stop after one scattering, so that the closed form is exact.
    """
    monkeypatch.setattr(estimating, "integrator", lambda: mi.load_dict({"type": "volpathmis", "max_depth": 2}))
    absorption, scattering, irradiance = (
        np.array([0.3, 0.2, 0.1]),
        np.array([0.02, 0.05, 0.1]),
        np.array([1.0, 2.0, 3.0]),
    )
    water_of = sea(
        absorption=absorption, scattering=scattering, molecular_fraction=np.ones(3), sun_irradiance=irradiance
    )
    water = water_medium(water_of)
    depth, mu = 2.0, 0.8
    scene = mi.load_dict({"type": "scene", **lamps(water_of), **basin(depth, SeaSurface(1.34), water)})
    result = estimate(scene, along([0, 0, 0], [0, 1, 0]), medium=water, pixels=1, samples=2**17, seed=(2,))
    attenuation = absorption + scattering
    angle = np.arccos(0.6)
    expected = scattering * molecular_phase(angle) * irradiance * np.exp(-attenuation * depth / mu) / attenuation
    assert (np.abs(z_scores(result, expected)) < LARGEST_Z).all(), (result.mean, expected)
    assert (np.sqrt(result.variance) < 0.02 * expected).all()


@pytest.mark.parametrize("angle_deg", [0.6, 2.0, 10.0])
def test_light_around_the_sun(monkeypatch, angle_deg):
    """Looking up beside the sun: the forward peak, where a wrong table or a wrong connection to the sun would show.

    Single scattering: b p(angle) E times the integral of what is lost on the way down to the line of sight and on it.
    """
    monkeypatch.setattr(estimating, "integrator", lambda: mi.load_dict({"type": "volpathmis", "max_depth": 2}))
    scattering, depth, sun = np.array([0.1, 0.2, 0.3]), 3.0, np.radians(20.0)
    water_of = sea(
        absorption=np.full(3, 0.1),
        scattering=scattering,
        molecular_fraction=np.zeros(3),
        sun_irradiance=np.ones(3),
        towards_sun=np.array([0.0, np.sin(sun), np.cos(sun)]),
    )
    water = water_medium(water_of)
    scene = mi.load_dict({"type": "scene", **lamps(water_of), **basin(depth, SeaSurface(1.34), water)})
    angle = np.radians(angle_deg)
    upwards = float(np.cos(sun + angle))
    rays = along([0, 0, 0], [0, float(np.sin(sun + angle)), upwards])
    result = estimate(scene, rays, medium=water, pixels=1, samples=2**16, seed=(7,))
    left_out = scattering_table(fournier_forand, SMALLEST_SCATTERING_ANGLE).left_out
    attenuation = 0.1 + scattering * (1 - left_out)
    along_sight = np.linspace(0, depth / upwards, 20_001)
    way = along_sight + (depth - along_sight * upwards) / np.cos(sun)
    lost = np.trapezoid(np.exp(-np.outer(attenuation, way)), along_sight)
    expected = scattering * fournier_forand(angle) * lost
    tolerance = LARGEST_Z * np.sqrt(result.variance) + TABLE_TOLERANCE * expected
    assert (np.abs(result.mean - expected) < tolerance).all(), (result.mean / expected, tolerance / expected)
    assert (np.sqrt(result.variance) < 0.02 * expected).all()
