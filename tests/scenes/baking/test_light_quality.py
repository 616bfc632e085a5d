import numpy as np
import pytest

from scenes.baking.light_quality import LightQuality

NAMES = ["full", "draft", "coarse"]


def a_quality(name):
    return getattr(LightQuality, name)()


@pytest.fixture
def areas():
    """Of 5000 places, mm2: on a robot they reach from a chamfer to the middle of a hull."""
    return np.random.default_rng(1).lognormal(mean=1.5, sigma=2.0, size=5000)


@pytest.mark.parametrize("name", NAMES)
def test_larger_places_look_in_more_directions(name, areas):
    quality = a_quality(name)
    directions = quality.directions(np.sort(areas))
    assert (np.diff(directions) >= 0).all()
    assert directions[0] == quality.fewest_directions
    assert directions[-1] > 4 * directions[0]


def test_places_of_one_size_look_in_about_the_mean_number():
    quality = LightQuality.full()
    (directions,) = np.unique(quality.directions(np.full(1000, 7.0)))
    assert quality.mean_directions / np.sqrt(2) <= directions <= quality.mean_directions * np.sqrt(2)


def test_rays_are_shared_among_places_that_are_many(areas):
    quality = LightQuality.full()
    few, many = (quality.directions(np.tile(areas, times)) for times in (1, 50))
    assert few.sum() == pytest.approx(quality.mean_directions * len(few), rel=0.2)
    # All of them look in the fewest at least.
    assert many.sum() < 1.2 * (quality.rays + quality.fewest_directions * len(many))
    assert many.sum() >= quality.rays


def test_light_has_less_noise_than_from_as_many_directions_for_each_place(areas):
    """Noise of places whose variance falls with their directions to the power of 3/2: of their sum, and of points."""

    def noise(directions):
        variance = directions**-1.5
        return np.sqrt([(areas**2 * variance).sum(), (areas * variance).sum()])

    directions = LightQuality.full().directions(areas)
    of_sum, of_points = noise(directions) / noise(directions.mean())
    assert of_sum < 1 / 4
    assert of_points < 1 / 1.5
