"""Lags put in by hand and read back: exact for ramps, nearly for swings; none where none can be told."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dives.metrics import dive_metrics
from dives.metrics.latency import lag_s

RATE_HZ = 30.0
TIME_S = np.arange(300) / RATE_HZ


def column(values):
    return np.asarray(values)[:, np.newaxis]


@given(lag=st.floats(-0.3, 1.5), speed=st.floats(1.0, 60.0))
def test_a_ramp_is_read_exactly(lag, speed):
    """Squared differences of two ramps are a parabola of the shift, so its vertex is the lag itself."""
    found = lag_s(TIME_S, column(speed * TIME_S), column(speed * (TIME_S - lag)))
    assert found == pytest.approx(lag, abs=1e-9)


@pytest.mark.parametrize("lag", [0.0, 0.1, 0.25, 1 / 3, 0.417])
def test_a_swing_is_read_to_a_part_of_a_frame(lag):
    """A swing of 0.5 Hz turns 0.1 rad a frame: a parabola is a cosine to its square, a hundredth of a frame."""
    phase = 2 * np.pi * 0.5
    found = lag_s(TIME_S, column(20 * np.sin(phase * TIME_S)), column(20 * np.sin(phase * (TIME_S - lag))))
    assert found == pytest.approx(lag, abs=0.01 / RATE_HZ)


def test_uneven_frames_are_evened_out():
    """Every seventh frame dropped: linear interpolation of a swing errs by less than a twentieth of a frame."""
    time_s = TIME_S[np.arange(300) % 7 != 3]
    phase = 2 * np.pi * 0.3
    found = lag_s(time_s, column(np.sin(phase * time_s) * 9), column(np.sin(phase * (time_s - 0.2)) * 9))
    assert found == pytest.approx(0.2, abs=0.05 / RATE_HZ)


def test_what_cannot_be_told():
    still = column(np.full(300, 5.0))
    assert lag_s(TIME_S, still, still) is None
    # Half a turn ahead or behind is the same: the best of a small window lies on its edge.
    assert lag_s(TIME_S[:4], column([0, 1, 2, 3.0]), column([9, 9, 9, 9.0])) is None
    assert lag_s(TIME_S, column(TIME_S * 9), column(TIME_S * 9 - 9 * 5.0)) is None
    assert lag_s(TIME_S[:0], column([]), column([])) is None


def test_lags_of_a_dive(make_log):
    """Pan is commanded along a swing and follows 0.2 s later, tilt 0.3 s; the gaze follows the target by 0.4 s."""
    n = 200
    time_s = np.arange(n) / 10
    swing = lambda late: 30 * np.sin(2 * np.pi * 0.1 * (time_s - late))  # noqa: E731
    log = make_log(
        n,
        mode=["scan"] * 20 + ["track"] * 170 + ["scan"] * 10,
        q1_command_deg=swing(0.0),
        q1_true_deg=swing(0.2),
        q2_command_deg=swing(0.0),
        q2_true_deg=swing(0.3),
        true_azimuth_deg=180 + swing(0.0),
        gaze_azimuth_deg=-180 + swing(0.4),
    )
    found = dive_metrics(log)
    # 0.06 rad a frame; azimuths that differ by a full turn are the same direction.
    assert found["command_to_joint_lag_q1_s"] == pytest.approx(0.2, abs=0.001)
    assert found["command_to_joint_lag_q2_s"] == pytest.approx(0.3, abs=0.001)
    assert found["target_to_gaze_lag_s"] == pytest.approx(0.4, abs=0.001)
