"""`mirrorgaze corners`: what it prints and draws, and what it refuses."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from mirrorgaze.cli import app
from rigs import Rig
from tracking.perception import corner_error


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, ["corners", *arguments])


def test_it_tells_the_errors_and_draws_them(here):
    result = mirrorgaze("aqua2", "--samples", "25,49", "-o", "map.png")
    assert result.exit_code == 0, result.stderr
    lines = [line.split() for line in result.stdout.splitlines()]
    expected = corner_error(Rig.load("aqua2"), 49, 3.0)
    of_it = (expected.rms_px, expected.p95_px, expected.largest_px)
    assert ["49", "3", *(f"{value:.1f}" for value in of_it)] in lines
    assert lines[-1] == ["map.png"]
    assert (here / "map.png").read_bytes().startswith(b"\x89PNG")


def test_json_holds_the_same(here):
    result = mirrorgaze("aqua2", "--samples", "25", "--json")
    assert result.exit_code == 0, result.stderr
    told = json.loads(result.stdout)
    assert [(row["samples"], row["power"]) for row in told["errors"]] == [(25, 1), (25, 2), (25, 3), (25, 4)]
    assert all(row["rms_px"] < row["p95_px"] < row["largest_px"] for row in told["errors"])
    assert told["file"] is None


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["bench"], "expected a rig with mirrors, got 'bench'"),
        (["aqua2", "--samples", "26"], "expected a square number of samples from 4, got 26"),
        (["aqua2", "--samples", "many"], "expected --samples to be whole numbers separated by commas, got 'many'"),
    ],
)
def test_bad_input_is_a_sentence(here, arguments, sentence):
    result = mirrorgaze(*arguments, "-o", "map.png")
    assert result.exit_code == 2
    assert sentence in result.stderr
    assert not list(here.iterdir())
