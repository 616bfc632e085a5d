"""Dives that are stopped: nothing finished is lost, and the files do not tell.

Eight small images in segments of three. What a dive must withstand is what stops it in earnest: a killed process, a
full disk, an image that cannot be made, and the same while the segments are being put together.
"""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from dives import files, journal, recorder, rendered_camera, runner
from dives.dive import Dive, varied
from dives.runner import DiveStoppedError, run_dive
from tracking.log import read_log

pytestmark = pytest.mark.usefixtures("rough_light")

FRAMES = 8
WRITTEN = {"dive.toml", "log.parquet", "metrics.json", "overlay.mp4", "rig.toml", "video.mkv"}

KILLED = """
import os, signal, sys, time
from pathlib import Path
from scenes.baking.light_quality import LightQuality
from dives import journal
from dives.runner import run_dive
from dives.dive import parse_dive

LightQuality.full = LightQuality.coarse  # as `rough_light`
journal.SEGMENT_FRAMES = 3
folder = Path(sys.argv[1])
dive = parse_dive((folder / "small_dive.toml").read_text(), source="small", folder=folder)

def progress(done, total):
    if done == 5:
        while not (Path(sys.argv[2]) / "journal/000000.snapshot.json").exists():
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGKILL)

run_dive(dive, sys.argv[2], progress=progress)
"""


class StoppedError(BaseException):
    """As Ctrl-C: nothing in the dive may catch it."""


@pytest.fixture(scope="module", autouse=True)
def _short_segments():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(journal, "SEGMENT_FRAMES", 3)
        yield


@pytest.fixture(scope="module", autouse=True)
def _one_renderer_for_all():
    """A renderer keeps nothing from image to image, and takes longer to make than a dive of eight."""
    made: dict[str, object] = {}

    def once(name):
        make = getattr(rendered_camera, name)
        return lambda *given: made[name] if name in made else made.setdefault(name, make(*given))

    with pytest.MonkeyPatch.context() as patch:
        for name in ("prepare", "FastRenderer"):
            patch.setattr(rendered_camera, name, once(name))
        yield


