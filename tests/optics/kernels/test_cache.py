"""Keys of results, and results from the cache whatever state it is in."""

from __future__ import annotations

import logging
import os
import time
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from optics.kernels import cache
from optics.kernels.arrays import CACHE_LINE_BYTES
from optics.kernels.cache import load_or_make, result_key
from optics.kernels.cache_contents import entry_path

NUMBERS = np.arange(8.0)
KEY = "0" * 64


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("MIRRORGAZE_CACHE", str(tmp_path / "cache"))
    cache._warn.cache_clear()
    return tmp_path / "cache"


def found(make=lambda: NUMBERS, key=KEY):
    return load_or_make("thing", key, make, pack=lambda made: {"x": made}, unpack=lambda stored: stored["x"])


def never():
    raise AssertionError("made again")


def test_what_is_kept_is_not_made_again(folder):
    assert found() is NUMBERS
    np.testing.assert_array_equal(found(never), NUMBERS)
    assert [path.relative_to(folder) for path in folder.rglob("*.*")] == [Path("thing") / f"{KEY}.npz"]
    assert found(lambda: NUMBERS + 1, key="1" * 64)[0] == 1


@pytest.mark.parametrize("shape", [(), (0, 3), (70001,), (40, 30, 100)])
@pytest.mark.parametrize("order", ["C", "F"])
def test_arrays_are_read_to_where_kernels_can_use_them(shape, order):
    """In a cache line's first byte, whatever their size, and they can be written to."""
    kept = np.asarray(np.random.default_rng(0).normal(size=shape), order=order)
    found(lambda: kept)
    read = found(never)
    assert read.shape == kept.shape
    np.testing.assert_array_equal(read, kept)
    assert read.ctypes.data % CACHE_LINE_BYTES == 0 and read.flags.writeable


def make_slowly(folder, name):
    """In a process of its own: make the result, and tell that it began; the one that is to die waits to be killed."""
    os.environ["MIRRORGAZE_CACHE"] = str(folder / "cache")

    def made():
        (folder / f"{name}.made").touch()
        time.sleep(3600 if name == "dies" else 0.2)
        return NUMBERS

    np.testing.assert_array_equal(found(made), NUMBERS)


def test_of_many_processes_one_makes_it_and_its_death_lets_the_next_one(tmp_path):
    """The first is killed while two wait; of these one makes it."""
    context = get_context("spawn")
    dies, *others = [
        context.Process(target=make_slowly, args=(tmp_path, name)) for name in ("dies", "waits", "waits too")
    ]
    dies.start()
    while not (tmp_path / "dies.made").exists():
        time.sleep(0.01)
    for process in others:
        process.start()
    time.sleep(0.2)
    assert len(list(tmp_path.glob("*.made"))) == 1
    dies.kill()
    for process in (dies, *others):
        process.join()
    assert [process.exitcode for process in others] == [0, 0]
    assert len(list(tmp_path.glob("*.made"))) == 2
    assert [path.name for path in (tmp_path / "cache/thing").iterdir()] == [f"{KEY}.npz"]


def test_what_is_found_was_used_now_and_made_then():
    found()
    os.utime(entry_path("thing", KEY), (1e9, 1e9))
    before = time.time()
    found(never)
    facts = entry_path("thing", KEY).stat()
    assert facts.st_atime >= before - 1
    assert facts.st_mtime == 1e9


def test_every_damaged_bit_is_a_miss_or_harmless(monkeypatch):
    """One bit of each byte at a time, and some lengths: the numbers are always the true ones."""
    monkeypatch.setattr(os, "fsync", lambda descriptor: None)
    found()
    path = entry_path("thing", KEY)
    whole = path.read_bytes()
    flipped = [whole[:k] + bytes([whole[k] ^ (1 << k % 8)]) + whole[k + 1 :] for k in range(len(whole))]
    made = []
    for damaged in [*flipped, *(whole[:k] for k in range(0, len(whole), 7))]:
        path.write_bytes(damaged)
        np.testing.assert_array_equal(found(lambda: made.append(0) or NUMBERS), NUMBERS)
    assert len(made) > len(whole) / 2
    assert path.read_bytes() == whole


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 not an archive", b"\x93NUMPY"])
def test_what_cannot_be_read_is_told_once_and_replaced(content, caplog):
    path = entry_path("thing", KEY)
    path.parent.mkdir(parents=True)
    for _ in range(2):
        path.write_bytes(content)
        np.testing.assert_array_equal(found(), NUMBERS)
        np.testing.assert_array_equal(found(never), NUMBERS)
    (record,) = caplog.records
    assert record.levelno == logging.WARNING
    assert record.getMessage().startswith(f"{path}: cannot be read and is made again (")


def test_what_was_kept_in_another_form_is_made_again():
    found()
    arrays = {"pack": lambda made: {"y": made}, "unpack": lambda stored: stored["y"]}
    for make in (lambda: NUMBERS, never):
        np.testing.assert_array_equal(load_or_make("thing", KEY, make, **arrays), NUMBERS)


@pytest.mark.parametrize("at", ["cache", "cache/thing", f"cache/thing/{KEY}.npz"])
def test_a_folder_that_cannot_be_written_costs_no_result(at, tmp_path, caplog):
    """Something else is in the way, which holds for the administrator too."""
    place = tmp_path / at
    place.parent.mkdir(parents=True, exist_ok=True)
    if place.suffix:
        place.mkdir()
    else:
        place.write_text("a file")
    for _ in range(2):
        np.testing.assert_array_equal(found(), NUMBERS)
    assert any("results cannot be kept for the next time" in line.getMessage() for line in caplog.records)
    assert len(caplog.records) <= 2


def test_a_full_disk_costs_no_result(folder, monkeypatch, caplog):
    def full(*_arguments, **_settings):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    np.testing.assert_array_equal(found(), NUMBERS)
    assert [path for path in folder.rglob("*") if path.is_file()] == []
    assert "No space left on device" in caplog.text


def test_what_making_raises_is_raised():
    with pytest.raises(OSError, match="gave up"):
        found(lambda: (_ for _ in ()).throw(OSError("gave up")))


def test_a_small_limit_keeps_what_was_used_last(monkeypatch):
    found()
    size = entry_path("thing", KEY).stat().st_size
    monkeypatch.setenv("MIRRORGAZE_CACHE_LIMIT_GB", str(1.5e-9 * size))
    os.utime(entry_path("thing", KEY), (1e9, 1e9))
    found(key="1" * 64)
    assert not entry_path("thing", KEY).exists()
    np.testing.assert_array_equal(found(never, key="1" * 64), NUMBERS)


def _found_many(count):
    return sum(float(found(key=f"{k:064x}").sum()) for k in range(count))


def test_programs_that_keep_the_same_at_once_do_not_meet():
    with get_context("spawn").Pool(2) as pool:
        assert pool.map(_found_many, [40, 40], chunksize=1) == [40 * NUMBERS.sum()] * 2
    assert {path.suffix for path in entry_path("thing", KEY).parent.iterdir()} == {".npz"}
    for k in range(40):
        np.testing.assert_array_equal(found(never, key=f"{k:064x}"), NUMBERS)


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
