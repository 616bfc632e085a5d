"""`mirrorgaze angular-speed`: what it prints. The search itself is tested with the metrics."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from dives.evaluation import tracking_rate
from dives.evaluation.tracking_rate import LargestSpeed, Trial
from dives.metrics.intervals import mean_interval
from mirrorgaze.cli import app


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, ["angular-speed", *arguments])


@pytest.fixture
def found(monkeypatch):
    """The default follows 40 and 60 degrees a second, others nothing."""

    def search(rig, variant, arc, *, seeds, frame_rate_hz, progress):
        speeds = (40.0, 60.0) if variant.name == "default" else (0.0, 0.0)
        progress(2, 2)
        trials = tuple(
            (Trial(speed_deg_per_s=speed, longest_gap_frames=0, gaze_error_rms_deg=speed / 20),) if speed else ()
            for speed in speeds
        )
        return LargestSpeed(arc=arc, by_seed_deg_per_s=speeds, interval=mean_interval(speeds), trials=trials)

    monkeypatch.setattr(tracking_rate, "largest_angular_speed", search)


def test_a_line_for_each_loop_and_axis(found):
    result = mirrorgaze("aqua2", "--variant", "default, paper-literal", "--seeds", "2")
    assert result.exit_code == 0, result.stderr
    head, *lines = result.stdout.splitlines()
    assert head.startswith("loop")
    assert [line.split()[:2] for line in lines] == [
        [loop, axis] for loop in ("default", "paper-literal") for axis in ("azimuth", "elevation")
    ]
    # Student with one degree of freedom: 12.706 times 10 to each side.
    assert "50 (-77.1 to 177)" in lines[0]
    assert lines[0].split()[-1] == "3"
    assert lines[2].split()[-1] == "-"
    assert "default, azimuth: 2 of 2" in result.stderr


def test_json_has_every_trial(found):
    data = json.loads(mirrorgaze("aqua2", "--json").stdout)
    assert [item["arc"]["axis"] for item in data] == ["azimuth", "elevation"]
    assert data[0]["trials"][1][0]["speed_deg_per_s"] == 60.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("aqua2", "--variant", "best"), "variant 'best': expected one of"),
        (("aqua2", "--radius-m", "3"), "a radius between 0 and its distance"),
        (("nosuch",), "expected a preset"),
    ],
)
def test_bad_input_is_a_sentence_and_2(arguments, message):
    result = mirrorgaze(*arguments)
    assert result.exit_code == 2
    assert message in result.stderr


def test_help_has_an_example():
    assert "mirrorgaze angular-speed aqua2" in mirrorgaze("--help").stdout
