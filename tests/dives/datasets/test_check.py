"""Checking a data set: one in order, and every kind of damage named."""

import json
import shutil

import pytest

from dives.datasets.check import check_dataset


@pytest.fixture
def copied(made, tmp_path):
    return shutil.copytree(made, tmp_path / "set")


def test_a_set_in_order_has_no_problems(made):
    found = check_dataset(made)
    assert (found.samples, found.problems) == (6, ())
    listed = len(json.loads((made / "manifest.json").read_text())["files"])
    assert found.files == listed + 6 * 7


def remove(path):
    path.unlink()


def cut(path):
    path.write_bytes(path.read_bytes()[:-10])


def turn(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


@pytest.mark.parametrize("damage", [remove, cut, turn])
@pytest.mark.parametrize(
    "name", ["samples.parquet", "rigs/aqua2.toml", "samples/00000/00000003.json", "depth/00000/00000002.png"]
)
def test_damage_is_named(copied, name, damage):
    damage(copied / name)
    (problem,) = check_dataset(copied).problems
    assert str(copied / name) in problem


def test_a_sample_that_nobody_counted_is_named(copied):
    shutil.copy(copied / "samples/00000/00000003.json", copied / "samples/00000/00000009.json")
    (problem,) = check_dataset(copied).problems
    assert "expected no sample 9" in problem


@pytest.mark.parametrize("content", [None, "", "[]", "{}", '{"files": 3}'])
def test_what_is_no_finished_set_is_refused(tmp_path, content):
    if content is not None:
        (tmp_path / "manifest.json").write_text(content)
    with pytest.raises(ValueError, match="data set"):
        check_dataset(tmp_path)
