"""The sphere's cells: HEALPix's own numbers, areas, symmetry, and round trips."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from optics.coverage.sphere import cell_count, cell_directions, cell_solid_angle_sr, cells_of

ROUNDING = 1e-15
"""Unit vectors in float64: a few units in the last place."""


def towards(colatitude: NDArray[np.float64], longitude: NDArray[np.float64]) -> NDArray[np.float64]:
    sine = np.sin(colatitude)
    return np.stack([sine * np.cos(longitude), sine * np.sin(longitude), np.cos(colatitude)], axis=-1)


def test_numbers_are_those_of_healpy() -> None:
    # The example in the documentation of healpy.pixelfunc.ang2pix (healpy 1.18).
    colatitude = np.array([np.pi / 2, np.pi / 4, np.pi / 2, 0, np.pi])
    longitude = np.array([0.0, np.pi / 4, np.pi / 2, 0, 0])
    assert cells_of(towards(colatitude, longitude), 16).tolist() == [1440, 427, 1520, 0, 3068]


def test_centres_are_those_of_healpy() -> None:
    # The example in the documentation of healpy.pixelfunc.pix2ang (healpy 1.18), printed to 8 decimals.
    x, y, z = cell_directions(16)[[1440, 427, 1520, 0, 3068]].T
    colatitude = [1.52911759, 0.78550497, 1.57079633, 0.05103658, 3.09055608]
    longitude = [0.0, 0.78539816, 1.61988371, 0.78539816, 0.78539816]
    np.testing.assert_allclose(np.arccos(z), colatitude, atol=6e-9)
    np.testing.assert_allclose(np.arctan2(y, x), longitude, atol=6e-9)


@pytest.mark.parametrize("nside", [1, 2, 8, 64, 256])
def test_rings_are_those_of_the_paper(nside: int) -> None:
    """Gorski et al. 2005, eqs. 4-9: 4 nside - 1 rings, of 4 i cells in the caps and 4 nside in the belt."""
    z = cell_directions(nside)[:, 2]
    heights, lengths = np.unique(np.round(z, 12), return_counts=True)
    assert len(heights) == 4 * nside - 1
    i = np.arange(1, nside)
    belt = 4 / 3 - 2 * np.arange(nside, 3 * nside + 1) / (3 * nside)
    expected = np.concatenate([i**2 / (3 * nside**2) - 1, belt[::-1], (1 - i**2 / (3 * nside**2))[::-1]])
    np.testing.assert_allclose(heights, expected, atol=2e-12)
    assert lengths.tolist() == [*(4 * i), *[4 * nside] * (2 * nside + 1), *(4 * i[::-1])]
    assert (np.diff(z) < ROUNDING).all()


@pytest.mark.parametrize("nside", [1, 2, 4, 32, 128, 512])
def test_each_centre_lies_in_its_cell(nside: int) -> None:
    directions = cell_directions(nside)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, atol=ROUNDING)
    np.testing.assert_array_equal(cells_of(directions, nside), np.arange(cell_count(nside)))


@pytest.mark.parametrize("nside", [1, 4, 8])
def test_cells_have_equal_areas(nside: int) -> None:
    """Monte Carlo: chi-square of uniform directions over the cells."""
    directions = np.random.default_rng(5).normal(size=(1_000_000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    counts = np.bincount(cells_of(directions, nside), minlength=cell_count(nside))
    expected = len(directions) / cell_count(nside)
    chi_square, freedom = ((counts - expected) ** 2 / expected).sum(), cell_count(nside) - 1
    # Five standard deviations: an honest sphere fails once in a million.
    assert abs(chi_square - freedom) < 5 * np.sqrt(2 * freedom)
    assert cell_solid_angle_sr(nside) * cell_count(nside) == pytest.approx(4 * np.pi)


@given(st.integers(0, 10), st.floats(-1, 1), st.floats(-np.pi, np.pi))
def test_every_direction_is_near_the_centre_of_its_cell(order: int, z: float, azimuth: float) -> None:
    nside = 2**order
    direction = towards(np.array([np.arccos(z)]), np.array([azimuth]))
    cell = cells_of(direction, nside)[0]
    assert 0 <= cell < cell_count(nside)
    if nside <= 64:
        angle = np.arccos(np.clip(direction[0] @ cell_directions(nside)[cell], -1, 1))
        # The farthest corner of any cell is 0.841 rad off at nside 1 (healpy.max_pixrad), 1.07 / nside at the finest.
        assert angle <= 1.08 / nside


@pytest.mark.parametrize("nside", [4, 32])
def test_a_quarter_turn_moves_every_ring_by_a_quarter(nside: int) -> None:
    directions = cell_directions(nside)
    turned = cells_of(directions @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1.0]]), nside)
    np.testing.assert_allclose(directions[turned, 2], directions[:, 2], atol=ROUNDING)
    assert len(np.unique(turned)) == cell_count(nside)
    assert (turned != np.arange(cell_count(nside))).all()


def test_a_cap_is_counted_without_bias_and_to_the_order_of_three_halves() -> None:
    """The rule by which coverage counts cells: a cell is seen when its centre is.

    Rationale: at the rim as many cells are counted too much as too little, and whether one is, is chance: with l / h of
    them, each of area h^2, the error is about sqrt(l / h) h^2. Counting every cell that is touched is of first order.
    Expected: over 400 caps of 60 degrees in random places the mean error is nothing within four standard errors, and
    its rms falls with the order 3/2; exact area (1 - cos 60) / 2.
    """
    axes = np.random.default_rng(2).normal(size=(400, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    sizes, rms = (8, 16, 32, 64), []
    for nside in sizes:
        errors = (cell_directions(nside) @ axes.T > 0.5).mean(axis=0) - 0.25
        rms.append(np.sqrt((errors**2).mean()))
        assert abs(errors.mean()) < 4 * rms[-1] / np.sqrt(len(axes))
    print(rms, np.log2(np.divide(rms[:-1], rms[1:])))
    # Each rms of 400 is known to 1 / sqrt(800), 0.05 in the logarithm, and the fitted slope to 0.023.
    assert -np.polyfit(np.log2(sizes), np.log2(rms), 1)[0] == pytest.approx(1.5, abs=0.08)


@pytest.mark.parametrize("nside", [-1, 0, 3, 100, 2048])
def test_other_sizes_are_refused(nside: int) -> None:
    with pytest.raises(ValueError, match=f"nside to be a power of two from 1 to 1024, got {nside}"):
        cells_of([[0.0, 0.0, 1.0]], nside)


def test_no_directions_have_no_cells() -> None:
    assert cells_of(np.empty((0, 3)), 4).shape == (0,)
    with pytest.raises(ValueError, match=r"directions of shape \(n, 3\), got \(3,\)"):
        cells_of([0.0, 0.0, 1.0], 4)
