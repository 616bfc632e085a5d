"""Noise as random numbers: distributions, seeds, and the expected value that noisy images have as their mean."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2, norm, poisson

from optics.kernels.backend import Bool, Float32, UInt32, UInt64, dr
from scenes.sensor import expose, frame_key, read_out
from scenes.sensor.noise import FEWEST_NORMAL_E, few_events, mean_below, noisy_signal

DRAWS = 400_000
Z = 5.0
"""Standard errors; the seeds are fixed."""


def draw(charge, read_noise=3.0, full_well=1e6, seed=0, draws=DRAWS):
    signal = noisy_signal(
        dr.full(Float32, charge, draws),
        read_noise_e=Float32(read_noise),
        full_well_e=Float32(full_well),
        key=UInt64(frame_key(seed, 0)),
        number=dr.arange(UInt32, draws),
    )
    return np.array(signal)


def events(mean, draws=DRAWS):
    even = np.random.default_rng(4).random(draws, dtype=np.float32)
    return np.array(few_events(dr.full(Float32, mean, draws), Float32(even), Bool(True)), dtype=np.int64)


@pytest.mark.parametrize("charge", [0.2, 5.0, 9.9, 10.0, 15.0, 40.0, 400.0])
def test_the_distribution_is_poisson_plus_normal(charge):
    """Kolmogorov-Smirnov: sampling leaves 1.95 / sqrt(n) (once in a thousand), the bent normal variable 1e-3."""
    at, exact = exact_distribution(charge, read_noise=3.0)
    ours = np.searchsorted(np.sort(draw(charge)), at) / DRAWS
    assert np.abs(ours - exact).max() < 1e-3 + 1.95 / np.sqrt(DRAWS)


def exact_distribution(charge, read_noise):
    """Poisson convolved with a normal distribution: values and their distribution function."""
    counts = np.arange(int(poisson.ppf(1 - 1e-12, charge)) + 2)
    sigma = np.sqrt(charge + read_noise**2)
    at = np.linspace(charge - 4 * sigma, charge + 5 * sigma, 300)
    return at, (poisson.pmf(counts, charge) * norm.cdf((at[:, None] - counts) / read_noise)).sum(axis=1)


@pytest.mark.parametrize("charge", [FEWEST_NORMAL_E, 20.0, 100.0])
def test_the_bent_normal_variable_is_within_a_thousandth(charge):
    """Its distribution function is a difference of two normal ones, at the roots of m + s z + c (z^2 - 1) = x."""
    at, exact = exact_distribution(charge, read_noise=3.0)
    variance = charge + 9.0
    c = charge / (6 * variance)
    s = np.sqrt(variance - 2 * c**2)
    root = np.sqrt(np.maximum(s**2 - 4 * c * (charge - c - at), 0))
    bent = norm.cdf((-s + root) / (2 * c)) - norm.cdf((-s - root) / (2 * c))
    assert np.abs(bent - exact).max() < 1e-3  # as the threshold's docstring says
    assert np.abs(norm.cdf((at - charge) / np.sqrt(variance)) - exact).max() > 3e-3  # plain normal: worse


@pytest.mark.parametrize("charge", [12.0, 50.0])
def test_the_skewness_is_the_photons(charge):
    """Third moment of the sum: the Poisson distribution's, which is its mean; the formula leaves out 4 c^3 of it."""
    signal = draw(charge).astype(np.float64) - charge
    variance = charge + 9
    # Variance of a third moment of a nearly normal variable: 15 - 9 = 6 after the mean's own part is counted.
    error = np.sqrt(15 * variance**3 / DRAWS)
    assert abs((signal**3).mean() - charge) < Z * error + 4 * (charge / (6 * variance)) ** 3
    assert charge > Z * error  # else a normal variable would do as well


@pytest.mark.parametrize("mean", [1e-3, 0.3, 2.0, 9.99])
def test_few_events_are_poisson(mean):
    """Chi-square over the counts, those of fewer than 10 expected draws taken together; once in a million seeds."""
    drawn = events(mean)
    last = int(poisson.isf(10 / DRAWS, mean))
    expected = DRAWS * np.append(poisson.pmf(np.arange(last), mean), poisson.sf(last - 1, mean))
    seen = np.bincount(np.minimum(drawn, last), minlength=last + 1)
    assert ((seen - expected) ** 2 / expected).sum() < chi2.isf(1e-6, last)


def test_no_light_makes_no_events():
    assert (events(0.0, draws=1000) == 0).all()


def test_the_variance_is_the_photons():
    """Where the bend is strongest, without read noise: it would add 2 c^2 = 1/18 if the spread made no room for it."""
    charge, draws = FEWEST_NORMAL_E, 4_000_000
    signal = draw(charge, read_noise=0.0, full_well=1e9, draws=draws)
    error = charge * np.sqrt(2 / draws)
    assert abs(signal.var(dtype=np.float64) - charge) < Z * error
    assert Z * error < 1 / 18


def test_a_frame_is_the_same_whatever_came_before(make_sensor, make_settings, flat_field):
    sensor, settings = make_sensor(), make_settings()
    radiance = flat_field(sensor, 200.0)
    in_a_row = [expose(radiance, sensor, settings, frame_key(5, k)).digital_numbers for k in range(4)]
    alone = expose(radiance, sensor, settings, frame_key(5, 3)).digital_numbers
    assert (alone == in_a_row[3]).all()
    assert (in_a_row[2] != in_a_row[3]).mean() > 0.9
    other_seed = expose(radiance, sensor, settings, frame_key(6, 3)).digital_numbers
    assert (other_seed != alone).mean() > 0.9


