"""Rolling shutter and motion blur on moving edges: width, shear, and where the light of a row comes from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes.sensor import sweep_count, sweep_times

HEIGHT, WIDTH = 60, 160
EDGE_AT_0_PX = 40.0


def edge(row_times_s, speed_px_per_s):
    """A bright half plane whose rim, at EDGE_AT_0_PX + speed t, moves to the right; pixels average over their area."""
    u = np.arange(WIDTH) + 0.5
    return np.clip(EDGE_AT_0_PX + speed_px_per_s * row_times_s[:, None] - u + 0.5, 0, 1)


def exposed(sensor, exposure_s, speed, step_px=1.0):
    """One exposure of the edge, as a swept renderer would show it."""
    count = sweep_count(motion_px=speed * exposure_s, step_px=step_px, most=1000)
    times = sweep_times(sensor, exposure_s=exposure_s, start_s=0.0, sweeps=count)
    return np.mean([edge(np.linspace(*sweep, HEIGHT), speed) for sweep in times], axis=0)


def edge_place(image):
    """Mean place of the rim in each row: how much of the row is bright."""
    return image.sum(axis=1)


@pytest.fixture(scope="module")
def rolling(make_sensor):
    return make_sensor(height=HEIGHT, width=WIDTH, row_time_us=50.0)


@pytest.fixture(scope="module")
def still(make_sensor):
    return make_sensor(height=HEIGHT, width=WIDTH)


@pytest.mark.parametrize("speed", [400.0, 1000.0, 3000.0])
def test_blur_is_as_wide_as_the_motion(still, speed):
    """A uniform motion spreads an edge evenly over speed * exposure.

    An even density of width w has sigma w / sqrt(12). The pixel's own box adds 1/12 to its square, and so do steps of
    less than a pixel, with the opposite sign.
    """
    image = exposed(still, 0.01, speed)
    density = -np.diff(image[0])
    u = np.arange(WIDTH - 1)
    middle = (density * u).sum()
    width = np.sqrt(12 * (density * (u - middle) ** 2).sum())
    assert density.sum() == pytest.approx(1, abs=1e-5)
    motion = speed * 0.01
    assert np.sqrt(motion**2 - 1) <= width + 1e-3
    assert width <= np.sqrt(motion**2 + 2)


@pytest.mark.parametrize("exposure_s", [0.004, 50e-6])
def test_a_rolling_shutter_shears(rolling, exposure_s):
    """Row r sees the edge r row_time later, however short the exposure: speed * row_time pixels from row to row."""
    speed = 2000.0
    place = edge_place(exposed(rolling, exposure_s, speed))
    expected = EDGE_AT_0_PX + speed * (np.arange(HEIGHT) * rolling.row_time_s + exposure_s / 2)
    assert place == pytest.approx(expected, abs=1e-6)


def test_a_global_shutter_does_not_shear(still):
    assert np.ptp(edge_place(exposed(still, 0.004, 2000.0))) == 0


@given(exposure_us=st.floats(30, 30_000), sweeps=st.integers(1, 40), row_time_us=st.floats(0, 60))
def test_sweeps_lie_evenly_about_the_middle_of_each_row(still, exposure_us, sweeps, row_time_us):
    """Within every row's exposure, as far apart as they stand for, and on the mean at its middle."""
    sensor = replace(still, row_time_s=row_time_us * 1e-6)
    exposure_s = exposure_us * 1e-6
    times = sweep_times(sensor, exposure_s=exposure_s, start_s=2.0, sweeps=sweeps)
    opened = 2.0 + np.array([0, HEIGHT - 1]) * sensor.row_time_s
    assert (times > opened).all()
    assert (times < opened + exposure_s).all()
    assert times.mean(axis=0) == pytest.approx(opened + exposure_s / 2, abs=1e-12)
    assert np.diff(times, axis=0) == pytest.approx(exposure_s / sweeps, abs=1e-12)


@pytest.mark.parametrize(
    ("motion_px", "count"), [(0.0, 1), (1.9, 1), (2.1, 2), (-9.5, 5), (95.0, 16)], ids=lambda value: f"{value}"
)
def test_steps_are_below_their_length_up_to_the_most(motion_px, count):
    assert sweep_count(motion_px=motion_px, step_px=2.0, most=16) == count


@pytest.mark.parametrize(
    ("arguments", "message"),
    [({"exposure_s": 0.0, "sweeps": 3}, "exposure_s > 0"), ({"exposure_s": 0.1, "sweeps": 0}, "at least 1 frame")],
)
def test_exposures_of_nothing_are_refused(still, arguments, message):
    with pytest.raises(ValueError, match=message):
        sweep_times(still, start_s=0.0, **arguments)


def test_no_frames_are_refused():
    with pytest.raises(ValueError, match="at least 1 frame, got most = 0"):
        sweep_count(motion_px=1.0, step_px=1.0, most=0)
