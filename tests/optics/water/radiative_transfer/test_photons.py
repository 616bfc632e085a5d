"""Radiative transfer against photons that are followed one by one: another method, written on its own.

Rationale: discrete ordinates cut the forward peak off, put the sun's first scattering back in closed form and meet the
surface in a finite number of directions. Photons do none of this: they scatter by the whole phase function and are
refracted and reflected by Snell and Fresnel, in vectors.

Expected behaviour: irradiances and the light in boxes of directions agree within the photons' own standard error, which
comes from independent groups of them. Directions within 12 degrees of the sun are left out: there the light depends on
what the forward peak does, and the two differ by what `docs/explanation/radiative_transfer.md` states.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.stats import t as student

from optics.water.radiative_transfer.column import multiple_radiance, once_radiance, sky_radiance, solve_column
from optics.water.radiative_transfer.irradiance import irradiances
from optics.water.scattering import fournier_forand_phase

ABSORPTION, SCATTERING, N_WATER = 0.1, 0.4, 1.34
SUN_COSINE_AIR, SUN_IRRADIANCE, SKY = 0.8, 1.0, 0.08
LEVELS_M = np.array([0.5, 2.0, 6.0])
GROUPS, PHOTONS = 24, 15_000
EDGE = np.sqrt(1 - 1 / N_WATER**2)
COSINES = np.array([-1, -0.7, -0.4, -0.1, 0.1, 0.35, 0.55, EDGE, 0.72, 0.82, 0.9, 0.97, 1.0])
AZIMUTHS = np.radians([0, 40, 80, 130, 180])
FALSE_ALARM = 1e-3
"""Probability that all comparisons of a test together fail by chance; the seed is fixed."""


@dataclass
class Tally:
    """What crossed the levels: flux down and up, shape (groups, z), and flux by direction (groups, z, m, p)."""

    down: np.ndarray
    up: np.ndarray
    boxes: np.ndarray


def fresnel(cosine_in, n_before, n_behind):
    """Reflectance by sines and tangents of angles, another form than the package's."""
    inside = np.arccos(np.clip(cosine_in, 0, 1))
    sine = n_before / n_behind * np.sin(inside)
    outside = np.arcsin(np.minimum(sine, 1))
    with np.errstate(invalid="ignore", divide="ignore"):
        s = (np.sin(inside - outside) / np.sin(inside + outside)) ** 2
        p = (np.tan(inside - outside) / np.tan(inside + outside)) ** 2
    normal = ((n_before - n_behind) / (n_before + n_behind)) ** 2
    return np.where(sine >= 1, 1.0, np.where(inside < 1e-6, normal, (s + p) / 2))


def launch(rng, count):
    """Photons just below the surface; direction (n, 3) with z *down* and x away from the sun, weight in irradiance."""
    sun = SUN_IRRADIANCE * SUN_COSINE_AIR
    sky = np.pi * SKY
    is_sun = rng.random(count) < sun / (sun + sky)
    air = np.where(is_sun, SUN_COSINE_AIR, np.sqrt(rng.random(count)))
    azimuth = np.where(is_sun, 0.0, rng.random(count) * 2 * np.pi)
    sine = np.sqrt(1 - air**2) / N_WATER
    direction = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), np.sqrt(1 - sine**2)], axis=-1)
    return direction, (sun + sky) * (1 - fresnel(air, 1.0, N_WATER))


