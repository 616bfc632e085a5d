"""A dive detected again: the same settings give the same log, others what they must, and bad records a sentence."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace

import av
import numpy as np
import pyarrow.compute as pc
import pytest

from dives import Dive, run_dive
from dives.evaluation import redetection
from dives.evaluation.redetection import Recording, changed_settings, compared, redetect
from rigs.files import preset_path
from scenes.baking.light_quality import LightQuality
from tracking.cameras import VideoCamera
from tracking.log import read_log
from tracking.loop.ablations import LOOPS
from tracking.loop.variants import VARIANTS
from tracking.perception import RED_BALL, WIDE_HUE
from tracking.video import VideoWriter

FRAMES = 30

DIVE = f"""
name = "short"
rig = "small.toml"
seed = 3
world = "tank"
depth_m = 1.5
duration_s = {FRAMES / 30}
variant = "unchecked"
overlay = false
[robot]
motion = "hover"
[detector]
area_min_px = 100
[target]
[target.path]
shape = "straight"
start_m = [0.70, -0.73, 0.40]
velocity_m_per_s = [0.1, 0.0, 0.0]
"""
"""On the mirror's way from where this seed's servos stand at power-on to where the scan begins: 1.0 m from the gaze
mirror, 69 degrees to the right and 32 up."""

SMALLER = {
    "width_px = 640": "width_px = 320",
    "height_px = 480": "height_px = 240",
    "fx_px = 500.0": "fx_px = 250.0",
    "fy_px = 500.0": "fy_px = 250.0",
    "cx_px = 319.5": "cx_px = 159.5",
    "cy_px = 239.5": "cy_px = 119.5",
}


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Folder of a dive of one second whose loop scans at once, at a quarter of aqua2's pixels."""
    folder = tmp_path_factory.mktemp("dive")
    rig = preset_path("aqua2").read_text(encoding="utf-8")
    for before, after in SMALLER.items():
        assert before in rig
        rig = rig.replace(before, after)
    (folder / "small.toml").write_text(rig, encoding="utf-8")
    (folder / "short.toml").write_text(DIVE, encoding="utf-8")
    default = VARIANTS["default"]
    with pytest.MonkeyPatch.context() as patch:
        unchecked = replace(default.without_check(), likely_first=False)
        patch.setitem(LOOPS, "unchecked", unchecked)
        yield run_dive(Dive.load(folder / "short.toml"), folder / "out", quality=LightQuality.coarse())


def again(recorded, folder, settings):
    """Log and comparison of a dive detected again."""
    comparison = redetect(recorded, folder, settings, progress=lambda *_: None)
    return read_log(folder), comparison


def test_the_same_settings_give_the_same_log(recorded, tmp_path):
    """Images, crops and truth come back bit by bit; but an error that a prediction had is no detection's."""
    before = read_log(recorded)
    settings = Dive.load(recorded / "dive.toml").detector_settings()
    after, comparison = again(recorded, tmp_path / "again", settings)
    assert 2 < comparison["recorded"]["frames_found"] < FRAMES  # it is seen in some, so that there is something to say
    assert comparison["recorded"] == comparison["again"]
    assert {value for value in comparison["gain"].values() if value is not None} == {0}
    detected = pc.field("detected")
    for name in before.column_names:
        only = detected if name.startswith("error_") else pc.scalar(True)
        first, second = (np.asarray(log.filter(only)[name].to_pylist()) for log in (before, after))
        assert np.array_equal(first, second, equal_nan=first.dtype.kind == "f"), name
    assert after.schema.equals(before.schema.remove_metadata(), check_metadata=False)


