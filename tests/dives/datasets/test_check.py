"""Checking a data set: one in order, and every kind of damage named."""

import json
import shutil
import sys

import pytest

from dives.datasets.check import check_dataset
from dives.datasets.formats.readback import read_back


@pytest.fixture
def copied(made, tmp_path):
    return shutil.copytree(made, tmp_path / "set")


QUIET = pytest.mark.filterwarnings("ignore")
"""What libraries warn about themselves is not ours."""


@QUIET
def test_a_set_in_order_has_no_problems(made):
    found = check_dataset(made)
    assert (found.samples, found.problems, found.notes) == (6, (), ())
    listed = len(json.loads((made / "manifest.json").read_text())["files"])
    assert found.files == listed + 6 * 7


@QUIET
def test_what_a_format_lacks_is_found_by_its_own_library(copied):
    document = json.loads((copied / "annotations/instances_train.json").read_text())
    document["annotations"][0]["area"] += 1
    last = document["images"].pop()["id"]
    (copied / "annotations/instances_train.json").write_text(json.dumps(document))
    shutil.copy(copied / "webdataset/train-000000.tar", copied / "webdataset/val-000000.tar")
    (copied / "parquet/val-00000.parquet").unlink()
    masks = sorted(copied.glob("bop/*/*/mask_visib/*.png"))
    shutil.copy(masks[0], masks[1])
    image = next(copied.glob("bop/*/*/rgb/*.png"))
    turn(image)
    problems, notes = read_back(copied)
    assert notes == []
    train = len(document["images"]) + 1
    unlisted = [each["id"] for each in document["annotations"] if each["image_id"] == last]
    words = [
        f"expected {train} images, got {train - 1}",
        "px in annotation 1",
        *(f"expected the image of annotation {number}" for number in unlisted),
        f"{image}: expected the image of sample",
        f"{str(masks[1]).replace('mask_visib', 'mask')}: expected masks with the boxes and counts",
        f"expected {6 - train} samples of val, got {train}",
        f"expected {6 - train} samples of val, got 0",
    ]
    assert len(problems) == len(words)
    assert all(word in problem for word, problem in zip(words, problems, strict=True))


@QUIET
def test_a_library_that_is_missing_is_named(made, monkeypatch):
    monkeypatch.setitem(sys.modules, "webdataset", None)
    problems, (note,) = read_back(made)
    assert (problems, note.partition(":")[0]) == ([], "webdataset")


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
