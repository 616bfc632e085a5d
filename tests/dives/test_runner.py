"""Dives that are stopped: nothing finished is lost, and the files do not tell.

Eight small images in segments of three. What a dive must withstand is what stops it in earnest: a killed process, a
full disk, an image that cannot be made, and the same while the segments are being put together.
"""

from __future__ import annotations

import errno
import os
import shutil
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from cad.assembly.meshes import rig_meshes
from dives import files, journal, recorder, rendered_camera, runner
from dives.dive import Dive, varied
from dives.known_target import with_known_target
from dives.runner import DiveStoppedError
from dives.trajectories.attitude_sensor import AttitudeSettings
from dives.views.direct_view import direct_view
from scenes.baking.light_quality import LightQuality
from tracking.control.direct_look import DirectLook
from tracking.log import read_log, write_table

COARSE = LightQuality.coarse()
LOOKS = (1, 6)
"""Images in which a search looks past the mirrors: in the first one nothing has been searched yet."""

run_dive = partial(runner.run_dive, quality=COARSE)

FRAMES = 8
WRITTEN = {"dive.toml", "log.parquet", "metrics.json", "overlay.mp4", "rig.toml", "video.mkv"}

KILLED = """
import os, signal, sys, time
from pathlib import Path
from scenes.baking.light_quality import LightQuality
from dives import journal
from dives.known_target import with_known_target
from dives.runner import run_dive
from dives.dive import parse_dive

journal.SEGMENT_FRAMES = 3
folder = Path(sys.argv[1])
dive = parse_dive((folder / "small_dive.toml").read_text(), source="small", folder=folder)

def progress(done, total):
    if done == 5:
        while not (Path(sys.argv[2]) / "journal/000000.snapshot.json").exists():
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGKILL)

run_dive(dive, sys.argv[2], quality=LightQuality.coarse(), progress=progress)
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
        return lambda *given, **named: made[name] if name in made else made.setdefault(name, make(*given, **named))

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


def test_without_video_a_search_has_the_direct_view_of_the_whole_image(small_dive, monkeypatch):
    """In the images in which it is looked at, and in no other."""
    searching = varied(small_dive, video=False).model_copy(update={"functional_check": False})
    rig = searching.load_rig()
    given: dict[bool, list[np.ndarray]] = {}
    monkeypatch.setattr(DirectLook, "take", lambda look, image, *others: given[shown].append(image.copy()))
    monkeypatch.setattr(DirectLook, "is_due", lambda look, time_s: round(30 * time_s) in LOOKS)
    for shown in (False, True):
        given[shown] = []
        closed = runner.ClosedLoop(with_known_target(searching, rig), rig, rig_meshes(rig), COARSE)
        closed.whole_images = shown
        records = [closed.next() for _ in range(FRAMES)]
        view = direct_view(rig, rig_meshes(rig))
        assert view is not None
        seen = view.pixels(rig.camera.width_px, rig.camera.height_px)
        black = [bool((record.camera_frame.image[seen] == 0).all()) for record in records if record is not None]
        assert black == [not shown and frame not in LOOKS for frame in range(FRAMES)]
    assert len(given[True]) == len(given[False]) == len(LOOKS)
    for whole_image, part in zip(given[True], given[False], strict=True):
        assert np.array_equal(part[seen], whole_image[seen])


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


def test_with_an_attitude_sensor_a_stopped_dive_goes_on_to_the_same_bytes(small_dive, tmp_path):
    """The sensor has no state, and what the loop knows of the axes is in its snapshot."""
    told = small_dive.model_copy(update={"attitude": AttitudeSettings(), "functional_check": False})
    told = varied(told, video=False)
    with pytest.raises(StoppedError):
        run_dive(told, tmp_path / "stopped", progress=stop_after(5))
    stopped, whole = (bytes_of(run_dive(told, tmp_path / name)) for name in ("stopped", "whole"))
    assert stopped == whole
    assert b"[attitude]" in whole["dive.toml"]


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


def test_a_flipped_bit_of_the_log_is_a_sentence(whole, tmp_path):
    """In the data of a column, which is behind the file's first bytes."""
    for at in (40, 400, 4000):
        (tmp_path / "log.parquet").write_bytes(damaged(whole["log.parquet"], "flipped", at))
        with pytest.raises(
            ValueError, match=r"log\.parquet: expected the log of a dive, as Parquet, got a damaged file"
        ):
            read_log(tmp_path)


