"""`mirrorgaze evaluate-detector`: what it prints and draws, and what it refuses."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from mirrorgaze.cli import app

pytestmark = pytest.mark.usefixtures("rough_light")


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, ["evaluate-detector", *arguments])


def test_results_by_distance_and_in_all(here):
    result = mirrorgaze("aqua2", "--world", "blue", "--images", "3", "--json", "-o", "evaluation.png")
    assert result.exit_code == 0, result.stderr
    found = json.loads(result.stdout)
    ranges = found["ranges"]
    assert [(row["from_m"], row["to_m"]) for row in ranges] == [(1, 2), (2, 3), (3, 4), (4, 5), (1, 5)]
    assert sum(row["seen"] for row in ranges[:4]) == ranges[4]["seen"] > 0
    assert (here / found["file"]).read_bytes().startswith(b"\x89PNG")
    assert "3 of 3" in result.stderr


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["bench"], "expected a rig with mirrors, got 'bench'"),
        (
            ["aqua2", "--detector", "blue-ball"],
            "detector 'blue-ball': expected one of contrast, red-ball, narrow-hue, wide-hue, onnx:FILE",
        ),
        (["aqua2", "--detector", "onnx:missing.onnx"], "expected a model of ONNX, got no file missing.onnx"),
        (["aqua2", "--world", "moon"], "moon"),
        (["aqua2", "-o", "evaluation.jpg"], "evaluation.jpg"),
        (["aqua2", "--target", "missing.ply"], "missing.ply"),
    ],
)
def test_bad_input_is_a_sentence(here, arguments, sentence):
    result = mirrorgaze("-o", "evaluation.png", *arguments)
    assert result.exit_code == 2
    assert sentence in result.stderr
    assert not list(here.iterdir())
