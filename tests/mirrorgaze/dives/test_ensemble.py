"""`mirrorgaze ensemble`: what it writes and prints, and how it ends. Diving itself is tested with the dives."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from dives.ensembles import run
from dives.ensembles.run import Outcome
from dives.metrics import DEFINITIONS
from mirrorgaze import interrupts
from mirrorgaze.cli import app
from optics.workers.run import Failure


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, ["ensemble", *arguments])


@pytest.fixture
def dived(monkeypatch):
    """Dives whose error is 1 + seed degrees for the first variant and 3 more for the second; `dived` names failures."""
    failing: set[str] = set()

    def dive_all(dive, members, folder, *, workers, scheduler, shard, log, video):
        log(f"{dive}: {len(members)} dives, {workers} at a time{'' if video else ', no video'}")
        found = []
        for member in members:
            error = 1.0 + member.seed + 3 * (member.settings.get("variant") == "paper")
            metrics = dict.fromkeys(DEFINITIONS) | {
                "passed": error < 8,
                "verdict": f"FAIL: gaze {error:.2f} degrees off",
                "losses": 0,
                "losses_reacquired": 0,
                "acquired": True,
                "gaze_error_rms_deg": error,
                "gaze_error_held_rms_deg": error,
            }
            failure = Failure(sentence="OSError: no disk", trace="") if member.name in failing else None
            found.append(
                Outcome(
                    member=member,
                    folder=folder / member.name,
                    metrics=None if failure else metrics,
                    failure=failure,
                )
            )
        return found

    monkeypatch.setattr(run, "run_ensemble", dive_all)
    return failing


def test_a_dive_beyond_its_limits_is_named_and_ends_with_1_where_that_is_asked_for(dived, here):
    arguments = ("spiral", "--seeds", "5", "--vary", "variant=default,paper")
    told = mirrorgaze(*arguments)
    assert told.exit_code == 0, told.stderr
    failed = [line for line in told.stdout.splitlines() if "FAIL" in line]
    assert [line.partition(": ")[2] for line in failed] == ["FAIL: gaze 8.00 degrees off"]
    assert mirrorgaze(*arguments, "--require").exit_code == 1
    assert mirrorgaze("spiral", "--seeds", "2", "--require").exit_code == 0


def test_it_writes_and_prints_tables(dived, here):
    result = mirrorgaze("spiral", "--seeds", "4", "--vary", "variant=default,paper", "--workers", "2")
    assert result.exit_code == 0, result.stderr
    assert "spiral: 8 dives, 2 at a time" in result.stderr
    lines = result.stdout.splitlines()
    assert lines[0].split("  ")[0] == "metric"
    (error,) = [line for line in lines if line.startswith("gaze_error_rms_deg") and "*" not in line]
    assert "2.5 (" in error
    assert "5.5 (" in error
    # Every pair differs by exactly three degrees.
    (difference,) = [line for line in lines if line.startswith("gaze_error_rms_deg") and "*" in line]
    assert difference.split(maxsplit=1)[1] == "3 (3 to 3) *"
    folder = here / "out/spiral-ensemble"
    names = "differences.csv differences.md dives.csv ensemble.json summary.csv summary.md"
    assert sorted(path.name for path in folder.iterdir()) == names.split()
    with (folder / "dives.csv").open() as file:
        assert len(list(csv.DictReader(file))) == 8


def test_a_grid_says_what_each_key_does(dived, here):
    """The second loop is 3 degrees worse; what the size does is nothing."""
    vary = ("--vary", "variant=default,paper", "--vary", "target.diameter_m=0.1,0.2")
    result = mirrorgaze("spiral", "--seeds", "2", "--grid", *vary, "-o", "grid")
    assert result.exit_code == 0, result.stderr
    with Path("grid/effects.csv").open() as file:
        rows = {(row["metric"], row["effect"]): row["share"] for row in csv.DictReader(file)}
    assert rows["gaze_error_held_rms_deg", "target.diameter_m"] == "0.0"
    # Variances 9 / 4 of the loops and 1 / 4 of the seeds.
    assert float(rows["gaze_error_held_rms_deg", "variant"]) == pytest.approx(9 / 10)
    assert "variant x target.diameter_m" in result.stdout
    assert Path("grid/gaze_error_held_rms_deg.png").stat().st_size > 5000
    refused = mirrorgaze("spiral", "--grid", "--vary", "depth_m=3..9", "--points", "2")
    assert refused.exit_code == 2
    assert refused.stderr.startswith("mirrorgaze: --grid: expected --vary KEY=VALUE,VALUE, two values or more")


def test_videos_may_be_left_out(dived, here):
    result = mirrorgaze("spiral", "--seeds", "2", "--workers", "1", "--no-video")
    assert "spiral: 2 dives, 1 at a time, no video" in result.stderr


def test_json_is_for_machines(dived, here):
    result = mirrorgaze("spiral", "--seeds", "2", "--json", "-o", "there")
    found = json.loads(result.stdout)
    assert [dive["seed"] for dive in found["dives"]] == [0, 1]
    assert found["differences"] == []
    assert json.loads(Path("there/ensemble.json").read_text()) == found


def test_a_dive_that_fails_is_told_and_1(dived, here):
    dived.add("seed=1")
    result = mirrorgaze("spiral", "--seeds", "2")
    assert result.exit_code == 1
    assert "seed=1: OSError: no disk" in result.stderr
    assert (here / "out/spiral-ensemble/summary.md").exists()


def test_ctrl_c_says_how_to_go_on(here, monkeypatch):
    said = []
    monkeypatch.setattr(run, "run_ensemble", lambda *_, **__: said.append(interrupts._last_words[-1]) or [])
    mirrorgaze("spiral")
    assert said == ["out/spiral-ensemble: stopped; the same command continues from there"]
    assert interrupts._last_words == ["stopped"]


def test_a_shard_is_dived_alone_and_tables_are_left_to_the_whole(dived, here):
    result = mirrorgaze("spiral", "--seeds", "8", "--shard", "2/3")
    assert result.exit_code == 0, result.stderr
    assert "shard-2-of-3.json" in result.stdout
    assert not (here / "out/spiral-ensemble/summary.csv").exists()
    refused = mirrorgaze("spiral", "--shard", "4/3")
    assert (refused.exit_code, refused.stderr) == (
        2,
        "mirrorgaze: --shard 4/3: expected I/N with I from 1 to N, such as 2/8\n",
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("spiral", "--vary", "variant"), "expected KEY=VALUE,VALUE or KEY=LOW..HIGH, got 'variant'"),
        (("spiral", "--vary", "depth_m=3..9"), "got 1 ranges and 0 points"),
        (("spiral", "--vary", "seed=1,2"), "seed: expected the seeds by their own option"),
        (("spiral", "--vary", "variant=default,paper", "--compare", "depth_m"), "two values or more (variant)"),
        (("nosuch",), "expected a preset"),
        (("spiral", "--vary", "variant=nosuch"), "nosuch"),
    ],
)
def test_bad_input_is_a_sentence_and_2(here, arguments, message):
    result = mirrorgaze(*arguments, "--seeds", "1")
    assert result.exit_code == 2, result.output
    assert message in result.stderr
    assert list(here.iterdir()) == []


def test_help_has_an_example():
    assert "mirrorgaze ensemble spiral" in mirrorgaze("--help").stdout
