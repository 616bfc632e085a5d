"""Marine snow: sizes by the power law, and no seam when it wraps around a robot that moves on."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import kstest, truncpareto

from scenes.surfaces.surface import enclosed_volume_m3
from scenes.worlds.snow import FACES_PER_FLAKE, JUNGE_EXPONENT, MOST_FACES, MarineSnow, snow_offset_m, snow_surface

SNOW = MarineSnow(flakes_per_m3=40.0, seed=5)
SURFACE = snow_surface(SNOW)


def offset_m(robot_m, time_s):
    return snow_offset_m(SNOW, np.array([robot_m]), np.array([time_s]))[0]


def centres(surface):
    return surface.vertices_m.reshape(-1, 6, 3).mean(axis=1)


def in_sight(robot_m, time_s):
    """Centres of flakes in sight of the robot, in the world frame, in a fixed order."""
    found = centres(SURFACE) + offset_m(robot_m, time_s)
    found = found[np.linalg.norm(found - robot_m, axis=1) < SNOW.sight_m - 1e-6]
    return found[np.lexsort(np.round(found, 7).T)]


places = st.lists(st.floats(-50, 50), min_size=3, max_size=3).map(np.array)


@settings(max_examples=40)
@given(places, st.floats(0, 600))
def test_the_cloud_is_periodic_wherever_the_robot_goes(robot, time_s):
    """A whole period further there are the same flakes, and around the robot as many as were asked for."""
    here = in_sight(robot, time_s)
    further = in_sight(robot + SNOW.period_m * np.array([1, -2, 3]), time_s)
    moved = further - SNOW.period_m * np.array([1, -2, 3])
    moved = moved[np.lexsort(np.round(moved, 7).T)]
    assert abs(len(here) - len(moved)) <= 1  # a flake on the edge of sight, to rounding
    if len(here) == len(moved):
        np.testing.assert_allclose(moved, here, atol=1e-6)
    expected = SNOW.flakes_per_m3 * 4 / 3 * np.pi * SNOW.sight_m**3
    # 320 flakes repeat: what lies in the sphere varies as a binomial, 6 standard deviations.
    assert abs(len(here) - expected) < 6 * np.sqrt(expected)


def test_a_step_by_a_period_is_not_seen():
    """On both sides of where the offset jumps: the same flakes in sight."""
    offsets = [offset_m([SNOW.period_m / 2 + side, 0, 0], 0.0) for side in (-1e-9, 1e-9)]
    assert offsets[1][0] - offsets[0][0] == SNOW.period_m
    before, after = (in_sight(np.array([SNOW.period_m / 2 + side, 0, 0]), 0.0) for side in (-1e-9, 1e-9))
    np.testing.assert_allclose(after, before, atol=1e-7)


def test_flakes_drift_with_the_water_and_sink():
    """Within a quarter of a period no step is taken: every flake moves by velocity times time."""
    shift = offset_m([0, 0, 0], 4.0) - offset_m([0, 0, 0], 0.0)
    np.testing.assert_allclose(shift, [0.2, 0.0, -0.004], atol=1e-15)


def test_sizes_follow_junges_power_law():
    """Kolmogorov-Smirnov against SciPy's truncated Pareto; every flake's diameter is its longest axis."""
    surface = snow_surface(MarineSnow(flakes_per_m3=2000.0, period_m=1.0, sight_m=0.01))
    flakes = surface.vertices_m.reshape(-1, 6, 3)
    diameter = np.linalg.norm(flakes[:, 0] - flakes[:, 2], axis=1)
    law = truncpareto(JUNGE_EXPONENT - 1, c=6.0, scale=0.0005)
    assert kstest(diameter, law.cdf).pvalue > 0.01


def test_flakes_are_closed_and_few_enough():
    surface = snow_surface(MarineSnow())
    assert 100_000 < len(surface.faces) < MOST_FACES
    first = surface.faces[:FACES_PER_FLAKE]
    # An octahedron with semi-axes a, b, c holds 4/3 a b c.
    radius = np.linalg.norm(surface.vertices_m[0] - surface.vertices_m[2]) / 2
    assert enclosed_volume_m3(surface.vertices_m[:6], first) == pytest.approx(4 / 3 * 0.75 * 0.5 * radius**3, rel=1e-6)
    assert enclosed_volume_m3(surface.vertices_m, surface.faces) > 0


def test_same_seed_same_bytes():
    again, other = snow_surface(SNOW), snow_surface(MarineSnow(flakes_per_m3=40.0, seed=6))
    assert again.vertices_m.tobytes() == SURFACE.vertices_m.tobytes()
    assert other.vertices_m.tobytes() != SURFACE.vertices_m.tobytes()


def test_no_snow_is_no_faces():
    assert snow_surface(MarineSnow(flakes_per_m3=0.0)).faces.shape == (0, 3)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"flakes_per_m3": 1e4}, r"of at most 25000, got 1756160"),
        ({"flakes_per_m3": -1.0, "sight_m": 0.0}, r"sight_m > 0, got 0; expected flakes_per_m3 >= 0, got -1"),
        ({"smallest_m": 0.01}, r"expected 0 < smallest_m < largest_m < period_m, got 0.01, 0.003, 2"),
        ({"drift_m_per_s": (1.0, 2.0)}, r"expected drift_m_per_s to be three finite numbers"),
    ],
)
def test_wrong_numbers_are_refused(wrong, message):
    with pytest.raises(ValueError, match=message):
        MarineSnow(**wrong)
