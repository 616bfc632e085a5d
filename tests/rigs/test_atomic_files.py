"""Files appear whole or not at all."""

from __future__ import annotations

import os

import pytest

from rigs.atomic_files import atomic_file, atomic_files, write_bytes, write_text


def names(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def test_a_file_has_its_name_when_it_is_whole_and_on_the_disk(tmp_path, monkeypatch):
    path, synced = tmp_path / "rig.toml", []
    monkeypatch.setattr(os, "fsync", lambda descriptor: synced.append(os.fstat(descriptor).st_size))
    path.write_text("before")
    with atomic_file(path) as partial:
        assert (partial.parent, partial.name) == (tmp_path, ".rig.partial.toml")
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


def test_what_a_killed_program_left_is_overwritten(tmp_path):
    (tmp_path / ".rig.partial.toml").write_text("half of a much longer text")
    write_text(tmp_path / "rig.toml", "whole µ")
    assert (tmp_path / "rig.toml").read_text(encoding="utf-8") == "whole µ"
    assert names(tmp_path) == ["rig.toml"]


def test_a_shared_file_has_a_place_for_each_program(tmp_path):
    path = tmp_path / "meshes.npz"
    with atomic_file(path, shared=True) as first, atomic_file(path, shared=True) as second:
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
