"""`mirrorgaze calibrate-study`: words, JSON, exit status."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from mirrorgaze.cli import app


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, list(arguments))


def test_calibrate_study_prints_both_tables():
    result = mirrorgaze("calibrate-study", "bench")
    assert result.exit_code == 0, result.stderr
    assert "876.80  870.91  927.34  756.74  1.840" in result.stdout
    assert "Why 1.84 is not the index" in result.stdout
    assert result.stdout.count("the paper  ") == 3


def test_calibrate_study_answers_machines():
    answer = json.loads(mirrorgaze("calibrate-study", "bluerov2", "--json").stdout)
    assert len(answer["calibrations"]) == 12
    assert [disc["even_disc_ratio"] for disc in answer["discs"]] == [None] * 5
    # A centred dome changes nothing: all twelve find the camera of the rig file.
    assert all(found["ratio"] == pytest.approx(1, abs=1e-4) for found in answer["calibrations"])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["calibrate-study", "bench", "--board", "huge"], "expected --board to be one of large, small, got 'huge'"),
        (["calibrate-study", "bench", "--radius-px", "20"], "expected at least 5 views"),
    ],
)
def test_bad_input_is_a_sentence(arguments, words):
    result = mirrorgaze(*arguments)
    assert (result.exit_code, result.stdout) == (2, "")
    assert words in result.stderr