def scatter(rng, direction, quantile):
    """Turn directions by an angle of the phase function, about a random azimuth."""
    angle, azimuth = quantile(rng.random(len(direction))), rng.random(len(direction)) * 2 * np.pi
    helper = np.where(np.abs(direction[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    side = np.cross(helper, direction)
    side /= np.linalg.norm(side, axis=-1, keepdims=True)
    other = np.cross(direction, side)
    across = np.cos(azimuth)[:, None] * side + np.sin(azimuth)[:, None] * other
    turned = np.cos(angle)[:, None] * direction + np.sin(angle)[:, None] * across
    return turned / np.linalg.norm(turned, axis=-1, keepdims=True)


def count_crossings(tally, *, group, before, after, direction, weight):
    for level, depth in enumerate(LEVELS_M):
        crossed = (before < depth) != (after < depth)
        down = direction[crossed, 2] > 0
        flux = weight[crossed]
        for table, chosen in ((tally.down, down), (tally.up, ~down)):
            np.add.at(table, (group[crossed][chosen], level), flux[chosen])
        # Looked along, a photon's direction is turned over: up and towards the sun are positive again.
        looked, azimuth = direction[crossed, 2], np.arctan2(np.abs(direction[crossed, 1]), direction[crossed, 0])
        m = np.clip(np.searchsorted(COSINES, looked) - 1, 0, len(COSINES) - 2)
        p = np.clip(np.searchsorted(AZIMUTHS, azimuth) - 1, 0, len(AZIMUTHS) - 2)
        np.add.at(tally.boxes, (group[crossed], level, m, p), flux)


def follow(rng, phase):
    """Follow photons until they have left the water, are lost in the deep, or are absorbed (with Russian roulette)."""
    attenuation = ABSORPTION + SCATTERING
    angle = phase.angle_rad
    share = phase.fraction_within(angle)

    def quantile(u):
        return np.interp(u, share, angle)

    tally = Tally(
        np.zeros((GROUPS, 3)),
        np.zeros((GROUPS, 3)),
        np.zeros((GROUPS, 3, len(COSINES) - 1, len(AZIMUTHS) - 1)),
    )
    direction, weight = launch(rng, GROUPS * PHOTONS)
    group, depth = np.repeat(np.arange(GROUPS), PHOTONS), np.zeros(GROUPS * PHOTONS)
    while len(weight):
        end = depth + direction[:, 2] * rng.exponential(1 / attenuation, len(weight))
        meets = end < 0
        count_crossings(tally, group=group, before=depth, after=np.maximum(end, 0), direction=direction, weight=weight)
        reflected = rng.random(len(weight)) < fresnel(-direction[:, 2], N_WATER, 1.0)
        back = meets & reflected
        direction[back, 2] *= -1
        end[back] *= -1
        count_crossings(
            tally,
            group=group[back],
            before=np.zeros(back.sum()),
            after=end[back],
            direction=direction[back],
            weight=weight[back],
        )
        weight *= SCATTERING / attenuation
        survives = (weight > 0.1) | (rng.random(len(weight)) < 0.2)
        weight = np.where(weight > 0.1, weight, weight / 0.2)
        alive = ~(meets & ~reflected) & survives & (end < 40)
        direction, weight, group, depth = direction[alive], weight[alive], group[alive], end[alive]
        direction = scatter(rng, direction, quantile)
    return Tally(tally.down / PHOTONS, tally.up / PHOTONS, tally.boxes / PHOTONS)


@pytest.fixture(scope="module")
def phase():
    return fournier_forand_phase()


@pytest.fixture(scope="module")
def photons(phase):
    return follow(np.random.default_rng(20), phase)


@pytest.fixture(scope="module")
def column(phase):
    return solve_column(
        absorption=ABSORPTION,
        scattering=SCATTERING,
        moments=phase.moments(65),
        phase=phase,
        n_water=N_WATER,
        sun_cosine_air=SUN_COSINE_AIR,
        sun_irradiance=SUN_IRRADIANCE,
        sky_radiance=np.full(24, SKY),
    )


def assert_equal_within_error(groups, expected):
    """Student's t of every number, with the bar raised for how many there are (Bonferroni)."""
    error = groups.std(axis=0, ddof=1) / np.sqrt(GROUPS)
    deviation = np.abs(groups.mean(axis=0) - expected) / error
    bar = student.ppf(1 - FALSE_ALARM / (2 * expected.size), GROUPS - 1)
    assert (deviation < bar).all(), np.round(deviation, 1)
    if expected.size > 100:
        # Together: the mean square of Student's t with 23 degrees of freedom is 1.10, of so many numbers +- 0.14.
        assert (deviation**2).mean() < 1.5
    return error / expected


def test_irradiances_are_those_of_photons(photons, column):
    layers = irradiances(column.modes, column.scaled.attenuation * LEVELS_M)
    assert_equal_within_error(photons.down, layers.downwelling)
    error = assert_equal_within_error(photons.up, layers.upwelling)
    # The comparison would be worth nothing if the photons were too few.
    assert (error[:2] < 0.02).all()


def test_radiance_is_that_of_photons(photons, column):
    """Flux through boxes of directions, by 6 x 6 Gauss nodes per box."""
    nodes, weights = np.polynomial.legendre.leggauss(6)
    cosine = (COSINES[:-1, None] + np.diff(COSINES)[:, None] * (1 + nodes) / 2).ravel()
    azimuth = (AZIMUTHS[:-1, None] + np.diff(AZIMUTHS)[:, None] * (1 + nodes) / 2).ravel()
    total = (
        multiple_radiance(column, LEVELS_M, cosine, azimuth)
        + once_radiance(column, LEVELS_M, cosine, azimuth)
        + sky_radiance(column, lambda air: np.full_like(air, SKY), LEVELS_M, cosine)[..., None]
    )
    flux = (total * np.abs(cosine)[:, None]).reshape(3, len(COSINES) - 1, 6, len(AZIMUTHS) - 1, 6)
    solid_angle = np.outer(np.diff(COSINES), 2 * np.diff(AZIMUTHS)) / 4
    expected = np.einsum("zmipj,i,j,mp->zmp", flux, weights, weights, solid_angle)
    compared = np.ones(expected.shape[1:], dtype=bool)
    compared[COSINES[:-1] > 0.5, 0] = False  # the aureole
    compared[3, :] = False  # the horizon: few photons cross a level there
    error = assert_equal_within_error(photons.boxes[..., compared], expected[..., compared])
    assert np.median(error) < 0.03
