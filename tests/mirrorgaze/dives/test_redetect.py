"""`mirrorgaze redetect`: what it asks for and prints. Detecting again is tested with `dives.evaluation.redetection`."""

from __future__ import annotations

import json
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from dives import Dive
from dives.evaluation import redetection
from dives.evaluation.redetection import COMPARED
from mirrorgaze.cli import app
from tracking.perception import RED_BALL, WIDE_HUE


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, ["redetect", *arguments])


@pytest.fixture
def asked(monkeypatch):
    """What the command asks to be done; a recall of 0.25 becomes one of 0.75, the rest is not known."""
    calls = []
    nothing = dict.fromkeys(COMPARED)
    found = {
        "recorded": nothing | {"frame_recall": 0.25},
        "again": nothing | {"frame_recall": 0.75},
        "gain": nothing | {"frame_recall": 0.5},
    }

    def detect(folder, output, settings, *, progress):
        progress(10, 10)
        calls.append((folder, output, settings))
        return found

    monkeypatch.setattr(redetection, "Recording", lambda _: SimpleNamespace(dive=Dive.load("spiral")))
    monkeypatch.setattr(redetection, "redetect", detect)
    return calls


def test_it_detects_with_other_settings_and_prints_the_gain(asked, here):
    result = mirrorgaze("dive", "--hue-from-deg", "200", "--aspect-max", "4")
    assert result.exit_code == 0, result.stderr
    ((folder, output, settings),) = asked
    assert str(folder) == "dive"
    assert str(output) == "dive/redetected"
    assert (settings.window.hue_from_deg, settings.aspect_max) == (200, 4)
    assert settings.window.hue_to_deg == RED_BALL.window.hue_to_deg
    (line,) = [line for line in result.stdout.splitlines() if line.startswith("frame_recall")]
    assert line.split() == ["frame_recall", "0.25", "0.75", "+0.5"]
    assert "redetect: 10 of 10" in result.stderr


def test_a_detector_by_name_and_json(asked, here):
    result = mirrorgaze("dive", "--detector", "wide-hue", "-o", "there", "--json")
    assert asked[0][2] == WIDE_HUE
    found = json.loads(result.stdout)
    assert found["gain"]["frame_recall"] == 0.5
    assert found["folder"] == "there"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--detector", "blue"), "detector 'blue': expected one of"),
        (("--saturation-min", "2"), "expected saturation_min from 0 to 1, got 2"),
    ],
)
def test_bad_settings_are_a_sentence_and_2(asked, here, arguments, message):
    result = mirrorgaze("dive", *arguments)
    assert result.exit_code == 2
    assert message in result.stderr
    assert asked == []


def test_a_folder_without_a_dive_is_a_sentence_and_2(here):
    result = mirrorgaze(".")
    assert result.exit_code == 2
    assert "expected a finished dive" in result.stderr


def test_help_has_an_example():
    assert "mirrorgaze redetect out/wide-hue" in mirrorgaze("--help").stdout
