"""How many electrons light makes: against the formulas written out once more, and against photon counting."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.constants import c, h
from scipy.stats import norm

from rigs import Rig
from rigs.image_sensor import ImageSensorSpec
from scenes.light.spectrum import CHANNEL_PEAKS_NM, CHANNEL_WIDTH_NM, CameraResponse, camera_bands
from scenes.sensor import ImageSensor, expose
from scenes.sensor.model import electron_rate, relative_illumination

FLOAT32 = 1e-6
"""Relative accuracy of a product of float32 numbers."""


def test_electrons_are_those_of_counting_photons_wavelength_by_wavelength():
    """Independent: EMVA 1288's photons mu_p = A E t lambda / (h c), summed over a fine grid of the Gaussian response.

    QE(lambda) is taken such that the response per watt, QE lambda, is the Gaussian the bands are averaged with; the
    light is a slope, which a band's average holds exactly.
    """
    spec = ImageSensorSpec()
    wavelength_nm = np.arange(300.0, 900.0, 0.5)
    spectral_radiance = 0.01 * (1 + (wavelength_nm - 550) / 400)
    exposure_s, area_m2 = 0.01, (2.8e-6) ** 2
    irradiance = np.pi * spectral_radiance * 0.9 / (4 * 2.8**2)
    photons_per_nm = area_m2 * irradiance * exposure_s * wavelength_nm * 1e-9 / (h * c)
    for channel, (peak, efficiency) in enumerate(zip(CHANNEL_PEAKS_NM, spec.quantum_efficiency, strict=True)):
        gauss = np.exp(-0.5 * ((wavelength_nm - peak) / CHANNEL_WIDTH_NM) ** 2)
        electrons = (photons_per_nm * efficiency * gauss * peak / wavelength_nm).sum() * 0.5
        mean_radiance = camera_bands().weight[channel] @ np.interp(
            camera_bands().wavelength_nm, wavelength_nm, spectral_radiance
        )
        ours = electron_rate(spec, None)[channel] * mean_radiance * exposure_s
        assert ours == pytest.approx(electrons, rel=1e-6)  # the sum's own error: a Gaussian on a fine grid


def test_a_measured_response_counts_as_its_formula():
    """The Gaussian as a table gives what the Gaussian gives, but for its ends beyond 400 and 700 nm.

    Of the red band beyond 700 nm lies 1 - Phi(100 / 30) = 4.3e-4, of the blue one below 400 nm 1 - Phi(2) = 2.3 %.
    """
    wavelength_nm = np.arange(350.0, 750.0, 1.0)
    gauss = [np.exp(-0.5 * ((wavelength_nm - peak) / CHANNEL_WIDTH_NM) ** 2) for peak in CHANNEL_PEAKS_NM]
    table = CameraResponse(wavelength_nm=wavelength_nm, response=7.0 * np.stack(gauss))
    ratio = electron_rate(ImageSensorSpec(), table) / electron_rate(ImageSensorSpec(), None)
    peaks = np.asarray(CHANNEL_PEAKS_NM)
    within = norm.cdf((700 - peaks) / CHANNEL_WIDTH_NM) - norm.cdf((400 - peaks) / CHANNEL_WIDTH_NM)
    assert ratio == pytest.approx(within, rel=2e-4)  # a polygon of 1 nm: up to (1/30)^2 / 12 below the curve


def test_a_pixel_collects_by_time_aperture_and_area(make_sensor, make_settings, flat_field):
    """Doubling time, area or transmittance doubles the charge; doubling the f-number quarters it."""
    base = make_sensor(dark_current_e_per_s=0.0, lens_transmittance=0.45)
    radiance = flat_field(base, 500.0)

    def signal(sensor, exposure_s=0.005):
        numbers = expose(radiance, sensor, make_settings(exposure_s=exposure_s)).digital_numbers
        return (numbers - sensor.spec.black_level_dn) * sensor.spec.gain_e_per_dn

    # A digital number of some hundreds, in float32, is good to 1e-7 of it.
    assert signal(base) == pytest.approx(500.0, rel=1e-5)
    assert signal(base, 0.01) == pytest.approx(1000.0, rel=1e-5)
    assert signal(make_sensor(dark_current_e_per_s=0.0, lens_transmittance=0.9)) == pytest.approx(1000.0, rel=1e-5)
    wide = make_sensor(dark_current_e_per_s=0.0, lens_transmittance=0.45, pixel_pitch_um=5.6)
    assert signal(wide) == pytest.approx(2000.0, rel=1e-5)
    slow = make_sensor(dark_current_e_per_s=0.0, lens_transmittance=0.45, f_number=5.6)
    assert signal(slow) == pytest.approx(125.0, rel=1e-5)


def test_gain_multiplies_by_decibels(make_sensor, make_settings, flat_field):
    sensor = make_sensor(dark_current_e_per_s=0.0)
    radiance, black = flat_field(sensor, 300.0), sensor.spec.black_level_dn
    low = expose(radiance, sensor, make_settings()).digital_numbers - black
    high = expose(radiance, sensor, make_settings(gain_db=20.0)).digital_numbers - black
    assert high == pytest.approx(10 * low, rel=1e-5)


def test_vignetting_is_cos4_of_the_angle_from_the_axis():
    """A pixel 500 px off the axis of a lens of 500 px lies at 45 degrees: cos^4 = 1/4."""
    rig = Rig.load("aqua2")
    camera = rig.camera.model_copy(update={"cx_px": 0.0, "cy_px": 0.0})
    fall = relative_illumination(camera, 640, 480, "cos4")
    assert fall.shape == (480, 640)
    assert fall[0, 0] == pytest.approx(1, abs=1e-12)
    assert fall[0, 500] == pytest.approx(0.25, rel=1e-9)
    assert fall[300, 400] == pytest.approx(0.25, rel=1e-9)
    assert relative_illumination(camera, 640, 480, "none").min() == 1


def test_vignetting_of_a_smaller_image_is_that_of_its_pixels_places():
    """Half the size: each pixel lies in the middle of four of the camera's."""
    camera = Rig.load("aqua2").camera
    whole, half = (relative_illumination(camera, w, h, "cos4") for w, h in ((640, 480), (320, 240)))
    of_four = whole.reshape(240, 2, 320, 2).mean(axis=(1, 3))
    assert half == pytest.approx(of_four, rel=1e-5)  # curvature over a pixel: (1/500)^2


