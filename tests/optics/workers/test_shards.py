"""Parts of many pieces of work: all of them together are all of it, whatever their number."""

import json

import pytest

from optics.workers.run import Ended, Failure
from optics.workers.shards import Manifest, Shard


@pytest.mark.parametrize("count", [1, 3, 7, 20])
def test_the_parts_are_the_whole(count):
    names = [f"piece {number}" for number in range(13)]
    parts = [Shard(number, count).part(names) for number in range(1, count + 1)]
    assert sorted(name for part in parts for name in part) == sorted(names)
    assert max(map(len, parts)) - min(map(len, parts)) <= 1


@pytest.mark.parametrize("text", ["", "1", "0/3", "4/3", "1/0", "-1/3", "1/3/5", "a/b", " 1/3"])
def test_what_is_no_part_is_refused(text):
    with pytest.raises(ValueError, match="expected I/N with I from 1 to N, such as 2/8"):
        Shard.parsed(text)


def test_the_manifest_says_what_is_done(tmp_path):
    manifest = Manifest(tmp_path / "out", Shard.parsed("2/8"), total=20, done={"a": True, "b": False, "c": False})
    file = tmp_path / "out/shard-2-of-8.json"
    assert json.loads(file.read_text())["pieces"] == {"a": "done", "b": "to do", "c": "to do"}
    manifest.ended(Ended(name="b", value=None, failure=None))
    manifest.ended(Ended(name="c", value=None, failure=Failure(sentence="no disk", trace="")))
    told = json.loads(file.read_text())
    assert told == {"shard": 2, "of": 8, "all_pieces": 20, "pieces": {"a": "done", "b": "done", "c": "failed: no disk"}}
