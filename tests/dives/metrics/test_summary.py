"""Metrics of logs made by hand, each against what the definition gives on paper; bad logs; nothing but nan."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dives.metrics import DEFINITIONS, dive_metrics
from dives.metrics.frames import NUMBERS, Frames
from dives.metrics.holding import LOSS_FRAMES, losses, runs
from dives.metrics.pointing import ERRORS, POINTING_DEFINITIONS

DOCS = Path(__file__).parents[3] / "docs/reference/metrics.md"
EXACT = 1e-9
"""Sums and square roots of a few numbers in double precision."""


def flags(length: int, *parts: tuple[int, int]) -> np.ndarray:
    """Array of false with true from first to end of each part."""
    array = np.zeros(length, dtype=bool)
    for first, end in parts:
        array[first:end] = True
    return array


def test_a_perfect_dive(make_log):
    found = dive_metrics(make_log(100))
    assert found["duration_s"] == pytest.approx(10.0, abs=EXACT)
    assert found["acquired"] is True
    assert found["acquisition_time_s"] == 0.0
    for name in ("time_on_target_fraction", "visible_fraction", "found_fraction", "pixel_f1", "frame_f1"):
        assert found[name] == 1.0
    assert found["losses"] == 0
    assert found["recovered_fraction"] is None
    assert found["gaze_error_rms_deg"] == found["crop_error_max_px"] == found["estimated_direction_error_p99_deg"] == 0
    # Nothing moves, so nothing tells a lag.
    assert found["target_to_gaze_lag_s"] is None


def test_acquisition_waits_for_the_target_itself(make_log):
    """A detection beside the target, and the target found while scanning, do not count: both come before frame 40."""
    mode = ["check"] * 20 + ["scan"] * 10 + ["track"] * 70
    both = np.full(100, 40)
    both[30:40] = 0
    found = dive_metrics(make_log(100, mode=mode, detector_both_px=both))
    assert found["acquisition_time_s"] == pytest.approx(4.0, abs=EXACT)
    assert found["search_time_s"] == pytest.approx(2.0, abs=EXACT)
    assert found["time_on_target_s"] == pytest.approx(6.0, abs=EXACT)
    assert found["frame_precision"] == found["frame_recall"] == 0.9


def test_following_something_else_is_no_holding(make_log):
    """Frames 0-39 on a coral while the target is in view, then on the target, predicted from 60, on a fish from 80."""
    wrong = flags(100, (0, 40), (80, 100))
    predicted = flags(100, (60, 80))
    log = make_log(
        100,
        detector_both_px=np.where(wrong, 0, 40),
        detected=~predicted,
        mode=np.where(predicted, "predict", "track").tolist(),
    )
    found = dive_metrics(log)
    assert found["acquisition_time_s"] == pytest.approx(4.0, abs=EXACT)
    assert found["false_tracking_s"] == pytest.approx(6.0, abs=EXACT)
    assert found["false_tracking_fraction"] == pytest.approx(0.6, abs=EXACT)
    assert found["time_on_target_fraction"] == pytest.approx(40 / 60, abs=EXACT)
    assert found["losses"] == 1


def test_time_beyond_reach_is_that_of_a_loop_that_follows(make_log):
    mode = ["scan"] * 10 + ["track"] * 10 + ["predict"] * 10
    found = dive_metrics(make_log(30, mode=mode, beyond_reach=flags(30, (5, 10), (18, 25))))
    assert found["beyond_reach_s"] == pytest.approx(0.7, abs=EXACT)


def test_losses_and_getting_it_back(make_log):
    """Frames 20-30 out of view (11 frames), 40-44 too (five: no loss), 60-79 visible but scanning, 90-99 to the end."""
    gone = flags(100, (20, 31), (40, 45), (90, 100))
    scanning = flags(100, (60, 80))
    log = make_log(
        100,
        target_visible_px=np.where(gone, 0, 50),
        detected=~gone & ~scanning,
        mode=np.where(scanning, "scan", np.where(gone, "predict", "track")).tolist(),
        cause_of_loss=np.where(gone, "slewing", np.where(scanning, "colour", "")).tolist(),
    )
    assert LOSS_FRAMES == 5
    found = dive_metrics(log)
    assert found["losses"] == 3
    assert found["losses_reacquired"] == 2
    assert found["recovered_fraction"] == pytest.approx(2 / 3, abs=EXACT)
    assert found["reacquisition_times_s"] == pytest.approx([1.1, 2.0], abs=EXACT)
    assert found["reacquisition_time_mean_s"] == pytest.approx(1.55, abs=EXACT)
    assert found["reacquisition_time_max_s"] == pytest.approx(2.0, abs=EXACT)
    assert found["lost_time_s"] == pytest.approx(1.1 + 2.0 + 1.0, abs=EXACT)
    assert found["visible_fraction"] == pytest.approx(1 - 26 / 100, abs=EXACT)
    assert found["time_on_target_fraction"] == pytest.approx(1 - 46 / 100, abs=EXACT)
    assert found["loss_causes"] == {"slewing": 2, "colour": 1}
    assert found["not_found_causes_frames"] == {"slewing": 26, "colour": 20}


def test_causes_are_counted_without_an_acquisition(make_log):
    """10 frames of check in which nothing can be found, 20 of scan in which the target is seen in five."""
    cause = ["not in view"] * 25 + ["colour"] * 5
    log = make_log(30, cause_of_loss=cause, mode=["check"] * 10 + ["scan"] * 20, detected=np.zeros(30, dtype=bool))
    found = dive_metrics(log)
    assert not found["acquired"]
    assert found["not_found_causes_frames"] == {"not in view": 15, "colour": 5}


def test_a_loss_is_due_to_what_ended_the_detections(make_log):
    """Blown out from frame 20 on, bridged by prediction; out of view, and lost, from frame 30 on."""
    cause = [""] * 20 + ["saturated"] * 10 + ["not in view"] * 20
    mode = ["track"] * 20 + ["predict"] * 30
    visible = np.r_[np.full(30, 50), np.zeros(20)]
    log = make_log(50, cause_of_loss=cause, mode=mode, detected=flags(50, (0, 20)), target_visible_px=visible)
    (loss,) = losses(Frames.of(log))
    assert (loss.first, loss.end, loss.reacquired, loss.cause) == (30, 50, False, "saturated")


def test_a_target_found_unseen_in_the_first_frame_is_lost_from_there_on(make_log):
    """As a log says whose visible pixels were not counted: the loss begins with the acquisition."""
    cause = [""] + ["too dark"] * 9
    log = make_log(10, target_visible_px=np.zeros(10, dtype=np.int32), cause_of_loss=cause)
    assert dive_metrics(log)["loss_causes"] == {"too dark": 1}


def test_time_counts_not_frames(make_log):
    """Frames at 0, 1, 2, 12, 13 s: dropped ones before the fourth. The third lasts 10 s; it is not visible."""
    found = dive_metrics(make_log(5, time_s=[0.0, 1.0, 2.0, 12.0, 13.0], target_visible_px=[9, 9, 0, 9, 9]))
    assert found["duration_s"] == 14.0
    assert found["visible_fraction"] == pytest.approx(4 / 14, abs=EXACT)


def test_spread_of_an_error(make_log):
    """0, 1, ... 100 degrees: the root mean square is sqrt(100 * 201 / 6), percentiles are the numbers themselves."""
    error = np.arange(101.0)
    found = dive_metrics(make_log(101, gaze_error_deg=error))
    assert found["gaze_error_rms_deg"] == pytest.approx(math.sqrt(100 * 201 / 6), abs=EXACT)
    assert [found[f"gaze_error_{kind}_deg"] for kind in ("p50", "p95", "p99", "max")] == pytest.approx(
        [50, 95, 99, 100], abs=EXACT
    )


def test_errors_count_from_the_acquisition_and_while_held(make_log):
    error = np.r_[np.full(10, 90.0), np.full(10, 3.0), np.full(10, 4.0)]
    mode = ["scan"] * 10 + ["track"] * 10 + ["predict"] * 10
    visible = np.r_[np.full(20, 50), np.zeros(10)]
    found = dive_metrics(make_log(30, gaze_error_deg=error, mode=mode, target_visible_px=visible))
    assert found["gaze_error_rms_deg"] == pytest.approx(math.sqrt((9 + 16) / 2), abs=EXACT)
    assert found["gaze_error_held_rms_deg"] == pytest.approx(3.0, abs=EXACT)


def test_pixels_against_truth(make_log):
    """The centroid lies (3, 4) px beside the truth, the truth (6, 8) px beside the crop's centre, wherever that is."""
    n, nan = 20, np.nan
    true = {"true_x_px": np.full(n, 106.0), "true_y_px": np.full(n, 88.0)}
    centroid = {"centroid_x_px": np.full(n, 109.0), "centroid_y_px": np.full(n, 92.0)}
    error = {"error_x_px": np.full(n, 9.0), "error_y_px": np.full(n, 12.0)}
    # A frame without a detection: its error is that of the prediction, which says nothing of the centre.
    detected = ~flags(n, (7, 8))
    centroid["centroid_x_px"][7] = centroid["centroid_y_px"][7] = nan
    error["error_x_px"][7] = 77.0
    found = dive_metrics(make_log(n, **true, **centroid, **error, detected=detected))
    assert found["detected_error_rms_px"] == pytest.approx(5.0, abs=EXACT)
    assert found["crop_error_p50_px"] == pytest.approx(10.0, abs=EXACT)


