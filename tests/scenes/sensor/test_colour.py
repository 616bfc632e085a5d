"""Images: levels, the sRGB curve, white balance, saturation."""

from __future__ import annotations

import numpy as np
import pytest

from optics.srgb import srgb_encode
from scenes.sensor import RawImage, capture, develop, expose, frame_key, grey_card_gains
from scenes.sensor.colour import balancing_gains


def raw_of(sensor, level, settings):
    """Raw image of one linear level from 0 (black) to 1 (full scale)."""
    number = sensor.spec.black_level_dn + level * (sensor.largest_dn - sensor.spec.black_level_dn)
    return RawImage(
        digital_numbers=np.full((sensor.height_px, sensor.width_px), round(number), np.uint16), settings=settings
    )


def test_the_curve_is_srgb():
    """Known pairs: 18 % grey is 118 of 255 (IEC 61966-2-1), 0.0031308 joins line and power."""
    assert round(float(srgb_encode(0.18)) * 255) == 118
    assert srgb_encode(0) == 0
    assert srgb_encode(1) == pytest.approx(1, abs=1e-12)
    assert srgb_encode(0.0031308) == pytest.approx(srgb_encode(0.00313081), abs=1e-6)


@pytest.mark.parametrize("bayer", ["rggb", "none"])
@pytest.mark.parametrize("bits", [8, 12, 16])
def test_levels_become_srgb(make_sensor, make_settings, flat_field, bits, bayer):
    """Any depth: a grey of 18 % of the range is shown as 118, black as 0, full scale as 255."""
    sensor = make_sensor(
        bits=bits,
        black_level_dn=0,
        bayer=bayer,
        gain_e_per_dn=8000 / 2**bits,
        read_noise_e=0.0,
        dark_current_e_per_s=0.0,
    )
    full_e = sensor.largest_dn * sensor.spec.gain_e_per_dn
    for level, shown in ((0.0, 0), (0.18, 118), (1.0, 255)):
        raw = expose(flat_field(sensor, level * full_e), sensor, make_settings())
        image = develop(raw, sensor)
        assert image.dtype == np.uint8
        assert image.shape == (sensor.height_px, sensor.width_px, 3)
        assert np.abs(image.astype(int) - shown).max() <= (1 if bits == 8 else 0)  # 8 bits: half a step of 0.18


def test_gains_multiply_before_the_curve(make_sensor, make_settings):
    sensor = make_sensor()
    raw = raw_of(sensor, 0.09, make_settings(white_gains=(2.0, 1.0, 4.0)))
    red, green, blue = develop(raw, sensor)[60, 80]
    assert (red, green, blue) == (118, round(float(srgb_encode(0.09)) * 255), round(float(srgb_encode(0.36)) * 255))


def test_what_saturates_is_white(make_sensor, make_settings):
    """Whatever the gains are: none is below 1."""
    sensor = make_sensor()
    for level in ((1.0, 2.0, 3.0), (0.01, 1.0, 0.7), (1.0, 1.0, 1.0)):
        gains = balancing_gains(level, 8.0)
        assert min(gains) == 1
        assert (develop(raw_of(sensor, 1.0, make_settings(white_gains=gains)), sensor) == 255).all()


def test_balancing_gains_are_cut():
    assert balancing_gains((0.5, 1.0, 0.25), 8.0) == (2.0, 1.0, 4.0)
    assert balancing_gains((0.0, 1.0, 0.001), 8.0) == (8.0, 1.0, 8.0)
    assert balancing_gains((0.0, 0.0, 0.0), 8.0) == (1.0, 1.0, 1.0)


def test_a_grey_card_comes_out_grey(make_sensor, make_settings):
    """Under blue-green light, as at some metres: the card's image has one value in all channels."""
    sensor = make_sensor()
    card = np.array([0.002, 0.006, 0.005])
    settings = make_settings(exposure_s=0.003, white_gains=grey_card_gains(card, sensor))
    radiance = np.broadcast_to(card.astype(np.float32), (120, 160, 3))
    image = develop(expose(radiance, sensor, settings), sensor)[60, 80].astype(int)
    assert np.ptp(image) <= 1  # one step of rounding
    assert 50 < image[1] < 250
    unbalanced = develop(expose(radiance, sensor, make_settings(exposure_s=0.003)), sensor)[60, 80].astype(int)
    assert np.ptp(unbalanced) > 40


def test_capture_is_its_parts(make_sensor, make_settings, flat_field):
    sensor, settings = make_sensor(), make_settings()
    radiance = flat_field(sensor, 700.0)
    frame = capture(radiance, sensor, settings, frame_key(1, 2))
    raw = expose(radiance, sensor, settings, frame_key(1, 2))
    assert (frame.raw.digital_numbers == raw.digital_numbers).all()
    assert (frame.image == develop(raw, sensor)).all()
    assert frame.next_settings != settings