def test_a_window_that_nothing_passes_finds_nothing(recorded, tmp_path):
    before = read_log(recorded)
    nothing = replace(RED_BALL, window=replace(RED_BALL.window, value_min=0.0, value_max=0.0))
    folder = tmp_path / "again"
    after, comparison = again(recorded, folder, nothing)
    assert comparison["again"]["frames_detected"] == 0
    assert comparison["again"]["frame_recall"] == 0.0
    assert comparison["again"]["frame_precision"] is None
    assert comparison["gain"]["frame_recall"] == -comparison["recorded"]["frame_recall"]
    assert comparison["gain"]["frame_precision"] is None
    # What was found is now missed for its colour; why the rest was missed, the record knows better.
    for was, now in zip(before["cause_of_loss"].to_pylist(), after["cause_of_loss"].to_pylist(), strict=True):
        assert now == (was or "colour")
    # What the loop did is as it was recorded.
    assert after["mode"] == before["mode"]
    assert after["q1_command_deg"] == before["q1_command_deg"]
    # And it is all written down, with a video.
    assert sorted(path.name for path in folder.iterdir()) == ["comparison.json", "log.parquet", "overlay.mp4"]
    assert json.loads((folder / "comparison.json").read_text()) == comparison
    with av.open(str(folder / "overlay.mp4")) as video:
        assert sum(1 for _ in video.decode(video=0)) == FRAMES


def test_a_gain_is_what_one_has_over_the_other(recorded):
    log = read_log(recorded)
    without = log.set_column(
        log.schema.get_field_index("detected"), log.schema.field("detected"), pc.and_(log["detected"], False)
    )
    found = compared(without, log)
    assert found["gain"]["frames_found"] == found["again"]["frames_found"] > 0
    assert found["gain"]["detected_error_rms_px"] is None


@pytest.fixture
def copy(recorded, tmp_path):
    """The recorded dive once more, to be spoilt."""
    return shutil.copytree(recorded, tmp_path / "copy")


def shortened(copy, count):
    """Write the video again with the first images only."""
    camera = VideoCamera(copy / "video.mkv")
    camera_frames = [camera.read() for _ in range(count)]
    camera.close()
    writer = VideoWriter(copy / "video.mkv", "ffv1", 30)
    for camera_frame in camera_frames:
        writer.write(camera_frame.image)
    writer.close()


def test_a_missing_image_is_told(copy):
    shortened(copy, 2)
    with pytest.raises(ValueError, match="an image for each row of its log, row 2 has none"):
        list(Recording(copy).camera_frames())


def test_what_breaks_off_leaves_nothing(recorded, tmp_path, monkeypatch):
    def broken(*_, **__):
        raise OSError("No space left on device")
        yield

    monkeypatch.setattr(redetection, "detect_again", broken)
    with pytest.raises(OSError, match="No space left"):
        again(recorded, tmp_path / "again", RED_BALL)
    assert [path.name for path in tmp_path.iterdir() if "again" in path.name] == []


def test_images_that_were_compressed_are_refused(copy):
    file = copy / "dive.toml"
    file.write_text(file.read_text().replace('video = "ffv1"', 'video = "h264"'))
    with pytest.raises(ValueError, match="which keep images as they were, got video = 'h264'"):
        Recording(copy)


def test_a_folder_without_a_dive_is_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"expected a finished dive, found no log\.parquet"):
        Recording(tmp_path)


def test_settings_to_detect_with(recorded):
    dive = Dive.load(recorded / "dive.toml")
    known = {"over_water": dive.detector.over_water, "least_speed_m_per_s": dive.detector.least_speed_m_per_s}
    assert None not in known.values()
    assert changed_settings(dive, "wide-hue", {}) == replace(WIDE_HUE, **known)
    changed = changed_settings(dive, None, {"hue_to_deg": 30.0, "aspect_max": 4.0})
    window = replace(RED_BALL.window, hue_to_deg=30.0)
    assert changed == replace(RED_BALL, window=window, aspect_max=4.0, **known)
    with pytest.raises(ValueError, match="no \\[offline_detector\\]"):
        changed_settings(dive, None, {})
    with pytest.raises(ValueError, match="detector 'blue': expected one of"):
        changed_settings(dive, "blue", {})
    with pytest.raises(ValueError, match="expected hue_to_deg from 0 to 360, got 400"):
        changed_settings(dive, None, {"hue_to_deg": 400.0})
