"""What the end of a line hides from the water before it, against drawn directions and limits."""

import numpy as np
import pytest

from optics.kernels.backend import Float32
from scenes.light.forward_cone import forward_cone_table, hidden_share, hidden_shares, lengths_over_radius

ASYMMETRY = 0.9


def henyey_greenstein(angle):
    return (1 - ASYMMETRY**2) / (4 * np.pi * (1 + ASYMMETRY**2 - 2 * ASYMMETRY * np.cos(angle)) ** 1.5)


@pytest.fixture(scope="module")
def shares():
    return hidden_shares(henyey_greenstein)


@pytest.mark.parametrize("length", [1.0, 4.0, 16.0, 64.0])
def test_share_is_that_of_drawn_directions(shares, length):
    """A million scatterings at even chances along lines that end evenly on a disc, by Henyey and Greenstein's inverse.

    Expected: as many go to the disc, within 1 % and four standard errors.
    """
    rng = np.random.default_rng(1)
    count = 1_000_000
    distance = length * rng.random(count)
    chance = rng.random(count)
    g = ASYMMETRY
    cosine = (1 + g**2 - ((1 - g**2) / (1 - g + 2 * g * chance)) ** 2) / (2 * g)
    around, offset = 2 * np.pi * rng.random(count), np.sqrt(rng.random(count))
    reach = distance * np.sqrt(1 - cosine**2) / np.where(cosine > 0, cosine, np.inf)
    inside = (cosine > 0) & ((offset + reach * np.cos(around)) ** 2 + (reach * np.sin(around)) ** 2 < 1)
    expected = inside.mean()
    found = np.interp(length, lengths_over_radius(), shares)
    assert found == pytest.approx(expected, rel=0.01, abs=4 * np.sqrt(expected / count))


def test_limits(shares):
    """Close by, the disc is a half-space but for its rim, as wide as the line is long (a sixteenth of the radius).

    Far away only a fixed length before it counts, so the share falls as 1/r.
    """
    isotropic = hidden_shares(lambda angle: np.full_like(angle, 1 / (4 * np.pi)))
    assert isotropic[0] == pytest.approx(0.5, abs=1 / 16)
    assert shares[-1] * lengths_over_radius()[-1] == pytest.approx(shares[-9] * lengths_over_radius()[-9], rel=0.01)
    assert (np.diff(shares) < 0).all()


def test_kernel_reads_the_table_and_knows_no_disc_without_a_radius(shares):
    table = forward_cone_table(shares)
    node = 20
    length = float(lengths_over_radius()[node]) * 0.3
    found = hidden_share(table, Float32([length, length, 1e6]), Float32([0.3, 0.0, 0.1]))
    np.testing.assert_allclose(np.array(found), [shares[node], 0, shares[-1]], rtol=1e-4)
