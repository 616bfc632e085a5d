"""The folder of things that take long to compute."""

import os

import numpy as np

from optics.cache import cache_folder, load_arrays, remove_oldest, save_arrays


def test_the_cache_is_where_the_environment_says(monkeypatch, tmp_path):
    monkeypatch.setenv("MIRRORGAZE_CACHE", str(tmp_path / "own"))
    assert cache_folder() == tmp_path / "own"
    monkeypatch.delenv("MIRRORGAZE_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder() == tmp_path / "mirrorgaze"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert cache_folder() == tmp_path / ".cache" / "mirrorgaze"


def test_what_was_not_used_for_longest_goes_first(tmp_path):
    for age, name in enumerate(("newest", "middle", "oldest")):
        save_arrays(tmp_path / f"{name}.npz", {"x": np.zeros(1000)})
        os.utime(tmp_path / f"{name}.npz", (1e9 - age, 1e9 - age))
    (tmp_path / "other.json").write_text("not an array")
    load_arrays(tmp_path / "oldest.npz")
    size = (tmp_path / "oldest.npz").stat().st_size
    remove_oldest(tmp_path, 2 * size)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["newest.npz", "oldest.npz", "other.json"]
