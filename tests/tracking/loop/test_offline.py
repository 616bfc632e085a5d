"""The loop over any camera: what it writes, that it ends well however it ends, and what it refuses."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path

import av
import cv2
import numpy as np
import pyarrow.parquet as pq
import pytest

from rigs import Rig
from tracking.loop import track_files
from tracking.loop.loop import TrackingLoop
from tracking.loop.offline import detector_named, track, until_interrupted, variant_named
from tracking.loop.variants import VARIANTS
from tracking.mirrors.recording import RecordingMirrors, ReplayedMirrors
from tracking.perception import Crop, ExactCorners
from tracking.protocols import CameraFrame
from tracking.records import Detection, Mode, Step

RIG = Rig.load("aqua2")
WIDTH, HEIGHT = 640, 480
FILES = {"log.parquet", "overlay.mp4", "track.json"}

CENTROID_PX = 0.5
"""The disc is drawn with a soft edge and read through the crop's own interpolation: half a pixel covers both."""


class Images:
    """Camera of images in memory; an exception among them is raised in its turn."""

    def __init__(self, camera_frames):
        self._camera_frames = iter(camera_frames)
        self.skipped, self.missing = 3, 4

    def read(self) -> CameraFrame | None:
        camera_frame = next(self._camera_frames, None)
        if isinstance(camera_frame, Exception):
            raise camera_frame
        return camera_frame


class StubLoop:
    """Says of every image that nothing is in it, and asks for pan = time / 100."""

    def step(self, camera_frame: CameraFrame, report) -> Step:
        return Step(
            time_s=camera_frame.time_s,
            mode=Mode.SCAN,
            q_estimated=report.q,
            q_command=np.array([camera_frame.time_s / 100, 0.0]),
            corners_px=np.full((4, 2), np.nan),
            crop=np.zeros((24, 32, 3), dtype=np.uint8),
            detection=Detection(mask=np.zeros((24, 32), dtype=np.uint8), blobs=(), centroid_px=None),
            predicted_px=None,
            error_px=None,
            beyond_reach=False,
            target_direction=None,
        )


def grey(number: int, *, width: int = WIDTH) -> CameraFrame:
    return CameraFrame(image=np.full((HEIGHT, width, 3), 60 + number, dtype=np.uint8), time_s=number / 30)


def run(folder: Path, camera_frames, **changes):
    mirrors = ReplayedMirrors([0.0], [[0.1, 0.2]])
    settings = {
        "rig": RIG,
        "about": {"source": "images"},
        "progress": lambda _done: None,
        "stopped": lambda: False,
        "mirrors": mirrors,
        "loop": StubLoop(),
    } | changes
    return track(Images(camera_frames), settings.pop("mirrors"), settings.pop("loop"), folder, **settings)


def times_of(video: Path) -> list[float]:
    with av.open(str(video)) as container:
        return [frame.time for frame in container.decode(video=0)]


@pytest.fixture(scope="module")
def ball_run(tmp_path_factory):
    """30 images with a red disc that wanders over the gaze mirror, while the mirror turns."""
    corners = ExactCorners(RIG)
    frames = np.arange(30)
    q = np.radians(np.column_stack([10 * np.sin(frames / 9), 5 * np.cos(frames / 7)]))
    places = np.column_stack([160 + 60 * np.sin(frames / 6), 120 + 40 * np.cos(frames / 5)])
    camera_frames = []
    for number, (joints, place) in enumerate(zip(q, places, strict=True)):
        image = np.full((HEIGHT, WIDTH, 3), 70, dtype=np.uint8)
        centre = Crop.of(corners.corners(joints)).to_image(place[np.newaxis])[0]
        cv2.circle(image, [round(16 * x) for x in centre.tolist()], 9 * 16, (200, 30, 25), -1, cv2.LINE_AA, 4)
        camera_frames.append(CameraFrame(image=image, time_s=number / 30))
    folder = tmp_path_factory.mktemp("ball") / "track"
    mirrors = RecordingMirrors(ReplayedMirrors(frames / 30, q))
    loop = TrackingLoop(RIG, variant_named("default", turning=False), detector=detector_named("narrow-hue"))
    result = run(folder, camera_frames, mirrors=mirrors, loop=loop)
    return folder, result, q, places, mirrors.table()


