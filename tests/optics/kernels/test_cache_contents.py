"""What is in the cache, what goes first, and what is not the cache's to remove."""

from __future__ import annotations

import os
import time

import pytest

from optics.kernels.cache_contents import cache_folder, clear_cache, entries, entry_path, evict, kept_kinds, limit_bytes

DAY_S = 86400.0


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("MIRRORGAZE_CACHE", str(tmp_path))
    return tmp_path


def keep(kind, digit, size=100, *, made_days=0.0, used_days=0.0):
    path = entry_path(kind, digit * 64)
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(bytes(size))
    now = time.time()
    os.utime(path, (now - used_days * DAY_S, now - made_days * DAY_S))
    return path


def test_the_cache_is_where_the_environment_says(monkeypatch, tmp_path):
    monkeypatch.setenv("MIRRORGAZE_CACHE", str(tmp_path / "own"))
    assert cache_folder() == tmp_path / "own"
    monkeypatch.delenv("MIRRORGAZE_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder() == tmp_path / "mirrorgaze"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert cache_folder() == tmp_path / ".cache" / "mirrorgaze"


def test_the_limit_is_5_gb_or_what_the_environment_says(monkeypatch):
    monkeypatch.delenv("MIRRORGAZE_CACHE_LIMIT_GB", raising=False)
    assert limit_bytes() == 5_000_000_000
    monkeypatch.setenv("MIRRORGAZE_CACHE_LIMIT_GB", "0.5")
    assert limit_bytes() == 500_000_000
    for wrong in ("much", "-1", "nan", "inf"):
        monkeypatch.setenv("MIRRORGAZE_CACHE_LIMIT_GB", wrong)
        with pytest.raises(ValueError, match=f"expected a number of GB of at least 0, got '{wrong}'"):
            limit_bytes()


def test_what_was_not_used_for_longest_goes_first_whatever_its_kind(folder):
    old, newer = keep("light", "a", used_days=2, made_days=2), keep("rig meshes", "b", used_days=1, made_days=9)
    newest, unfinished = keep("light", "c"), folder / "light" / f".{'d' * 64}.0123abcd.partial.npz"
    unfinished.write_bytes(bytes(100))
    os.utime(unfinished, (1e9, 1e9))
    evict(300)
    assert not unfinished.exists()
    evict(200)
    assert [path.exists() for path in (old, newer, newest)] == [False, True, True]
    evict(0)
    assert entries() == []


def test_what_is_kept_is_told_by_kind(folder):
    keep("light", "a", 100, made_days=5, used_days=3)
    keep("light", "b", 50, made_days=4, used_days=1)
    keep("rig meshes", "c", 7)
    light, meshes = kept_kinds()
    assert (light.kind, light.entries, light.bytes) == ("light", 2, 150)
    assert light.oldest_s == pytest.approx(5 * DAY_S, abs=60)
    assert light.unused_s == pytest.approx(DAY_S, abs=60)
    assert (meshes.kind, meshes.entries, meshes.bytes) == ("rig-meshes", 1, 7)


def test_clearing_removes_a_kind_or_everything(folder):
    keep("light", "a"), keep("light", "b"), keep("rig meshes", "c")
    assert len(clear_cache("light")) == 2
    assert [kept.kind for kept in kept_kinds()] == ["rig-meshes"]
    with pytest.raises(ValueError, match=r"expected a kind that is kept \(rig-meshes\), got 'light'"):
        clear_cache("light")
    assert len(clear_cache()) == 1
    assert clear_cache() == []


def test_files_of_others_in_the_folder_stay(folder):
    (folder / "pictures").mkdir()
    others = [folder / "diary.txt", folder / "pictures" / "cat.npz", folder / "pictures" / f"{'a' * 64}.txt"]
    for path in others:
        path.write_text("mine")
    evict(0)
    assert clear_cache() == []
    assert all(path.exists() for path in others)


def test_without_a_folder_nothing_is_kept(monkeypatch, tmp_path):
    monkeypatch.setenv("MIRRORGAZE_CACHE", str(tmp_path / "none"))
    assert (entries(), kept_kinds(), clear_cache()) == ([], [], [])
