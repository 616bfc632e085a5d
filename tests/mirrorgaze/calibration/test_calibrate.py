"""`mirrorgaze calibrate`: what it prints and writes, what it simulates, and what it refuses."""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from dives.calibration.simulation import simulated_edges, simulated_target, useful_poses
from mirrorgaze.cli import app
from optics.layout import Layout
from rigs import Rig
from tracking.calibration.calibrated_rig import CalibratedRig
from tracking.calibration.observation_files import write_observations
from tracking.calibration.prior import PRINT_TOLERANCES, draw_perturbations


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, ["calibrate", *arguments])


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Files of a session with a rig that was built wrong."""
    folder = tmp_path_factory.mktemp("session")
    rig = Rig.load("aqua2")
    perturbations = draw_perturbations(rig, PRINT_TOLERANCES, seed=1)
    target = simulated_target(rig, perturbations, useful_poses(rig, 8), known=True, direct=False, noise_px=0.3, seed=1)
    write_observations(folder / "observations.csv", target)
    simulated_edges(rig, perturbations, Layout.from_rig(rig).joint_grid(4), noise_px=0.3, seed=2).to_csv(
        folder / "corners.csv"
    )
    return folder


def test_it_tells_and_writes(files, here):
    result = mirrorgaze(
        "aqua2", str(files / "observations.csv"), "--edges", str(files / "corners.csv"), "-o", "calibration.toml"
    )
    assert result.exit_code == 0, result.stderr
    lines = result.stdout.splitlines()
    assert lines[0] == "signs: pan +1, tilt +1"
    assert lines[1].split() == ["parameter", "estimate", "std.", "dev.", "from", "the", "images", "alone", "tolerance"]
    assert any({"tilt_offset +1 deg", "m2_turn_x +1 deg"} == set(line.strip().split(", ")) for line in lines)
    assert lines[-1] == "calibration.toml"
    assert [path.name for path in here.iterdir()] == ["calibration.toml"]
    calibrated = CalibratedRig.load(here / "calibration.toml", Rig.load("aqua2"))
    assert np.degrees(calibrated.gaze_deviation(Layout.from_rig(calibrated.rig).joint_grid(3))).max() < 0.1


def test_json_holds_the_same(files):
    result = mirrorgaze("aqua2", "--edges", str(files / "corners.csv"), "--no-prior", "--json")
    assert result.exit_code == 0, result.stderr
    summary = json.loads(result.stdout)
    assert (summary["pan_sign"], summary["tilt_sign"], summary["signs_decided"]) == (1, 1, True)
    of_m1 = next(row for row in summary["perturbations"] if row["parameter"] == "m1_turn_x")
    # Numbers that JSON does not know are text.
    assert of_m1["standard_deviation"] == "inf"
    assert summary["gaze_deviation_deg"] == "inf"
    assert summary["file"] is None


@pytest.mark.parametrize("as_json", [False, True])
def test_simulation_shows_what_sessions_give(monkeypatch, as_json):
    from dives.calibration import session_study

    short = {"pose_counts": (6,), "sessions": session_study.SESSIONS[-1:]}
    whole = session_study.session_study
    monkeypatch.setattr(session_study, "session_study", lambda *args, **options: whole(*args, **options, **short))
    result = mirrorgaze("aqua2", "--simulate", "--rigs", "2", *(["--json"] if as_json else []))
    assert result.exit_code == 0, result.stderr
    if as_json:
        report = json.loads(result.stdout)
        assert [outcome["seed"] for outcome in report["outcomes"]] == report["seeds"] == [0, 1]
        for before, outcome in zip(report["before"], report["outcomes"], strict=True):
            assert outcome["after"]["gaze_deg"] < 0.1 < before["gaze_deg"]
        return
    lines = result.stdout.splitlines()
    assert lines[1].startswith("nominal rig, before")
    assert lines[2].startswith("boards in known places, and edges")


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["aqua2"], "expected OBSERVATIONS, --edges CORNERS, or --simulate, got none of them"),
        (["bench", "--simulate"], "expected a rig with mirrors, got 'bench'"),
        (["aqua2", "--simulate", "-o", "x.toml"], "expected --simulate alone"),
        (["aqua2", "missing.csv"], "missing.csv: No such file or directory"),
        (["aqua2", "bad.csv", "--edges", "bad.csv"], "column 'x': expected one of q1_deg"),
        (["aqua2", "bad.csv", "--edges", "bad.csv"], "expected a column top_left_u_px"),
        (["aqua2", "GOOD", "--noise-px", "0"], "expected noise_px > 0, got 0"),
    ],
)
def test_bad_input_is_a_sentence_and_leaves_nothing_behind(files, here, arguments, sentence):
    (here / "bad.csv").write_text("x,y\n1,nan\n")
    named = [str(files / "observations.csv") if argument == "GOOD" else argument for argument in arguments]
    result = mirrorgaze(*named)
    assert result.exit_code == 2
    assert sentence in result.stderr
    assert "Traceback" not in result.stderr
    assert [path.name for path in here.iterdir()] == ["bad.csv"]


def test_corners_beyond_the_joint_limits_are_told(files, here):
    lines = (files / "corners.csv").read_text().splitlines()
    lines[1] = lines[1].replace(lines[1].split(",")[0], "99", 1)
    (here / "beyond.csv").write_text("\n".join(lines))
    result = mirrorgaze("aqua2", "--edges", "beyond.csv")
    assert result.exit_code == 2
    assert "beyond.csv: sample 0: expected q1 between -77.5 and 77.5 deg, got 99" in result.stderr


def test_help_has_an_example():
    assert "mirrorgaze calibrate aqua2 --simulate" in mirrorgaze("--help").stdout
