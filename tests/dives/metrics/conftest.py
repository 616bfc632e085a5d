"""Logs made by hand: one row a frame, everything good, but for the columns that a test sets."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pytest

RATE_HZ = 10.0
"""Frames a second of a made log."""


@pytest.fixture
def make_log():
    """`make_log(n, **columns)`: a log of n frames in which the target is held in the crop's centre throughout."""

    def make(frames: int, **columns) -> pa.Table:
        zero = np.zeros(frames)
        good = {
            "time_s": np.arange(frames) / RATE_HZ,
            "mode": ["track"] * frames,
            "q1_command_deg": zero,
            "q2_command_deg": zero,
            "q1_true_deg": zero,
            "q2_true_deg": zero,
            "beyond_reach": np.zeros(frames, dtype=bool),
            "detected": np.ones(frames, dtype=bool),
            "centroid_x_px": zero + 159.5,
            "centroid_y_px": zero + 119.5,
            "predicted_x_px": zero + 159.5,
            "predicted_y_px": zero + 119.5,
            "error_x_px": zero,
            "error_y_px": zero,
            "true_azimuth_deg": zero,
            "true_elevation_deg": zero,
            "gaze_azimuth_deg": zero,
            "gaze_elevation_deg": zero,
            "gaze_error_deg": zero,
            "estimated_azimuth_deg": zero,
            "estimated_elevation_deg": zero,
            "true_x_px": zero + 159.5,
            "true_y_px": zero + 119.5,
            "target_visible_px": np.full(frames, 50, dtype=np.int32),
            "detector_true_px": np.full(frames, 40, dtype=np.int32),
            "detector_found_px": np.full(frames, 40, dtype=np.int32),
            "detector_both_px": np.full(frames, 40, dtype=np.int32),
            "cause_of_loss": [""] * frames,
            "detected_thing": ["target"] * frames,
        }
        unknown = columns.keys() - good.keys()
        assert not unknown, unknown
        return pa.table(good | {name: column for name, column in columns.items() if column is not None})

    return make