def test_estimated_direction(make_log):
    """Straight up and level are 90 degrees apart whatever the azimuth; a micro-degree keeps its digits."""
    up = dive_metrics(make_log(3, estimated_elevation_deg=[90.0] * 3, estimated_azimuth_deg=[77.0, -3.0, 12.0]))
    assert up["estimated_direction_error_max_deg"] == pytest.approx(90.0, abs=EXACT)
    near = dive_metrics(make_log(3, estimated_azimuth_deg=[1e-6] * 3))
    assert near["estimated_direction_error_rms_deg"] == pytest.approx(1e-6, rel=1e-6)


def test_detector_rates(make_log):
    """Pixels pooled: 30 of 100 found right, 120 true. Frames: 4 detected, 5 with target, 3 hits."""
    log = make_log(
        6,
        detected=[True, True, True, True, False, False],
        detector_true_px=[40, 20, 20, 20, 20, 0],
        detector_found_px=[40, 20, 20, 20, 0, 0],
        detector_both_px=[10, 10, 10, 0, 0, 0],
    )
    found = dive_metrics(log)
    assert found["pixel_precision"] == pytest.approx(30 / 100, abs=EXACT)
    assert found["pixel_recall"] == pytest.approx(30 / 120, abs=EXACT)
    assert found["pixel_f1"] == pytest.approx(60 / 220, abs=EXACT)
    assert (found["frame_precision"], found["frame_recall"]) == (3 / 4, 3 / 5)
    assert found["frame_f1"] == pytest.approx(6 / 9, abs=EXACT)


