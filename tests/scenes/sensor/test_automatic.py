"""Automatic exposure and white balance: where they come to rest, how fast, and within which limits."""

from __future__ import annotations

import numpy as np
import pytest

from scenes.sensor import capture, develop, expose, frame_key, next_settings, settled_settings, start_settings
from scenes.sensor.automatic import level, meter, metered_pixels

TARGET = 0.18


def grey(sensor, radiance):
    return np.full((sensor.height_px, sensor.width_px, 3), radiance, dtype=np.float32)


def run(sensor, radiance, settings, frames, seed=0):
    """Settings of each frame of a scene that stays, noise included."""
    history = [settings]
    for k in range(frames):
        history.append(capture(radiance, sensor, history[-1], frame_key(seed, k)).next_settings)
    return history


def total(settings):
    return settings.exposure_s * 10 ** (settings.gain_db / 20)


@pytest.mark.parametrize("radiance", [2e-4, 2e-3, 2e-2, 2e-1])
@pytest.mark.parametrize("bayer", ["rggb", "none"])
def test_exposure_settles_on_the_target(make_sensor, radiance, bayer):
    """From radiance over three decades; noise moves the meter's mean of 300 cells by about 1 %."""
    sensor = make_sensor(bayer=bayer)
    raws = run(sensor, grey(sensor, radiance), start_settings(sensor), 90)
    raw = expose(grey(sensor, radiance), sensor, raws[-1])
    assert level(meter(raw, sensor), raws[-1].white_gains) == pytest.approx(TARGET, rel=0.03)
    still = settled_settings(grey(sensor, radiance), sensor)
    assert total(still) == pytest.approx(total(raws[-1]), rel=0.03)


def test_the_lag_is_one_pole(make_sensor):
    """After a step of light, the exposure's logarithm goes 1 - exp(-t / lag) of the way."""
    sensor = make_sensor(exposure={"lag_s": 0.3}, white_balance={"mode": "manual"}, dark_current_e_per_s=0.0)
    start = settled_settings(grey(sensor, 0.004), sensor)
    end = settled_settings(grey(sensor, 0.002), sensor)
    history = [start]
    for _ in range(30):
        history.append(next_settings(expose(grey(sensor, 0.002), sensor, history[-1]), sensor))
    gone = np.log([total(s) / total(start) for s in history]) / np.log(total(end) / total(start))
    # The two resting points are known to a thousandth of their own, of a step of ln 2.
    assert gone == pytest.approx(1 - np.exp(-np.arange(31) / 30 / 0.3), abs=3e-3)


@pytest.mark.parametrize("lag_s", [0.0, 0.1, 1.0])
@pytest.mark.parametrize("factor", [1e-2, 1e2])
def test_exposure_neither_overshoots_nor_hunts(make_sensor, lag_s, factor):
    """Whatever the lag and the jump: monotone to the end."""
    sensor = make_sensor(exposure={"lag_s": lag_s}, white_balance={"mode": "manual"})
    start = settled_settings(grey(sensor, 0.01), sensor)
    history = [start]
    for _ in range(200):
        history.append(next_settings(expose(grey(sensor, 0.01 * factor), sensor, history[-1]), sensor))
    steps = np.diff(np.log([total(s) for s in history])) * (-1 if factor > 1 else 1)
    assert steps.min() > -1e-3  # the dark current's share and float32
    assert abs(steps[-1]) < 1e-3
    assert steps.sum() > np.log(10)


def test_time_comes_before_gain_and_limits_hold(make_sensor):
    sensor = make_sensor(exposure={"longest_us": 20_000.0}, largest_gain_db=18.0)
    bright, dim, black = (settled_settings(grey(sensor, L), sensor) for L in (1e-2, 2e-4, 0.0))
    assert bright.gain_db == 0
    assert bright.exposure_s < 0.02
    assert dim.exposure_s == pytest.approx(0.02)
    assert 0 < dim.gain_db < 18
    assert black.exposure_s == pytest.approx(0.02)
    assert black.gain_db == pytest.approx(18)
    blinding = settled_settings(grey(sensor, 1e4), sensor)
    assert blinding.exposure_s == pytest.approx(29.6e-6)
    assert blinding.gain_db == 0


