"""The sensor on the bench: what EMVA 1288 measures on flat fields gives back the numbers it was made of.

Release 4.0 (linear): photon transfer from pairs of images, system gain K, temporal dark noise, saturation, SNR,
linearity, DSNU and PRNU. Every tolerance is a number of standard errors of the estimate at hand.
"""

from __future__ import annotations

import numpy as np
import pytest

from scenes.sensor import expose, frame_key

Z = 5.0
"""Standard errors that an estimate may be off: by chance once in 2 million seeds, and the seeds are fixed."""

QUANTISATION_DN2 = 1 / 12
"""Variance of rounding to whole numbers (EMVA 1288: sigma_q^2 = 1/12 DN^2)."""

EXPOSURE_S = 0.005


def image(sensor, radiance, settings, frame):
    return expose(radiance, sensor, settings, frame_key(11, frame)).digital_numbers.astype(np.float64)


def pair(sensor, radiance, settings, first):
    """Mean and temporal variance of two images of one scene (EMVA 1288 R4 Linear, section on mean and variance)."""
    a, b = (image(sensor, radiance, settings, frame) for frame in (first, first + 1))
    return (a.mean() + b.mean()) / 2, ((a - b).var()) / 2


def variance_error(variance, pixels):
    """Standard error of a variance from a pair of images: var of a normal variable's sample variance."""
    return variance * np.sqrt(2 / pixels)


@pytest.mark.parametrize("gain_db", [0.0, 12.0])
def test_photon_transfer_gives_the_system_gain_and_the_read_noise(make_sensor, make_settings, flat_field, gain_db):
    """sigma_y^2 = K (mu_y - mu_dark) + K^2 sigma_d^2 + sigma_q^2: the slope is K, darkness leaves the read noise."""
    sensor = make_sensor(dark_current_e_per_s=0.0, read_noise_e=4.0)
    settings = make_settings(gain_db=gain_db)
    gain = 1 / sensor.electrons_per_dn(gain_db)
    saturation_e = (sensor.largest_dn - sensor.spec.black_level_dn) / gain
    charges = np.concatenate([[0.0], np.linspace(0.002, 0.7, 24) * saturation_e])
    points = [pair(sensor, flat_field(sensor, q), settings, 2 * i) for i, q in enumerate(charges)]
    mean, variance = np.array(points).T
    error = variance_error(variance, 120 * 160)
    fit, covariance = np.polyfit(mean - mean[0], variance, 1, w=1 / error, cov="unscaled")
    assert abs(fit[0] - gain) < Z * np.sqrt(covariance[0, 0])
    assert np.sqrt(covariance[0, 0]) / gain < 0.005  # the measurement is worth something
    dark_variance = gain**2 * 4.0**2 + QUANTISATION_DN2
    assert abs(fit[1] - dark_variance) < Z * np.sqrt(covariance[1, 1])
    assert abs(variance[0] - dark_variance) < Z * error[0]


def test_linearity(make_sensor, make_settings, flat_field):
    """mu_y = mu_dark + K eta mu_p over the whole range, each point within its own error."""
    sensor = make_sensor(dark_current_e_per_s=0.0)
    gain = 1 / sensor.electrons_per_dn(0.0)
    for i, charge in enumerate(np.linspace(0, 8000, 17)):
        seen = image(sensor, flat_field(sensor, charge), make_settings(), i)
        expected = sensor.spec.black_level_dn + gain * charge
        assert abs(seen.mean() - expected) < Z * seen.std() / np.sqrt(seen.size)


@pytest.mark.parametrize("charge", [0.5, 3.0, 9.9, 10.1, 30.0, 100.0, 1000.0, 6000.0])
def test_signal_to_noise_is_the_models(make_sensor, make_settings, flat_field, charge):
    """SNR = mu_e / sqrt(sigma_d^2 + sigma_q^2 / K^2 + mu_e), on both sides of where Poisson gives way to normal."""
    sensor = make_sensor(dark_current_e_per_s=0.0, gain_e_per_dn=1.0, full_well_e=20000.0, bits=14)
    mean, variance = pair(sensor, flat_field(sensor, charge), make_settings(), 7)
    pixels = 2 * 120 * 160
    snr = (mean - sensor.spec.black_level_dn) / np.sqrt(variance)
    model = charge / np.sqrt(3.0**2 + QUANTISATION_DN2 + charge)
    # Of the mean, and of the standard deviation (with the small kurtosis of few photons).
    relative = np.hypot(1 / (model * np.sqrt(pixels)), np.sqrt(1 / pixels))
    assert abs(snr / model - 1) < Z * relative