def test_never_acquired_is_none_and_json(make_log):
    n = 10
    nothing = {name: np.full(n, np.nan) for name in NUMBERS if name != "time_s"}
    found = dive_metrics(make_log(n, mode=["scan"] * n, detected=np.zeros(n, dtype=bool), **nothing))
    assert found["acquired"] is False
    # What was never acquired was never lost: that is no praise.
    for name in ("losses", "losses_reacquired", "recovered_fraction", "lost_time_s"):
        assert found[name] is None
    for name in ("acquisition_time_s", "visible_fraction", "gaze_error_rms_deg", "crop_error_max_px", "frame_recall"):
        assert found[name] is None
    assert json.loads(json.dumps(found, allow_nan=False)) == found


def test_one_frame_is_enough(make_log):
    found = dive_metrics(make_log(1))
    assert found["duration_s"] == 0.0
    assert found["visible_fraction"] is None


def test_nulls_are_missing_numbers(make_log):
    log = make_log(3, gaze_error_deg=pa.array([3.0, None, 4.0]))
    assert dive_metrics(log)["gaze_error_rms_deg"] == pytest.approx(math.sqrt(12.5), abs=EXACT)


def test_every_key_has_a_definition_and_stands_in_the_manual(make_log):
    assert list(dive_metrics(make_log(5))) == list(DEFINITIONS)
    manual = DOCS.read_text(encoding="utf-8")
    plain = [name for name in DEFINITIONS if name not in POINTING_DEFINITIONS]
    assert [name for name in (*plain, *ERRORS) if f"`{name}`" not in manual] == []