def test_the_log_says_where_the_target_was_in_the_crop(ball_run):
    folder, result, _, places, _ = ball_run
    table = pq.read_table(folder / "log.parquet")
    found = np.column_stack([table["centroid_x_px"], table["centroid_y_px"]])
    np.testing.assert_allclose(found, places, atol=CENTROID_PX)
    # Eqs. 11, 12: from the middle of the 320 x 240 crop.
    error = np.column_stack([table["error_x_px"], table["error_y_px"]])
    np.testing.assert_allclose(error, found - [159.5, 119.5], atol=1e-12)
    assert table["detected"].to_pylist() == [True] * 30
    assert result.detected == result.images == 30
    assert table["mode"].to_pylist()[-1] == "track"
    assert sum(result.modes.values()) == 30


def test_the_log_has_the_columns_that_need_no_truth_with_units(ball_run):
    folder, _, q, _, _ = ball_run
    table = pq.read_table(folder / "log.parquet")
    assert table.column_names == [
        *("frame", "time_s", "mode", "q1_command_deg", "q2_command_deg", "q1_estimated_deg", "q2_estimated_deg"),
        *(
            "beyond_reach",
            "detected",
            "blobs",
            "blob_area_px",
            "centroid_x_px",
            "centroid_y_px",
            "predicted_x_px",
            "predicted_y_px",
        ),
        *("error_x_px", "error_y_px", "estimated_azimuth_deg", "estimated_elevation_deg"),
        *("detector_found_px", "saturated_fraction"),
    ]
    assert all({b"unit", b"description"} <= field.metadata.keys() for field in table.schema)
    assert table["frame"].to_pylist() == list(range(30))
    assert table["time_s"].to_pylist() == [k / 30 for k in range(30)]
    estimated = np.column_stack([table["q1_estimated_deg"], table["q2_estimated_deg"]])
    np.testing.assert_allclose(estimated, np.degrees(q), atol=1e-12)
    # A disc of radius 9 px in the image; the mask is in the crop, a few times larger.
    assert min(table["detector_found_px"].to_pylist()) > np.pi * 9**2


def test_the_overlay_has_every_image_at_its_time(ball_run):
    folder, _, _, _, _ = ball_run
    assert times_of(folder / "overlay.mp4") == pytest.approx([k / 30 for k in range(30)], abs=1e-4)


def test_every_report_is_followed_by_its_command(ball_run):
    """Without a clock of its own, a recording's commands go out at the images' times."""
    table = ball_run[-1]
    assert table["event"].to_pylist() == ["report", "command"] * 30
    assert table["time_s"].to_pylist() == [k / 30 for k in range(30) for _ in range(2)]


def test_a_live_cameras_clock_times_the_commands(tmp_path):
    mirrors = RecordingMirrors(ReplayedMirrors([0.0], [[0.0, 0.0]]))
    clock = iter([10.0, 11.0])
    run(tmp_path / "out", [grey(0), grey(1)], mirrors=mirrors, clock=lambda: next(clock))
    assert mirrors.table()["time_s"].to_pylist() == [0.0, 10.0, 1 / 30, 11.0]


def test_the_summary_says_what_happened(tmp_path):
    seen = []
    result = run(tmp_path / "out", map(grey, range(5)), progress=seen.append)
    assert seen == [1, 2, 3, 4, 5]
    assert json.loads((tmp_path / "out" / "track.json").read_text()) == {
        "source": "images",
        "images": 5,
        "detected": 0,
        "modes": {"check": 0, "scan": 5, "track": 0, "predict": 0},
        "first_s": 0.0,
        "last_s": 4 / 30,
        "skipped": 3,
        "missing": 4,
        "interrupted": False,
    }
    assert result.frames_per_s == 5 / result.wall_s
    assert {path.name for path in (tmp_path / "out").iterdir()} == FILES


def test_the_same_images_give_the_same_bytes(tmp_path):
    for name in ("a", "b"):
        run(tmp_path / name, map(grey, range(20)))
    for file in FILES:
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()


def test_a_long_run_is_written_in_parts(tmp_path, monkeypatch):
    monkeypatch.setattr(track_files, "ROWS_PER_GROUP", 4)
    run(tmp_path, map(grey, range(10)))
    file = pq.ParquetFile(tmp_path / "log.parquet")
    assert [file.metadata.row_group(k).num_rows for k in range(file.num_row_groups)] == [4, 4, 2]
    assert file.read()["frame"].to_pylist() == list(range(10))