def identity_of(dive: Dive) -> str:
    rig = dive.load_rig()
    return runner.identity_of(with_known_target(dive, rig), rig, COARSE)


def damaged(content: bytes, how: str, at: int | None = None) -> bytes:
    middle = len(content) // 2 if at is None else at
    match how:
        case "cut":
            return content[:middle]
        case "empty":
            return b""
        case _:
            return content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]


def attack(file: Path, how: str) -> None:
    if how == "missing":
        file.unlink()
    else:
        file.write_bytes(damaged(file.read_bytes(), how))


SEGMENT_ATTACKS = [
    ("000000.video.mkv", "missing", 0),
    ("000001.video.mkv", "flipped", 3),
    ("000000.parquet", "cut", 0),
    ("000001.overlay.mkv", "empty", 3),
    ("000000.snapshot.json", "flipped", 0),
    ("000001.snapshot.json", "cut", 3),
]


@pytest.mark.parametrize("attacked", SEGMENT_ATTACKS)
def test_what_is_damaged_of_a_journal_is_made_again(small_dive, stopped, tmp_path, attacked):
    """Stopped with two of three segments finished; it goes on before the damaged one, to the same bytes."""
    name, how, first = attacked
    folder = shutil.copytree(stopped, tmp_path / "dive")
    attack(folder / "journal" / name, how)
    found = journal.Journal(folder, identity_of(small_dive))
    found.close()
    assert found.frames == first
    assert (found.snapshot() is None) == (first == 0)


def test_a_damaged_journal_ends_in_the_same_bytes(small_dive, whole, stopped, tmp_path):
    folder = shutil.copytree(stopped, tmp_path / "dive")
    attack(folder / "journal" / "000001.video.mkv", "cut")
    assert bytes_of(run_dive(small_dive, folder)) == whole


def test_a_journal_whose_identity_is_damaged_begins_again(small_dive, stopped, tmp_path):
    folder = shutil.copytree(stopped, tmp_path / "dive")
    (folder / "journal" / "identity").write_bytes(b"\xff\xfe not text")
    found = journal.Journal(folder, identity_of(small_dive))
    found.close()
    assert found.frames == 0
    assert sorted(path.name for path in (folder / "journal").iterdir()) == ["identity", "lock"]


@pytest.fixture(scope="module")
def stopped(small_dive, tmp_path_factory) -> Path:
    """Folder of the dive that was stopped behind its second segment."""
    folder = tmp_path_factory.mktemp("stopped") / "dive"
    with pytest.raises(StoppedError):
        run_dive(small_dive, folder, progress=stop_after(7))
    return folder


@pytest.mark.parametrize("name", sorted(WRITTEN - {"log.parquet"}))
@pytest.mark.parametrize("how", ["missing", "cut", "flipped"])
def test_a_finished_dive_lacks_nothing_and_nothing_of_it_is_damaged(small_dive, whole, tmp_path, name, how):
    for each, content in whole.items():
        (tmp_path / each).write_bytes(content)
    identity = identity_of(small_dive)
    assert files.is_finished(tmp_path, identity)
    attack(tmp_path / name, how)
    assert not files.is_finished(tmp_path, identity)


@pytest.mark.parametrize("digests", ["{", "[]", '{"video.mkv": 1}', "null"])
def test_a_finished_dive_whose_digests_are_damaged_is_made_again(small_dive, tmp_path, digests):
    """They are in the log's own description, which has no checksum."""
    identity = identity_of(small_dive)
    write_table(pa.table({"time_s": [0.0]}), tmp_path / "log.parquet", about={"identity": identity, "digests": digests})
    assert not files.is_finished(tmp_path, identity)


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
