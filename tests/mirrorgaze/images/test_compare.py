"""`mirrorgaze compare`: what it prints and writes, and that bad input writes nothing."""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from mirrorgaze.cli import app
from optics.kernels.backend import mi

pytestmark = pytest.mark.usefixtures("rough_light")

SMALL = ("--width-px", "16", "--height-px", "12", "--samples", "8")


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, ["compare", *arguments])


def test_machines_are_told_bias_error_and_speed(here):
    result = mirrorgaze("bench", *SMALL, "--json", "-o", "both.png")
    assert result.exit_code == 0, result.stderr
    found = json.loads(result.stdout)
    whole = found["agreements"][0]
    assert whole["name"] == "whole image"
    assert whole["pixels"] == 16 * 12
    for fast, true, bias in zip(whole["fast"], whole["reference"], whole["bias"], strict=True):
        assert bias == pytest.approx(fast / true - 1)
    assert found["speed_ratio"] == pytest.approx(found["reference_time_to_3_percent_s"] / found["fast_time_s"])
    image = np.array(mi.Bitmap(str(here / "both.png")))
    # Three panels, enlarged to at least 320 pixels each.
    assert image.shape == (240, 3 * 320, 3)
    assert "reference: 3 of 3" in result.stderr


def test_people_get_a_table(here):
    result = mirrorgaze("bench", *SMALL, "-o", "both.png")
    assert result.exit_code == 0, result.stderr
    assert "whole image  192" in result.stdout
    assert "bias %" in result.stdout
    assert "x the fast frame's time" in result.stdout


def test_pixels_beside_the_sun_are_counted_apart(here):
    """Gaze 66 degrees up and towards the sun, which stands 60 degrees high: refracted, 68."""
    up = (
        "--world",
        "blue",
        "--q2-deg",
        "33",
        "--sun-azimuth-deg",
        "0",
        "--width-px",
        "32",
        "--height-px",
        "24",
        "--samples",
        "4",
    )
    result = mirrorgaze("aqua2", *up, "--json")
    assert result.exit_code == 0, result.stderr
    whole, beside = json.loads(result.stdout)["agreements"][:2]
    assert beside["name"] == "without 5 deg about the sun"
    assert 0 < beside["pixels"] < whole["pixels"]


def test_a_target_is_hung_at_a_distance_on_the_gaze(here):
    """Four times as far, a ball covers a sixteenth of the pixels; at 64 x 48 its disk is known to a tenth or so."""
    pose = (
        "--world",
        "blue",
        "--q1-deg",
        "-20",
        "--q2-deg",
        "5",
        "--width-px",
        "64",
        "--height-px",
        "48",
        "--samples",
        "2",
    )
    pixels = {}
    for distance in ("0.5", "2"):
        result = mirrorgaze("aqua2", *pose, "--target-distance-m", distance, "--json")
        assert result.exit_code == 0, result.stderr
        named = {each["name"]: each["pixels"] for each in json.loads(result.stdout)["agreements"]}
        pixels[distance] = named["target"]
    assert 8 < pixels["0.5"] / pixels["2"] < 24


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("-o", "both.exr"), "ends in .png"),
        (("-o", "nowhere/both.png"), "existing folder"),
        (("--world", "moon"), "expected a world"),
        (("--depth-m", "0.1"), "expected a depth"),
        (("--q1-deg", "170"), "q1 (pan)"),
        (("--q1-deg", "170", "--target-distance-m", "2"), "q1 (pan)"),
        (("--target-distance-m", "-1"), "expected a distance above 0 m, got -1 m"),
        (("--target", "shark"), "expected a target"),
        (("--longitude-deg", "3"), "missing: --date, --latitude-deg"),
        (("--wind-m-per-s", "3", "--snow"), "(wind of 0 m/s), got 3 m/s; no marine snow, got some"),
    ],
)
def test_bad_input_is_told_and_nothing_written(here, arguments, sentence):
    result = mirrorgaze("aqua2", *SMALL, *arguments)
    assert result.exit_code == 2
    assert sentence in result.stderr
    assert not list(here.iterdir())