def test_manual_settings_stay(make_sensor, flat_field):
    sensor = make_sensor(
        exposure={"mode": "manual", "time_us": 1234.0, "gain_db": 6.0},
        white_balance={"mode": "manual", "gains": (1.0, 0.5, 2.0)},
    )
    settings = start_settings(sensor)
    assert (settings.exposure_s, settings.gain_db) == (pytest.approx(1.234e-3), 6.0)
    assert settings.white_gains == (2.0, 1.0, 4.0)  # the smallest counts as 1
    assert next_settings(expose(flat_field(sensor, 1000.0), sensor, settings), sensor) == settings


def test_a_weight_says_where_to_meter(make_sensor):
    """Bright left half, dark right half: metered on either, that half comes to the target."""
    sensor = make_sensor(white_balance={"mode": "manual"})
    radiance = grey(sensor, 0.02)
    radiance[:, 80:] = 0.001
    for half, L in ((slice(0, 80), 0.02), (slice(80, 160), 0.001)):
        weight = np.zeros((120, 160), dtype=np.float32)
        weight[:, half] = 1
        of_half = settled_settings(radiance, sensor, weight=weight)
        assert total(of_half) == pytest.approx(total(settled_settings(grey(sensor, L), sensor)), rel=5e-3)


def test_a_weight_of_nothing_is_refused(make_sensor, make_settings, flat_field):
    sensor = make_sensor()
    raw = expose(flat_field(sensor, 500.0), sensor, make_settings())
    with pytest.raises(ValueError, match="expected metering weights with a positive sum"):
        next_settings(raw, sensor, np.zeros((120, 160), dtype=np.float32))


def test_grey_world_takes_the_cast_away(make_sensor):
    """Texture under blue-green light: its mean comes out grey."""
    sensor = make_sensor()
    # In squares of 8 px, so that all four filters of a metered cell see the same.
    texture = np.kron(np.random.default_rng(0).uniform(0.2, 1.0, (15, 20, 1)), np.ones((8, 8, 1)))
    radiance = (texture * [0.002, 0.006, 0.005]).astype(np.float32)
    settings = run(sensor, radiance, start_settings(sensor), 240)[-1]
    raw = expose(radiance, sensor, settings)
    mean = (raw.digital_numbers - 240.0).reshape(60, 2, 80, 2).mean(axis=(0, 2))
    balanced = np.array([mean[0, 0], (mean[0, 1] + mean[1, 0]) / 2, mean[1, 1]]) * settings.white_gains
    assert np.ptp(balanced) / balanced.mean() < 0.005  # 300 cells of 2 % of noise, and the dark current
    assert settings.white_gains[0] > 1.5


def test_saturated_pixels_do_not_vote(make_sensor):
    """They are white whatever the light's colour: a blown-out half leaves the other half's balance as it is."""
    sensor = make_sensor(exposure={"mode": "manual", "time_us": 3000.0})
    radiance = np.broadcast_to(np.float32([0.002, 0.006, 0.005]), (120, 160, 3)).copy()
    alone = settled_settings(radiance, sensor).white_gains
    radiance[:, :80] = 10.0
    assert settled_settings(radiance, sensor).white_gains == pytest.approx(alone, rel=1e-6)


def test_white_stays_white_on_the_way(make_sensor, make_settings):
    """From a balance for one cast to one for the opposite: the smallest gain is 1 in every frame between."""
    sensor = make_sensor()
    radiance = np.broadcast_to(np.float32([0.006, 0.003, 0.0015]), (120, 160, 3))
    history = run(sensor, radiance, make_settings(white_gains=(6.0, 1.0, 1.0)), 60)
    assert [min(settings.white_gains) for settings in history] == pytest.approx([1.0] * 61, abs=1e-12)
    assert history[-1].white_gains[2] > 2