@pytest.mark.parametrize("bayer", ["rggb", "none"])
def test_a_pixel_reads_the_same_whichever_others_are_exposed(make_sensor, make_settings, bayer):
    """Few electrons, many, and a full well, in one image; of a few pixels and of all."""
    sensor, settings, key = make_sensor(bayer=bayer), make_settings(), frame_key(7, 1)
    count = sensor.height_px * sensor.width_px
    radiance = np.geomspace(1e-5, 1.0, count).astype(np.float32)
    whole = read_out([[Float32(radiance)] * 3], sensor, settings, key).digital_numbers.reshape(count, -1)
    assert np.unique(whole).size > 1000
    pixels = np.random.default_rng(0).permutation(count)[:5000]
    some = read_out([[Float32(radiance[pixels])] * 3], sensor, settings, key, pixels).digital_numbers.reshape(count, -1)
    assert np.array_equal(some[pixels], whole[pixels])
    assert not np.delete(some, pixels, axis=0).any()


def test_sweeps_are_averaged_and_below_zero_is_dark(make_sensor, make_settings):
    sensor, settings = make_sensor(), make_settings()
    light = [0.0, 0.02, -0.01, 0.01]
    sweeps = [[dr.full(Float32, level, sensor.height_px * sensor.width_px)] * 3 for level in light]
    mean = [[dr.full(Float32, 0.0075, sensor.height_px * sensor.width_px)] * 3]
    found, expected = (read_out(each, sensor, settings, 1).digital_numbers.astype(int) for each in (sweeps, mean))
    assert np.abs(found - expected).max() <= 1


def test_radiance_that_is_no_number_is_told(make_sensor, make_settings):
    sensor = make_sensor()
    radiance = np.full(sensor.height_px * sensor.width_px, 0.01, dtype=np.float32)
    radiance[77] = np.nan
    with pytest.raises(ValueError, match="expected radiance that is a number everywhere"):
        read_out([[Float32(radiance)] * 3], sensor, make_settings(), 1)


@pytest.mark.parametrize(
    ("charge", "numbers"),
    [
        pytest.param(1.5, {}, id="few photons"),
        pytest.param(800.0, {}, id="many"),
        pytest.param(0.0, {"black_level_dn": 1}, id="cut at zero"),
        pytest.param(8860.0, {}, id="cut by the converter"),
        pytest.param(2990.0, {"full_well_e": 3000.0}, id="cut by the well"),
        pytest.param(50_000.0, {"full_well_e": 3000.0}, id="full well"),
    ],
)
def test_the_expected_image_is_the_mean_of_noisy_ones(make_sensor, make_settings, flat_field, charge, numbers):
    """z-test per pixel over 64 images (largest of 19,200 and mean), and one over all pixels.

    Before rounding: with at least 1.3 DN of noise, rounding shifts a mean by less than exp(-2 pi^2 1.3^2) / pi; where
    a cut goes through the distribution, by a few thousandths.
    """
    sensor = make_sensor(prnu=0.005, dsnu_e=1.0, **numbers)
    radiance, settings, count = flat_field(sensor, charge), make_settings(), 64
    expected = expose(radiance, sensor, settings).digital_numbers.astype(np.float64)
    stack = np.stack(
        [expose(radiance, sensor, settings, frame_key(2, k)).digital_numbers for k in range(count)]
    ).astype(np.float64)
    error = np.sqrt(stack.var(axis=0, ddof=1).mean() / count)
    difference = stack.mean(axis=0) - expected
    assert abs(difference.mean()) < Z * error / np.sqrt(difference.size) + ROUNDED_AT_A_CUT_DN
    if charge < 8000 and not numbers:  # at a cut, the pixels' errors differ by the pattern
        assert np.abs(difference).max() < 6 * error
        assert difference.std() == pytest.approx(error, rel=0.05)


ROUNDED_AT_A_CUT_DN = 0.125 * norm.pdf(0) / 1.3 + 1e-3
"""Between the last half number and the end, rounding adds the integral of t from 0 to 1/2, times the density there."""


def test_well_and_converter_at_their_ends_together(make_sensor, make_settings, flat_field):
    """Both cuts at once: at the same charge, and with a converter that ends just before or after the well."""
    for well in (8850.0, 8866.0, 8880.0):
        sensor = make_sensor(full_well_e=well)
        for charge in (8700.0, 8800.0, 8866.0, 8900.0):
            radiance, settings = flat_field(sensor, charge), make_settings()
            expected = expose(radiance, sensor, settings).digital_numbers.mean(dtype=np.float64)
            noisy = [expose(radiance, sensor, settings, frame_key(3, k)).digital_numbers for k in range(16)]
            error = np.std(noisy) / np.sqrt(np.size(noisy))
            assert abs(np.mean(noisy) - expected) < Z * error + ROUNDED_AT_A_CUT_DN


@given(st.floats(-5, 5), st.floats(0.1, 20))
def test_mean_of_a_cut_normal_variable(ceiling_in_sigmas, sigma):
    """Against a sum over the density on a fine grid."""
    x = np.linspace(-9, 9, 20_001)
    density = norm.pdf(x) * (x[1] - x[0])
    expected = (density * np.minimum(x, ceiling_in_sigmas) * sigma).sum()
    mean = mean_below(np.zeros(1, np.float32), np.full(1, sigma**2, np.float32), ceiling_in_sigmas * sigma)
    # float32 of numbers of the size of the ceiling.
    assert mean[0] == pytest.approx(expected, abs=2e-6 * sigma)


def test_nothing_is_cut_far_from_the_ceiling():
    mean = np.array([10.0, 100.0], dtype=np.float32)
    assert (mean_below(mean, np.full(2, 4.0, np.float32), 200.0) == mean).all()
