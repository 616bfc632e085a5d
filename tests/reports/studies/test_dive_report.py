"""The page of a dive: its numbers, its key frames and why the target was not found; bad folders in a sentence."""

from __future__ import annotations

import json

import av
import cv2
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from dives.metrics import dive_metrics
from dives.metrics.frames import Frames
from reports.pages.dive import dive_section, verdict
from reports.pages.page import html
from reports.studies.dive_report import dive_results, write_dive_report
from reports.studies.key_frames import key_frames, save_key_frames

DIVE = 'name = "by-hand"\ndescription = "made by hand"\nrig = "aqua2"\ndepth_m = 8.0\nvariant = "default"\nseed = 3\n'

LEVELS = 200
"""Grey levels that number the overlay's frames: frame k is k modulo this, plus 20."""

CODING = 3
"""Levels by which H.264 may change a flat grey image, colour conversion included."""


def frame_level(frame):
    return frame % LEVELS + 20


def write_overlay(path, count):
    with av.open(path, "w") as container:
        stream = container.add_stream("libx264", rate=10, options={"crf": "10", "preset": "ultrafast"})
        stream.width, stream.height, stream.pix_fmt = 64, 32, "yuv420p"
        for frame in range(count):
            image = np.full((32, 64, 3), frame_level(frame), dtype=np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image)))
        container.mux(stream.encode(None))


def write_folder(folder, log):
    folder.mkdir()
    (folder / "dive.toml").write_text(DIVE)
    (folder / "rig.toml").write_text('name = "aqua2"')
    pq.write_table(log, folder / "log.parquet")
    (folder / "metrics.json").write_text(json.dumps(dive_metrics(log)))
    return folder


@pytest.fixture
def folder(tmp_path, dive_log):
    made = write_folder(tmp_path / "dive", dive_log)
    write_overlay(made / "overlay.mp4", dive_log.num_rows)
    return made


@pytest.fixture
def dark_log(dive_log):
    """The same dive with nothing found: 20 detections that are not the target, too dark to see it, or no view of it."""
    detected = np.arange(600) % 30 == 0
    new = {
        "detected": detected,
        "mode": ["check"] * 50 + ["scan"] * 550,
        "cause_of_loss": ["not in view"] * 150 + ["too dark"] * 450,
        "detector_both_px": np.zeros(600, dtype=np.int32),
    }
    log = dive_log
    for name, values in new.items():
        log = log.set_column(log.column_names.index(name), name, pa.array(values))
    return log


def test_key_frames_are_acquisition_largest_error_and_losses(dive_log):
    # The log finds from 15 s, ten frames a second; it stops holding at 33 s, where it scans, and holds again at 36 s.
    frames = key_frames(Frames.of(dive_log))
    assert [(frame.name, frame.frame) for frame in frames] == [
        ("acquisition", 150),
        ("largest_error", 300),
        ("loss_1", 330),
    ]
    assert frames[1].caption == "30.0 s: largest error while held, 8.0°"
    assert frames[2].caption == "33.0 s: loss (saturated), held again after 3.0 s"


def test_a_dive_without_acquisition_has_key_frames_too(dark_log):
    frames = key_frames(Frames.of(dark_log))
    assert [(frame.name, frame.frame) for frame in frames] == [("first_detection", 0), ("not_found", 150)]
    assert "too dark" in frames[1].caption


def test_images_are_the_key_frames(folder, dive_log, tmp_path):
    frames = key_frames(Frames.of(dive_log))
    shown = save_key_frames(folder / "overlay.mp4", frames, tmp_path / "key_frames")
    for frame, (file, caption) in zip(frames, shown, strict=True):
        assert caption == frame.caption
        assert abs(float(cv2.imread(str(file)).mean()) - frame_level(frame.frame)) < CODING


def test_the_section_has_numbers_figures_images_and_losses(folder):
    section = html(dive_section(dive_results(folder), folder))
    metrics = json.loads((folder / "metrics.json").read_text())
    assert "Dive: by-hand" in section
    assert f"{metrics['visible_fraction']:.1%}" in section
    assert f"{metrics['gaze_error_held_rms_deg']:.2f}°" in section
    assert "1 of 1" in section
    assert section.count("data:image/png;base64,") == 3 + 3 + 1
    assert '<source src="overlay.mp4" type="video/mp4">' in section
    assert "<td>saturated</td>" in section
    # 550 frames after the check; 100 of them before the target came into view, 30 each in the sun and off colour.
    for cause, count in (("not in view", 100), ("saturated", 30), ("colour", 30)):
        assert f'<td>{cause}</td><td class="number">{count}</td><td class="number">{count / 550:.1%}</td>' in section


def test_the_page_stands_alone_and_comes_out_the_same(folder):
    report = write_dive_report(folder)
    first = report.read_bytes()
    assert b"<html" in first and b"http://" not in first and b"https://" not in first
    assert write_dive_report(folder).read_bytes() == first
    assert not list(folder.rglob(".*"))


def test_the_verdict_says_why_a_dive_failed(dark_log):
    words = verdict(dive_metrics(dark_log), Frames.of(dark_log))
    assert words == (
        "The target was never tracked. The detector met it in 0 of the 450 frames that had it in the crop; why not in"
        " the others: too dark (450)."
    )


def test_the_verdict_of_a_target_that_never_came_into_the_crop(dark_log):
    never = dark_log
    for name, value in (("detector_true_px", 0), ("cause_of_loss", "not in view")):
        never = never.set_column(never.column_names.index(name), name, pa.array([value] * 600))
    words = verdict(dive_metrics(never), Frames.of(never))
    assert words == "The target was never tracked. It never came into the crop: not in view (550)."


def test_the_verdict_of_a_dive_with_a_loss(dive_log):
    words = verdict(dive_metrics(dive_log), Frames.of(dive_log))
    # Held but for 3 s of the 45 s from the acquisition on.
    assert words == (
        "The target was held 93.3% of the time from the acquisition on. It was lost once and found again. "
        "Causes: saturated (1)."
    )


def test_a_dark_dive_and_one_without_overlay_have_a_page(tmp_path, dark_log):
    dark = write_folder(tmp_path / "dark", dark_log)
    section = html(dive_section(dive_results(dark), dark))
    assert section.count("data:image/png;base64,") == 3
    assert "never tracked" in section


def test_missing_files_are_named_together(folder):
    for name in ("metrics.json", "log.parquet"):
        (folder / name).unlink()
    with pytest.raises(ValueError, match=r"without log\.parquet, without metrics\.json"):
        write_dive_report(folder)


def test_an_overlay_that_is_cut_short_is_reported(folder, dive_log, tmp_path):
    frames = key_frames(Frames.of(dive_log))
    write_overlay(folder / "overlay.mp4", 200)
    with pytest.raises(ValueError, match=r"overlay\.mp4: expected at least 331 frames.*cut short"):
        save_key_frames(folder / "overlay.mp4", frames, tmp_path)
    (folder / "overlay.mp4").write_bytes(b"nothing")
    with pytest.raises(ValueError, match=r"overlay\.mp4: expected a video"):
        save_key_frames(folder / "overlay.mp4", frames, tmp_path)