def test_grey_world_cannot_raise_what_is_gone(make_sensor):
    """No red at all, as in the deep: its gain stops at the limit, and the image stays blue-green."""
    sensor = make_sensor(white_balance={"largest_gain": 4.0})
    radiance = np.broadcast_to(np.float32([0, 0.006, 0.005]), (120, 160, 3))
    settings = settled_settings(radiance, sensor)
    assert settings.white_gains[0] == pytest.approx(4)
    red, green, blue = develop(expose(radiance, sensor, settings), sensor)[60, 80].astype(int)
    assert red < 10
    assert abs(green - blue) <= 1


def test_a_grey_card_is_asked_for(make_sensor):
    sensor = make_sensor(white_balance={"mode": "grey-card"})
    with pytest.raises(ValueError, match="expected the radiance of a card"):
        start_settings(sensor)
    gains = start_settings(sensor, (0.002, 0.006, 0.005)).white_gains
    radiance = np.broadcast_to(np.float32([0.005, 0.001, 0.001]), (120, 160, 3))
    assert settled_settings(radiance, sensor, card_radiance=(0.002, 0.006, 0.005)).white_gains == gains


def test_the_settings_are_the_whole_state(make_sensor):
    """Frames 10 to 20 from the settings of frame 10 alone are those of the run from the start."""
    sensor, radiance = make_sensor(), grey(make_sensor(), 0.004)
    history = run(sensor, radiance, start_settings(sensor), 20)
    settings = history[10]
    for k in range(10, 20):
        settings = capture(radiance, sensor, settings, frame_key(0, k)).next_settings
    assert settings == history[20]


def test_the_sun_saturates_and_darkens_the_rest(make_sensor):
    """Looking up into the sun: where the paper's ball was lost ("towards the sea surface (sunlight)").

    The sun's disk and its glow beside water that is well exposed without them. The disk's radiance is some 1e5 times
    the water's (ASTM G173: 1.4 W / (m^2 nm) over 6.8e-5 sr, less what the surface and some metres of water take).
    """
    sensor = make_sensor(row_time_us=0.0)
    water = np.broadcast_to(np.float32([0.01, 0.03, 0.03]), (120, 160, 3))
    v, u = np.indices((120, 160))
    distance = np.hypot(u - 80, v - 60)
    sky = water + (0.4 * np.exp(-distance / 12.0))[..., None].astype(np.float32)
    sun = np.where((distance < 4)[..., None], np.float32(8e3), sky)
    settings = [settled_settings(scene, sensor) for scene in (water, sun)]
    images = [develop(expose(s, sensor, c), sensor) for s, c in zip((water, sun), settings, strict=True)]
    raw = expose(sun, sensor, settings[1]).digital_numbers
    assert (raw[distance < 3] == sensor.largest_dn).all()
    assert (images[1][distance < 3] == 255).all()
    assert total(settings[1]) < 0.6 * total(settings[0])
    corner = [int(p[:20, :20].mean()) for p in images]
    assert corner[0] > 100
    assert corner[1] < 0.75 * corner[0]


@pytest.mark.parametrize("bayer", ["grbg", "none"])
def test_what_is_not_metered_changes_nothing(make_sensor, make_settings, flat_field, bayer):
    sensor, settings = make_sensor(bayer=bayer), make_settings()
    radiance = np.array(flat_field(sensor, 500.0))
    metered = metered_pixels(sensor)
    assert metered.sum() == 40 * 30 * (1 if bayer == "none" else 4)
    other = np.where(metered[..., np.newaxis], radiance, 10 * radiance)
    first, second = (next_settings(expose(each, sensor, settings), sensor) for each in (radiance, other))
    assert first == second
    brighter = np.where(metered[..., np.newaxis], 10 * radiance, radiance)
    assert next_settings(expose(brighter, sensor, settings), sensor) != first
