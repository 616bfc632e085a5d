import numpy as np
import pytest

from scenes.baking.light_quality import LightQuality

NAMES = ["full", "draft", "coarse"]


def a_quality(name):
    return getattr(LightQuality, name)()


@pytest.fixture
def areas():
    """Of as many places as a robot has, mm2: they reach from a chamfer to the middle of a hull."""
    return np.random.default_rng(1).lognormal(mean=1.5, sigma=2.0, size=25_000)


@pytest.mark.parametrize("name", NAMES)
def test_larger_places_look_in_more_directions(name, areas):
    quality = a_quality(name)
    directions = quality.directions(np.sort(areas))
    assert (np.diff(directions) >= 0).all()
    assert directions[0] == quality.fewest_directions
    assert directions[-1] >= 4 * directions[0]


def test_places_of_one_size_look_in_as_many_directions():
    quality = LightQuality.full()
    (directions,) = np.unique(quality.directions(np.full(10_000, 7.0)))
    assert quality.rays / 1e4 / np.sqrt(2) <= directions <= quality.rays / 1e4 * np.sqrt(2)


@pytest.mark.parametrize("times", [1, 10])
def test_rays_are_shared_among_all_places_which_look_in_the_fewest_directions_at_least(areas, times):
    quality = LightQuality.full()
    directions = quality.directions(np.tile(areas, times))
    assert quality.rays < directions.sum() < 1.2 * (quality.rays + quality.fewest_directions * len(directions))


def test_light_has_less_noise_than_from_as_many_directions_for_each_place(areas):
    """Noise of places whose variance falls with their directions to the power of 3/2: of their sum, and of points."""

    def noise(directions):
        variance = directions**-1.5
        return np.sqrt([(areas**2 * variance).sum(), (areas * variance).sum()])

    directions = LightQuality.full().directions(areas)
    of_sum, of_points = noise(directions) / noise(directions.mean())
    assert of_sum < 1 / 4
    assert of_points < 1 / 1.5
