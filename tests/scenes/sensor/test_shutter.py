"""Rolling shutter and motion blur on moving edges: width, shear, and no light lost."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes.sensor import assemble, exposure_plan, sample_count

HEIGHT, WIDTH = 60, 160
EDGE_AT_0_PX = 40.0


def edge(time_s, speed_px_per_s):
    """A bright half plane whose rim, at EDGE_AT_0_PX + speed t, moves to the right; pixels average over their area."""
    u = np.arange(WIDTH) + 0.5
    row = np.clip(EDGE_AT_0_PX + speed_px_per_s * time_s - u + 0.5, 0, 1)
    return np.broadcast_to(row[None, :, None], (HEIGHT, WIDTH, 3)).astype(np.float32)


def exposed(sensor, exposure_s, speed, most=1000):
    count = sample_count(sensor, exposure_s=exposure_s, speed_px_per_s=speed, most=most)
    plan = exposure_plan(sensor, exposure_s=exposure_s, start_s=0.0, samples=count)
    return assemble((edge(t, speed) for t in plan.times_s), plan), plan


def edge_place(image):
    """Mean place of the rim in each row: how much of the row is bright."""
    return image[..., 0].sum(axis=1)


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
    image, _ = exposed(still, 0.01, speed)
    density = -np.diff(image[0, :, 0])
    u = np.arange(WIDTH - 1)
    middle = (density * u).sum()
    width = np.sqrt(12 * (density * (u - middle) ** 2).sum())
    assert density.sum() == pytest.approx(1, abs=1e-5)
    motion = speed * 0.01
    assert np.sqrt(motion**2 - 1) <= width + 1e-3
    assert width <= np.sqrt(motion**2 + 2)


def test_a_rolling_shutter_shears(rolling):
    """Row r sees the edge r row_time later: speed * row_time pixels from row to row, to the steps' accuracy."""
    speed, exposure_s = 2000.0, 0.004
    image, plan = exposed(rolling, exposure_s, speed)
    place = edge_place(image)
    shear = speed * rolling.row_time_s
    expected = EDGE_AT_0_PX + speed * (np.arange(HEIGHT) * rolling.row_time_s + exposure_s / 2)
    assert rolling.row_time_s * HEIGHT == pytest.approx(50e-6 * 480)
    # A row's share of frames is exact; the frames' steps of under 1 px average out over 8 px of blur.
    assert np.abs(place - expected).max() < 0.1
    assert np.polyfit(np.arange(HEIGHT), place, 1)[0] == pytest.approx(shear, rel=1e-3)
    assert plan.middle_s == pytest.approx(np.arange(HEIGHT) * rolling.row_time_s + exposure_s / 2)


def test_short_exposures_still_shear_within_a_pixel(rolling):
    """Where the exposure is shorter than a step, rows take the nearest frame: half a pixel off at most."""
    speed, exposure_s = 2000.0, 50e-6
    image, _ = exposed(rolling, exposure_s, speed)
    expected = EDGE_AT_0_PX + speed * (np.arange(HEIGHT) * rolling.row_time_s + exposure_s / 2)
    assert np.abs(edge_place(image) - expected).max() < 0.5 + 1e-3


def test_a_global_shutter_does_not_shear(still):
    image, plan = exposed(still, 0.004, 2000.0)
    assert np.ptp(edge_place(image)) == 0
    assert plan.weight == pytest.approx(1 / len(plan.times_s))


@given(exposure_us=st.floats(30, 30_000), samples=st.integers(1, 40), row_time_us=st.floats(0, 60))
def test_no_light_is_lost(rolling_of, exposure_us, samples, row_time_us):
    """Shares of each row sum to 1, none is negative, every frame is used, times lie within the exposure."""
    sensor = rolling_of(row_time_us)
    plan = exposure_plan(sensor, exposure_s=exposure_us * 1e-6, start_s=2.0, samples=samples)
    assert plan.weight.sum(axis=1) == pytest.approx(1)
    assert (plan.weight >= 0).all()
    end = 2.0 + exposure_us * 1e-6 + (HEIGHT - 1) * sensor.row_time_s
    assert (plan.times_s > 2.0).all()
    assert (plan.times_s < end).all()
    # Time-weighted, a row's frames lie around its middle, to half a step.
    step = (end - 2.0) / samples
    assert np.abs(plan.weight @ plan.times_s - plan.middle_s).max() <= step / 2 + 1e-9


@pytest.fixture(scope="module")
def rolling_of(make_sensor):
    from dataclasses import replace

    base = make_sensor(height=HEIGHT, width=WIDTH)
    return lambda row_time_us: replace(base, row_time_s=row_time_us * 1e-6)


def test_what_stands_still_stays_as_it_is(rolling):
    plan = exposure_plan(rolling, exposure_s=0.003, start_s=1.0, samples=7)
    picture = np.random.default_rng(0).uniform(0, 1, (HEIGHT, WIDTH, 3)).astype(np.float32)
    assert assemble([picture] * 7, plan) == pytest.approx(picture, rel=1e-6)


def test_steps_are_below_a_pixel_up_to_the_most(rolling, still):
    assert sample_count(still, exposure_s=0.01, speed_px_per_s=0.0, most=16) == 1
    assert sample_count(still, exposure_s=0.01, speed_px_per_s=950.0, most=16) == 10
    assert sample_count(still, exposure_s=0.01, speed_px_per_s=-950.0, most=16) == 10
    assert sample_count(still, exposure_s=0.01, speed_px_per_s=9500.0, most=16) == 16
    read_out = (HEIGHT - 1) * rolling.row_time_s
    assert sample_count(rolling, exposure_s=0.001, speed_px_per_s=500.0, most=99) == int(500 * (read_out + 0.001)) + 1


def test_the_number_of_frames_must_fit(still):
    plan = exposure_plan(still, exposure_s=0.01, start_s=0.0, samples=3)
    frame = np.zeros((HEIGHT, WIDTH, 3), dtype=np.float32)
    with pytest.raises(ValueError, match="expected 3 frames, got 2"):
        assemble([frame] * 2, plan)
    with pytest.raises(ValueError, match="expected 3 frames of 60 rows, got frame 4"):
        assemble([frame] * 4, plan)
    with pytest.raises(ValueError, match="expected 3 frames of 60 rows, got frame 1 of 30 rows"):
        assemble([frame[:30]], plan)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [({"exposure_s": 0.0, "samples": 3}, "exposure_s > 0"), ({"exposure_s": 0.1, "samples": 0}, "at least 1 sample")],
)
def test_plans_of_nothing_are_refused(still, arguments, message):
    with pytest.raises(ValueError, match=message):
        exposure_plan(still, start_s=0.0, **arguments)