def bytes_of(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def stop_after(frames: int):
    def progress(done: int, total: int) -> None:
        if done == frames:
            raise StoppedError

    return progress


@pytest.fixture(scope="module")
def whole(small_dive: Dive, tmp_path_factory) -> dict[str, bytes]:
    """Files of the dive that nobody stopped."""
    return bytes_of(run_dive(small_dive, tmp_path_factory.mktemp("whole") / "dive"))


def test_a_dive_writes_what_it_says(small_dive, whole, tmp_path):
    assert set(whole) == WRITTEN
    (tmp_path / "log.parquet").write_bytes(whole["log.parquet"])
    table = read_log(tmp_path)
    assert table.column("frame").to_pylist() == list(range(FRAMES))


def test_without_video_the_loop_does_the_same(small_dive, whole, tmp_path):
    """Only the gaze mirror is rendered; every column of the log is as with the video, to the bit."""
    folder = run_dive(varied(small_dive, video=False), tmp_path / "fast")
    assert set(bytes_of(folder)) == WRITTEN - {"overlay.mp4", "video.mkv"}
    (tmp_path / "log.parquet").write_bytes(whole["log.parquet"])
    # As text: what is not a number is not equal to itself.
    assert repr(read_log(folder).to_pylist()) == repr(read_log(tmp_path).to_pylist())


def test_stopped_again_and_again_it_goes_on_to_the_same_bytes(small_dive, whole, tmp_path):
    """Before the first segment's end, behind it, and after the last image; each time a new loop takes over."""
    said: list[str] = []
    for frames in (1, 5, 8):
        with pytest.raises(StoppedError):
            run_dive(small_dive, tmp_path / "dive", log=said.append, progress=stop_after(frames))
        assert not (tmp_path / "dive" / "log.parquet").exists()
    assert bytes_of(run_dive(small_dive, tmp_path / "dive", log=said.append)) == whole
    # From the last segment that had ended, also when it was still on its way to the disk.
    assert [sentence.rsplit(" from frame ")[-1] for sentence in said if "going on" in sentence] == ["3 of 8"]


@pytest.mark.skipif(os.name != "posix", reason="SIGKILL")
def test_killed_it_goes_on_to_the_same_bytes(small_dive, small_folder, whole, tmp_path):
    """A process killed by the system has closed and flushed nothing; another one goes on."""
    (small_folder / "small_dive.toml").write_text(small_dive.as_toml())
    arguments = [sys.executable, "-c", KILLED, str(small_folder), str(tmp_path / "dive")]
    killed = subprocess.run(arguments, capture_output=True, text=True, check=False)
    assert killed.returncode == -signal.SIGKILL, killed.stderr
    assert (tmp_path / "dive/journal/000000.snapshot.json").exists()
    assert not (tmp_path / "dive/journal/000001.snapshot.json").exists()
    assert bytes_of(run_dive(small_dive, tmp_path / "dive")) == whole


@pytest.mark.parametrize("name", ["write_table", "VideoWriter"])
def test_a_full_disk_loses_nothing_that_was_finished(small_dive, whole, tmp_path, monkeypatch, name):
    """In the second segment, at its rows or at its video."""
    calls: list[object] = []
    writes = getattr(recorder, name)
    # Rows are written once a segment, a video and an overlay are begun.
    before = {"write_table": 1, "VideoWriter": 2}[name]

    def full(*given, **named):
        calls.append(given)
        if len(calls) > before:
            raise OSError(errno.ENOSPC, "No space left on device")
        return writes(*given, **named)

    with monkeypatch.context() as patch:
        patch.setattr(recorder, name, full)
        with pytest.raises(DiveStoppedError, match=r"No space left on device. 3 of 8 frames are kept; the same"):
            run_dive(small_dive, tmp_path / "dive")
    assert bytes_of(run_dive(small_dive, tmp_path / "dive")) == whole


def test_a_image_that_cannot_be_made_loses_nothing_that_was_finished(small_dive, whole, tmp_path, monkeypatch):
    """The sensor refuses light that is not a number."""
    read, taken = rendered_camera.read_out, []

    def broken(sweeps, *given):
        taken.append(1)
        if len(taken) == 5:
            sweeps = [[channel * float("nan") for channel in channels] for channels in sweeps]
        return read(sweeps, *given)

    with monkeypatch.context() as patch:
        patch.setattr(rendered_camera, "read_out", broken)
        with pytest.raises(DiveStoppedError, match="3 of 8 frames are kept"):
            run_dive(small_dive, tmp_path / "dive")
    assert bytes_of(run_dive(small_dive, tmp_path / "dive")) == whole


@pytest.mark.parametrize("name", ["concatenate", "write_text", "write_table"])
def test_stopped_while_the_segments_are_put_together(small_dive, whole, tmp_path, monkeypatch, name):
    def full(*given, **named):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(files, name, full)
        with pytest.raises(DiveStoppedError, match="8 of 8 frames are kept"):
            run_dive(small_dive, tmp_path / "dive")
    # No image is made a second time.
    with monkeypatch.context() as patch:
        patch.setattr(runner, "ClosedLoop", None)
        assert bytes_of(run_dive(small_dive, tmp_path / "dive")) == whole


def test_a_finished_dive_is_left_alone_and_another_one_refused(small_dive, whole, tmp_path):
    folder = tmp_path / "dive"
    folder.mkdir()
    for name, content in whole.items():
        (folder / name).write_bytes(content)
    said: list[str] = []
    run_dive(small_dive, folder, log=said.append)
    assert said == [f"{folder}: this dive is finished already"]
    with pytest.raises(ValueError, match="another dive is in it"):
        run_dive(small_dive.model_copy(update={"seed": 4}), folder)
    assert bytes_of(folder) == whole


def test_a_damaged_log_is_a_sentence(small_dive, whole, tmp_path):
    (tmp_path / "log.parquet").write_bytes(whole["log.parquet"][:-10])
    with pytest.raises(ValueError, match=r"log\.parquet: expected the log of a dive, as Parquet, got a damaged file"):
        run_dive(small_dive, tmp_path)


def test_a_folder_that_another_process_writes_into_is_refused(small_dive, tmp_path):
    """Locked as by another process: a lock counts for the open file, not for the process. Let go, it is free."""
    at_work = journal.Journal(tmp_path, runner.identity_of(small_dive, small_dive.load_rig()))
    with pytest.raises(ValueError, match=r"expected a folder that no other dive is being written into"):
        run_dive(small_dive, tmp_path)
    at_work.close()
    journal.Journal(tmp_path, runner.identity_of(small_dive, small_dive.load_rig())).close()


def test_a_journal_of_another_dive_is_refused(small_dive, tmp_path):
    with pytest.raises(StoppedError):
        run_dive(small_dive, tmp_path / "dive", progress=stop_after(4))
    with pytest.raises(ValueError, match="expected the same dive as before"):
        run_dive(small_dive.model_copy(update={"seed": 4}), tmp_path / "dive")
