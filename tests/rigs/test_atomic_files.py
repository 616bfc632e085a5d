"""Files appear whole or not at all."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from rigs.atomic_files import PARTIAL, _remove_left_behind, atomic_file, atomic_files, write_bytes, write_text


def names(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def test_a_file_has_its_name_when_it_is_whole_and_on_the_disk(tmp_path, monkeypatch):
    path, synced = tmp_path / "rig.toml", []
    monkeypatch.setattr(os, "fsync", lambda descriptor: synced.append(os.fstat(descriptor).st_size))
    path.write_text("before")
    with atomic_file(path) as partial:
        assert partial.parent == tmp_path
        assert PARTIAL.fullmatch(partial.name) and partial.suffix == ".toml"
        partial.write_text("and after")
        assert path.read_text() == "before"
    assert (path.read_text(), names(tmp_path), synced) == ("and after", ["rig.toml"], [9])


def test_writing_that_fails_changes_nothing(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text("before")

    def fail(partial):
        partial.write_text("half")
        raise OSError("full")

    with pytest.raises(OSError, match="full"), atomic_file(path) as partial:
        fail(partial)
    with pytest.raises(OSError, match="full"), atomic_files(tmp_path) as scratch:
        fail(scratch / "rig.toml")
    with pytest.raises(OSError, match="full"), atomic_files(tmp_path / "new" / "folder") as scratch:
        fail(scratch / "rig.toml")
    assert path.read_text() == "before"
    assert names(tmp_path) == ["new", "rig.toml"]


KILLED = """
import os, signal, sys
from pathlib import Path
from rigs.atomic_files import atomic_file, atomic_files, scratch_folder
place = Path(sys.argv[1])
with atomic_file(place / "rig.toml") as partial, atomic_files(place) as scratch, scratch_folder(place, "bag") as bag:
    partial.write_text("half")
    (scratch / "half").write_text("half")
    (bag / "half").write_text("half")
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_what_a_killed_program_left_is_removed_and_what_a_living_one_writes_is_not(tmp_path):
    """Names that a person gave are not ours to remove."""
    (tmp_path / ".mine.partial.toml").write_text("a person's")
    subprocess.run([sys.executable, "-c", KILLED, str(tmp_path)], check=False)
    assert len(names(tmp_path)) == 6
    with atomic_file(tmp_path / "living.toml") as living:
        _remove_left_behind.cache_clear()
        write_text(tmp_path / "rig.toml", "whole µ")
        living.write_text("lives")
    assert (tmp_path / "rig.toml").read_text(encoding="utf-8") == "whole µ"
    assert names(tmp_path) == [".mine.partial.toml", "living.toml", "rig.toml"]


def test_no_link_is_followed(tmp_path, monkeypatch):
    """Neither one that has the name of the file, nor one that foresaw the name beside it."""
    elsewhere = tmp_path / "elsewhere"
    elsewhere.write_text("not ours")
    (tmp_path / "rig.toml").symlink_to(elsewhere)
    foreseen = iter(["0" * 8, "1" * 8])
    monkeypatch.setattr("secrets.token_hex", lambda count: next(foreseen))
    (tmp_path / f".rig.{'0' * 8}.partial.toml").symlink_to(elsewhere)
    _remove_left_behind(tmp_path)
    write_text(tmp_path / "rig.toml", "ours")
    assert elsewhere.read_text() == "not ours"
    assert not (tmp_path / "rig.toml").is_symlink()


def test_a_place_that_holds_no_files_is_named():
    with pytest.raises(OSError, match=r"/proc/rig\.toml"):
        write_text(Path("/proc/rig.toml"), "x")


def test_a_full_disk_is_told_with_the_file_and_leaves_nothing(tmp_path, monkeypatch):
    def full(descriptor):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match=r"No space left on device: .*rig\.toml"):
        write_text(tmp_path / "rig.toml", "x")
    assert names(tmp_path) == []


def test_a_file_has_a_place_for_each_program(tmp_path):
    path = tmp_path / "meshes.npz"
    with atomic_file(path) as first, atomic_file(path) as second:
        assert first != second
        assert first.suffix == second.suffix == ".npz"
        first.write_bytes(b"first")
        second.write_bytes(b"second")
    assert path.read_bytes() == b"first"
    assert names(tmp_path) == ["meshes.npz"]


def test_files_of_a_folder_appear_together_and_others_stay(tmp_path):
    folder = tmp_path / "made" / "mount"
    for text in ("one", "two"):
        with atomic_files(folder) as scratch:
            (scratch / "parts").mkdir()
            (scratch / "empty").mkdir()
            (scratch / "parts" / "yoke.stl").write_text(text)
            assert not (folder / "parts" / "yoke.stl").exists() or text == "two"
        write_bytes(folder / "notes.txt", b"mine")
        assert (folder / "parts" / "yoke.stl").read_text() == text
    assert names(folder) == ["empty", "notes.txt", "parts", "parts/yoke.stl"]
    assert names(tmp_path / "made") == ["mount", *(f"mount/{name}" for name in names(folder))]


def test_a_folder_that_is_there_needs_nothing_of_its_parent(tmp_path):
    """It may be another disk, from where files cannot be renamed into it."""
    with atomic_files(tmp_path) as scratch:
        assert scratch.parent == tmp_path
        (scratch / "a").write_text("a")
    assert names(tmp_path) == ["a"]