def test_dark_current_doubles(make_sensor):
    assert make_sensor(dark_current_e_per_s=4.0, temperature_celsius=25.0).dark_current_e_per_s == 4
    warm = make_sensor(dark_current_e_per_s=4.0, temperature_celsius=39.0, dark_current_doubling_celsius=7.0)
    assert warm.dark_current_e_per_s == pytest.approx(16)


def test_a_smaller_image_takes_as_long_to_read():
    rig = Rig.load("aqua2")
    whole, half = ImageSensor.from_rig(rig), ImageSensor.from_rig(rig, width_px=320, height_px=240)
    assert whole.row_time_s * 480 == pytest.approx(half.row_time_s * 240)


def test_rows_that_take_longer_than_a_frame_are_said():
    rig = Rig.load("aqua2").model_copy(update={"image_sensor": ImageSensorSpec(row_time_us=100.0)})
    with pytest.raises(ValueError, match=r"row_time_us = 100: expected 480 rows within a frame .* they take 48.0 ms"):
        ImageSensor.from_rig(rig)


@pytest.mark.parametrize("bad", [-1e-3, np.nan])
def test_radiance_that_cannot_be_is_refused(make_sensor, make_settings, bad):
    sensor = make_sensor()
    radiance = np.zeros((120, 160, 3), dtype=np.float32)
    radiance[3, 4, 1] = bad
    with pytest.raises(ValueError, match="expected radiance of at least 0"):
        expose(radiance, sensor, make_settings())


def test_radiance_of_another_size_is_refused(make_sensor, make_settings):
    with pytest.raises(ValueError, match=r"expected radiance of shape \(120, 160, 3\), got \(10, 10, 3\)"):
        expose(np.zeros((10, 10, 3), dtype=np.float32), make_sensor(), make_settings())
