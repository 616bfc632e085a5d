"""The folder of things that take long to compute."""

import os

import numpy as np
import pytest

from optics.kernels.cache import cache_folder, load_arrays, remove_oldest, result_key, save_arrays


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


def test_a_key_is_of_the_kind_the_version_and_all_inputs(tmp_path):
    """No two of these are told apart by less than their content, shape, type or order."""
    file = tmp_path / "hull.stl"
    file.write_text("a")
    inputs = [
        [],
        [None],
        ["a"],
        [b"a"],
        [file],
        ["a", "b"],
        ["ab"],
        [["a"], "b"],
        [1],
        [1.0],
        [True],
        [np.float32(1)],
        [np.array([1.0, 2.0])],
        [np.array([2.0, 1.0])],
        [np.array([[1.0, 2.0]])],
        [[1.0, 2.0]],
        [{"a": 1.0}],
        [{"a": 2.0}],
        [{"b": 1.0}],
    ]
    keys = [result_key("kind", 1, *each) for each in inputs] + [result_key("kind", 2), result_key("other", 1)]
    assert len(set(keys)) == len(keys)


def test_a_key_hangs_on_content_alone(tmp_path):
    """Not on the order of a mapping, the layout of an array, or the name of a file."""
    table = np.arange(6.0).reshape(2, 3)
    assert result_key("kind", 1, {"a": 1, "b": 2}) == result_key("kind", 1, {"b": 2, "a": 1})
    assert result_key("kind", 1, np.asfortranarray(table)) == result_key("kind", 1, table)
    file = tmp_path / "one"
    file.write_text("a")
    before = result_key("kind", 1, file)
    assert result_key("kind", 1, file.rename(tmp_path / "two")) == before
    (tmp_path / "two").write_text("b")
    assert result_key("kind", 1, tmp_path / "two") != before


@pytest.mark.parametrize("unknown", [{1, 2}, object(), np.array([None])])
def test_an_input_whose_content_is_not_known_is_refused(unknown):
    with pytest.raises(TypeError, match="expected"):
        result_key("kind", 1, unknown)