def whole(folder: Path, pictures: int) -> None:
    """Everything is there and can be read, and says that it was interrupted."""
    assert {path.name for path in folder.iterdir()} == FILES
    assert pq.read_table(folder / "log.parquet").num_rows == pictures
    assert len(times_of(folder / "overlay.mp4")) == pictures
    summary = json.loads((folder / "track.json").read_text())
    assert (summary["images"], summary["interrupted"]) == (pictures, True)


def test_stopped_it_ends_with_what_there_is(tmp_path):
    done = []
    result = run(tmp_path, map(grey, range(100)), progress=done.append, stopped=lambda: len(done) == 7)
    assert result.interrupted
    whole(tmp_path, 7)


@pytest.mark.parametrize("error", [OSError("the camera burns"), ValueError("of ours")])
def test_a_failure_loses_nothing_that_was_done(tmp_path, error):
    with pytest.raises(type(error), match=str(error)):
        run(tmp_path, [*map(grey, range(6)), error])
    whole(tmp_path, 6)


def test_a_failure_at_the_first_image_is_the_one_that_is_told(tmp_path, monkeypatch):
    def fails(*_: object) -> None:
        raise KeyError("a column of the log")

    monkeypatch.setattr(track_files, "overlay", fails)
    with pytest.raises(KeyError, match="a column of the log"):
        run(tmp_path, map(grey, range(3)))
    assert {path.name for path in tmp_path.iterdir()} == {"log.parquet", "track.json"}


def test_a_file_that_cannot_be_finished_leaves_nothing_half_written(tmp_path, monkeypatch):
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device", str(tmp_path))

    monkeypatch.setattr(track_files.TrackFiles, "_write_rows", full)
    with pytest.raises(OSError, match="No space left"):
        run(tmp_path, map(grey, range(6)))
    assert {path.name for path in tmp_path.iterdir()} == {"overlay.mp4"}
    assert len(times_of(tmp_path / "overlay.mp4")) == 6


def test_no_link_is_followed_and_what_a_killed_run_left_is_no_obstacle(tmp_path):
    elsewhere, folder = tmp_path / "elsewhere", tmp_path / "out"
    folder.mkdir()
    elsewhere.write_text("not ours")
    (folder / ".log.0123abcd.partial.parquet").write_text("half")
    (folder / "overlay.mp4").symlink_to(elsewhere)
    run(folder, map(grey, range(3)))
    assert elsewhere.read_text() == "not ours"
    assert {path.name for path in folder.iterdir()} == FILES


def test_an_earlier_run_is_replaced_and_other_files_are_left_alone(tmp_path):
    run(tmp_path, map(grey, range(3)))
    run(tmp_path, map(grey, range(4)))
    assert pq.read_table(tmp_path / "log.parquet").num_rows == 4
    (tmp_path / "thesis.tex").write_text("precious")
    with pytest.raises(FileExistsError, match=r"expected a new folder or that of an earlier run, found thesis\.tex"):
        run(tmp_path, map(grey, range(5)))
    assert pq.read_table(tmp_path / "log.parquet").num_rows == 4


def test_images_that_do_not_fit_are_refused_and_nothing_is_written(tmp_path):
    for camera_frames, message in [
        ([], "images: expected at least one image, got none that can be read"),
        ([grey(0, width=320)], "images: expected images of 640 x 480 px as rig 'aqua2' has them, got 320 x 480"),
    ]:
        with pytest.raises(ValueError, match=message):
            run(tmp_path / "out", camera_frames)
        assert not (tmp_path / "out").exists()


def test_a_image_of_another_size_on_the_way_ends_it(tmp_path):
    with pytest.raises(ValueError, match="got 320 x 480"):
        run(tmp_path, [grey(0), grey(1), grey(2, width=320)])
    whole(tmp_path, 2)


def test_the_first_interrupt_asks_and_the_second_insists():
    before = signal.getsignal(signal.SIGINT)
    with until_interrupted() as stopped:
        assert not stopped()
        os.kill(os.getpid(), signal.SIGINT)
        assert stopped()
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is before


def test_without_mirrors_to_turn_there_is_nothing_to_check():
    assert variant_named("paper", turning=True) is VARIANTS["paper"]
    assert variant_named("paper", turning=False).behaviour.check_s == 0
    with pytest.raises(ValueError, match="variant 'best': expected one of paper-literal, paper, default"):
        variant_named("best", turning=True)
    with pytest.raises(ValueError, match="detector 'blue': expected one of red-ball, narrow-hue, wide-hue"):
        detector_named("blue")
