"""`mirrorgaze cache` lists what is kept, and removes it."""

from __future__ import annotations

import json
import os
import time

import pytest
from typer.testing import CliRunner

from mirrorgaze.cli import app
from optics.kernels.cache_contents import entry_path


def run(*arguments: str):
    return CliRunner().invoke(app, ["cache", *arguments])


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Two radiance fields, one made 3 days ago and used 2 hours ago, and the meshes of a rig."""
    monkeypatch.setenv("MIRRORGAZE_CACHE", str(tmp_path))
    for kind, digit, size in (
        ("radiance field", "a", 2_000_000),
        ("radiance field", "b", 500_000),
        ("rig meshes", "c", 9),
    ):
        path = entry_path(kind, digit * 64)
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(bytes(size))
        now = time.time()
        os.utime(path, (now - 2 * 3600 - 60, now - 3 * 86400 - 60))
    return tmp_path


def test_kinds_are_listed_with_size_and_age(folder):
    lines = run().stdout.splitlines()
    assert lines[0] == f"{folder}: 2.5 MB of at most 5,000.0 MB"
    assert lines[1].split() == ["kind", "results", "size", "oldest", "last", "used"]
    assert lines[2].split() == ["radiance-field", "2", "2.5", "MB", "3", "days", "2", "hours", "ago"]
    assert lines[3].startswith("rig-meshes")


def test_a_kind_is_removed_or_everything(folder):
    result = run("--clear", "radiance-field")
    assert result.stdout.splitlines()[0] == "removed 2 results, 2.5 MB"
    assert [path.name for path in folder.rglob("*.npz")] == [f"{'c' * 64}.npz"]
    assert run("--clear").stdout.splitlines()[0] == "removed 1 results, 0.0 MB"
    assert run().stdout.splitlines() == [f"{folder}: 0.0 MB of at most 5,000.0 MB"]


def test_machines_are_told_the_same(folder):
    told = json.loads(run("--json").stdout)
    assert (told["folder"], told["limit_bytes"], told["removed"]) == (str(folder), 5e9, 0)
    fields, meshes = told["kinds"]
    assert (fields["kind"], fields["entries"], fields["bytes"]) == ("radiance-field", 2, 2_500_000)
    assert 7200 < fields["unused_s"] < 7300
    assert meshes["kind"] == "rig-meshes"
    assert json.loads(run("--clear", "rig-meshes", "--json").stdout)["removed"] == 1


def test_wrong_input_is_told(folder, monkeypatch):
    result = run("--clear", "meshes")
    assert result.exit_code == 2
    assert "expected a kind that is kept (radiance-field, rig-meshes), got 'meshes'" in result.stderr
    assert "expected --clear with a kind" in run("rig-meshes").stderr
    monkeypatch.setenv("MIRRORGAZE_CACHE_LIMIT_GB", "much")
    assert "expected a number of GB" in run().stderr