def test_the_well_saturates(make_sensor, make_settings, flat_field):
    """Saturation capacity: with a converter that reaches further, the brightest charge is the full well's."""
    sensor = make_sensor(full_well_e=3000.0, gain_e_per_dn=1.0, read_noise_e=2.0)
    seen = image(sensor, flat_field(sensor, 10_000.0), make_settings(), 0) - sensor.spec.black_level_dn
    assert abs(seen.mean() - 3000) < Z * seen.std() / np.sqrt(seen.size)
    expected = 2.0**2 + QUANTISATION_DN2
    assert abs(seen.var() - expected) < Z * variance_error(expected, seen.size)


def test_the_converter_saturates(make_sensor, make_settings, flat_field):
    sensor = make_sensor()
    seen = image(sensor, flat_field(sensor, 1e7), make_settings(), 0)
    assert (seen == 4095).all()


def test_variance_peaks_before_saturation(make_sensor, make_settings, flat_field):
    """EMVA 1288 takes saturation as the peak of the photon transfer curve: it falls from there on."""
    sensor = make_sensor()
    cap = (sensor.largest_dn - sensor.spec.black_level_dn) * sensor.spec.gain_e_per_dn
    below, at, above = (
        pair(sensor, flat_field(sensor, share * cap), make_settings(), 3)[1] for share in (0.95, 1.0, 1.05)
    )
    assert below > at > above


def test_rounding_is_a_twelfth(make_sensor, make_settings, flat_field):
    """A signal whose noise spans several numbers gains 1/12 DN^2 by being rounded, and no mean."""
    sensor = make_sensor(dark_current_e_per_s=0.0, read_noise_e=0.8, gain_e_per_dn=1.0)
    _, variance = pair(sensor, flat_field(sensor, 0.0), make_settings(), 0)
    expected = 0.8**2 + QUANTISATION_DN2
    # At 0.8 DN the rounding error is uniform to exp(-2 pi^2 0.8^2) = 3e-6.
    assert abs(variance - expected) < Z * variance_error(expected, 120 * 160)


def test_dark_current_adds_charge_and_its_shot_noise(make_sensor, make_settings, flat_field):
    """mu_d = mu_I t, sigma_d^2 = sigma_d0^2 + mu_I t (EMVA 1288 R4 Linear, eq. 30)."""
    sensor = make_sensor(dark_current_e_per_s=20_000.0, temperature_celsius=25.0, gain_e_per_dn=1.0)
    mean, variance = pair(sensor, flat_field(sensor, 0.0), make_settings(exposure_s=0.02), 0)
    expected = 400 + 3.0**2 + QUANTISATION_DN2
    assert abs(mean - 240 - 400) < Z * np.sqrt(expected / (2 * 120 * 160))
    assert abs(variance - expected) < Z * variance_error(expected, 120 * 160)


@pytest.mark.parametrize("bayer", ["rggb", "none"])
def test_the_fixed_pattern_is_the_rig_files(make_sensor, make_settings, flat_field, bayer):
    """DSNU = s_dark / K (eq. 66) and PRNU = sqrt(s_50^2 - s_dark^2) / (mu_50 - mu_dark) (eq. 67), noise taken out.

    The temporal noise left in a mean of L images is its variance over L (eq. 36).
    """
    sensor = make_sensor(prnu=0.02, dsnu_e=6.0, dark_current_e_per_s=0.0, gain_e_per_dn=1.0, bayer=bayer)
    images = 16

    def spatial(charge):
        stack = np.stack([image(sensor, flat_field(sensor, charge), make_settings(), k) for k in range(images)])
        temporal = stack.var(axis=0, ddof=1).mean()
        return stack.mean(), stack.mean(axis=0).var() - temporal / images, stack[0].size, temporal / images

    dark_mean, dark_variance, pixels, dark_noise = spatial(0.0)
    mean, variance, _, noise = spatial(1900.0)
    dsnu_error = (dark_variance + dark_noise) * np.sqrt(2 / pixels)
    assert abs(dark_variance - 6.0**2) < Z * dsnu_error
    prnu = np.sqrt(variance - dark_variance) / (mean - dark_mean)
    prnu_error = (variance + noise) * np.sqrt(2 / pixels) / (2 * prnu * 1900.0**2)
    assert abs(prnu - 0.02) < Z * prnu_error


def test_the_fixed_pattern_stays_and_its_seed_makes_another(make_sensor):
    one, same = (make_sensor(prnu=0.01, dsnu_e=1.0) for _ in range(2))
    other = make_sensor(prnu=0.01, dsnu_e=1.0, pattern_seed=1)
    assert (one.responsivity == same.responsivity).all()
    assert (one.dark_offset_e == same.dark_offset_e).all()
    assert (one.responsivity != other.responsivity).mean() > 0.99
