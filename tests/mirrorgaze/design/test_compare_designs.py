"""`mirrorgaze compare-designs`: what it prints; what it compares is tested with the reports."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from mirrorgaze.cli import app
from reports.studies import compare_designs as study


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, ["compare-designs", *arguments])


def test_it_prints_numbers_keys_and_what_is_wrong(tmp_path, monkeypatch):
    # A mount takes seconds to build: these two have none.
    def without_mount(rig):
        raise ValueError("mount.wall_mm: too thin")

    monkeypatch.setattr(study, "rig_meshes", without_mount)
    result = mirrorgaze("aqua2", "torpedo")
    assert result.exit_code == 0, result.stderr
    assert "M2 height" in result.stdout
    assert "hull.shape" in result.stdout
    assert "aqua2: no mount can be made: mount.wall_mm: too thin" in result.stdout
    answer = json.loads(mirrorgaze("aqua2", "aqua2", "--json").stdout)
    assert answer["rigs"] == ["aqua2 (A)", "aqua2 (B)"]
    assert answer["keys"] == []


@pytest.mark.parametrize(
    ("rigs", "words"), [(("aqua2", "bench"), "a rig with mirrors, got 'bench'"), (("x", "y"), "x")]
)
def test_bad_input_is_a_sentence_and_2(rigs, words):
    result = mirrorgaze(*rigs)
    assert (result.exit_code, words in result.stderr) == (2, True)
