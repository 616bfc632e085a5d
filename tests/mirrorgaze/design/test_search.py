"""`mirrorgaze search`: what it prints, and what it says to bad input. What it writes is tested with the reports."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from mirrorgaze.cli import app
from reports.studies.searching import design_search


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, ["search", *arguments])


def test_it_searches_and_prints(tmp_path, monkeypatch):
    # Building mounts is tested elsewhere; here every one is good.
    monkeypatch.setattr(design_search, "_problem", lambda rig, design: "")
    options = ("aqua2", "--objective", "area,resolution", "--designs", "20", "--rigs", "2", "-o", str(tmp_path / "out"))
    result = mirrorgaze(*options)
    assert result.exit_code == 0, result.stderr
    assert "on the front" in result.stdout.splitlines()[0]
    table = [line.split() for line in result.stdout.splitlines()]
    (present,) = [line for line in table if line[:2] == ["this", "rig"]]
    assert present[2:10] == ["95", "125", "80", "x", "90", "80", "x", "100"]
    assert all(any(line[:1] == [str(number)] and "%)" in "".join(line) for line in table) for number in (1, 2))
    assert "--apply N" in result.stdout
    assert len(list((tmp_path / "out/rigs").glob("aqua2-*.toml"))) == 2
    found = json.loads(mirrorgaze(*options, "--json").stdout)
    assert [item["name"] for item in found["objectives"]] == ["area", "resolution"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("aqua2", "--objective", "beauty,area"), "two or more of the objectives"),
        (("aqua2", "--factor", "0.9"), "a factor above 1"),
        (("bench",), "expected a rig with mirrors"),
        (("aqua2", "--apply", "1"), "is a preset; copy it first"),
    ],
)
def test_bad_input_is_a_sentence_and_2(tmp_path, arguments, message):
    result = mirrorgaze(*arguments, "-o", str(tmp_path / "out"))
    assert result.exit_code == 2
    assert message in result.stderr
    assert not (tmp_path / "out").exists()


def test_help_has_an_example():
    assert "mirrorgaze search aqua2" in mirrorgaze("--help").stdout