def test_every_problem_of_a_log_at_once(make_log):
    log = make_log(3, gaze_error_deg=["a", "b", "c"]).drop_columns(["mode", "detected"])
    with pytest.raises(ValueError, match="gaze_error_deg: expected numbers, got string") as error:
        dive_metrics(log)
    assert "mode: expected a column of text" in str(error.value)
    assert "detected: expected a column of true or false" in str(error.value)


@pytest.mark.parametrize("times", [[0.0, 1.0, 1.0], [0.0, np.nan, 1.0], [1.0, 0.5, 2.0]])
def test_times_must_rise(make_log, times):
    with pytest.raises(ValueError, match="times that rise"):
        dive_metrics(make_log(3, time_s=times))


def test_an_empty_log_is_refused(make_log):
    with pytest.raises(ValueError, match="at least one frame"):
        dive_metrics(make_log(3).slice(0, 0))


@given(st.lists(st.booleans(), max_size=40))
def test_runs_put_together_again(values):
    array = np.array(values, dtype=bool)
    again = flags(len(array), *runs(array))
    assert (again == array).all()
    # Runs are as long as they can be: between two there is a gap.
    assert all(end < first for (_, end), (first, _) in zip(runs(array), runs(array)[1:], strict=False))


@given(st.lists(st.tuples(st.booleans(), st.booleans()), min_size=1, max_size=60), st.integers(0, 8))
def test_time_on_target_and_losses_add_up(states, loss_frames):
    """Held time, losses and the gaps too short to be one make up the time from the acquisition on."""
    # hypothesis calls the body often, which a function-scoped fixture does not allow: the log is made by hand here.
    n = len(states)
    visible, following = np.array(states).T
    frames = Frames(
        numbers={"time_s": np.arange(n) / 10},
        mode=np.where(following, "track", "scan"),
        cause=np.full(n, ""),
        thing=np.full(n, "target"),
        lasts_s=np.full(n, 0.1),
        visible=visible,
        detected=visible,
        found=visible,
        following=following,
        beyond_reach=np.zeros(n, dtype=bool),
        on_target=np.ones(n, dtype=bool),
    )
    lost = losses(frames, loss_frames=loss_frames)
    gaps = [end - first for first, end in runs(~frames.held & frames.after_acquisition)]
    short = sum(gap for gap in gaps if gap <= loss_frames)
    whole = int(frames.after_acquisition.sum())
    assert (
        round(sum(loss.duration_s for loss in lost) * 10) + short + int((frames.held & frames.after_acquisition).sum())
        == whole
    )
    assert sum(not loss.reacquired for loss in lost) <= 1


def test_time_on_something_else_is_told_by_what_it_was(make_log):
    """The target for a second, then a coral for two and a decoy for one, which is predicted for half of another."""
    thing = ["target"] * 10 + ["world"] * 20 + ["decoy"] * 10 + [""] * 5
    met = np.where(np.arange(45) < 10, 40, 0).astype(np.int32)
    log = make_log(45, detected_thing=thing, detector_both_px=met, detected=np.arange(45) < 40)
    metrics = dive_metrics(log)
    assert metrics["false_tracking_things_s"] == pytest.approx({"world": 2.0, "decoy": 1.5})
    assert list(metrics["false_tracking_things_s"]) == ["world", "decoy"]
