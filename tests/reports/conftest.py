"""A dive made by hand: check, scan, track, a loss to the sun with a prediction over it, and a recovery."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pytest

RATE_HZ = 10.0


@pytest.fixture(scope="session")
def dive_log() -> pa.Table:
    """Log of 60 s: detections from 15 s on, a gap from 30 s to 33 s that a prediction bridges, mode `scan` to 36 s."""
    time_s = np.arange(600) / RATE_HZ
    found = (time_s >= 15) & ~((time_s >= 30) & (time_s < 36))
    mode = np.select(
        [time_s < 5, found, (time_s >= 30) & (time_s < 33)],
        ["check", "track", "predict"],
        "scan",
    )
    nan = np.full(600, np.nan)
    wave = 12 * np.sin(time_s)
    error_x, error_y = (np.where(found | (mode == "predict"), part, np.nan) for part in (wave, wave / 2 - 3))
    pan = np.clip(3 * (time_s - 15), -70, 70)
    count = np.where(found, 40, 0).astype(np.int32)
    cause = np.select([time_s < 15, (time_s >= 30) & (time_s < 33), (time_s >= 33) & (time_s < 36)],
                      ["not in view", "saturated", "colour"], "")  # fmt: skip
    return pa.table(
        {
            "frame": np.arange(600, dtype=np.int32),
            "time_s": time_s,
            "exposure_s": np.full(600, 0.005),
            "gain_db": np.zeros(600),
            "mode": mode.tolist(),
            "q1_command_deg": pan,
            "q2_command_deg": pan / 4,
            "q1_estimated_deg": pan - 0.5,
            "q2_estimated_deg": pan / 4,
            "q1_true_deg": pan - 0.6,
            "q2_true_deg": pan / 4 + 0.1,
            "beyond_reach": np.zeros(600, dtype=bool),
            "detected": found,
            "blobs": found.astype(np.int32),
            "blob_area_px": np.where(found, 45.0, np.nan),
            "centroid_x_px": np.where(found, 159.5 + error_x, np.nan),
            "centroid_y_px": np.where(found, 119.5 + error_y, np.nan),
            "predicted_x_px": np.where(np.isfinite(error_x), 159.5 + error_x + 1, np.nan),
            "predicted_y_px": np.where(np.isfinite(error_x), 119.5 + error_y, np.nan),
            "error_x_px": error_x,
            "error_y_px": error_y,
            "true_azimuth_deg": pan,
            "true_elevation_deg": pan / 2,
            "target_distance_m": np.full(600, 3.0),
            "gaze_azimuth_deg": pan - 0.6,
            "gaze_elevation_deg": pan / 2 + 0.2,
            "gaze_error_deg": np.where(found, 0.8 + 0.3 * np.sin(time_s), 8.0),
            "estimated_azimuth_deg": np.where(found, pan, np.nan),
            "estimated_elevation_deg": np.where(found, pan / 2, np.nan),
            "true_x_px": np.where(time_s < 15, nan, 160.5 + wave),
            "true_y_px": np.where(time_s < 15, nan, 116.5 + wave / 2),
            "target_visible_px": np.where(time_s < 15, 0, 50).astype(np.int32),
            "target_full_px": np.full(600, 50.0),
            "detector_true_px": np.where(time_s < 15, 0, 45).astype(np.int32),
            "detector_found_px": count,
            "detector_both_px": count,
            "detected_thing": ["target"] * 600,
            "saturated_fraction": np.zeros(600),
            "cause_of_loss": cause.tolist(),
        }
    )
