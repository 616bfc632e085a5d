"""`mirrorgaze port`: words, JSON, exit status."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from mirrorgaze.cli import app


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, list(arguments))


def test_port_says_what_a_flat_port_does():
    result = mirrorgaze("port", "aqua2", "--nearest-focus-mm", "300")
    assert result.exit_code == 0, result.stderr
    lines = [" ".join(line.split()) for line in result.stdout.splitlines()]
    assert lines[0] == "f_water / f_air on axis 1.34024; traced: 1.34024; n_water = 1.34024"
    assert lines[1] == "infinity appears at infinity"
    assert lines[3] == "focus yes: sharp from 396.1 mm to infinity"
    # 20 mm of air, 8 mm of PMMA (550 nm: 1.4924), the rest water: 20 + 8 / 1.4924 + 972 / 1.34024.
    assert lines[2] == "1000.0 mm appears at 750.6 mm (distances from the pinhole)"


def test_port_says_that_a_dome_needs_a_near_focus():
    result = mirrorgaze("port", "bluerov2", "--nearest-focus-mm", "300")
    assert "no: all that is in the water appears nearer than the lens can focus" in result.stdout
    answer = json.loads(mirrorgaze("port", "bluerov2", "--nearest-focus-mm", "150", "--json").stdout)
    assert answer["infinity_is_sharp"] is True
    assert 3 * 50 < answer["infinity_appears_at_mm"] < 4 * 50
    assert answer["f_water_over_f_air"] == [1.0, 1.0]
    assert answer["abbe_number"]["pmma"] == pytest.approx(57.99, abs=0.06)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["port", "bench", "--distance-mm", "5"], "expected object_distance_m beyond the port's outer face, 0.011 m"),
        (["port", "bench", "--nearest-focus-mm", "-3"], "expected nearest_focus_m > 0, got -0.003"),
        (["port", "benhc"], "did you mean 'bench'?"),
    ],
)
def test_bad_input_is_a_sentence(arguments, words):
    result = mirrorgaze(*arguments)
    assert (result.exit_code, result.stdout) == (2, "")
    assert words in result.stderr
