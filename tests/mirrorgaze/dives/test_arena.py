"""`mirrorgaze arena`: what it writes and prints, and how it ends. Diving itself is tested with the dives."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from dives.arena import run
from dives.arena.run import ArenaOutcome
from mirrorgaze.cli import app
from optics.workers.run import Failure
from reports.studies import arena_report
from tests.dives.arena.test_tables import numbers
from tracking.loop.ablations import ABLATIONS


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, ["arena", *arguments])


@pytest.fixture
def dived(monkeypatch):
    """Dives that hold 0.9 of the time with the first loop and 0.5 with others; seeds in `dived` fail."""
    failing: set[int] = set()

    def run_arena(seeds, variants, folder, *, workers, scheduler, shard, log):
        log(f"{len(seeds)} seeds from {seeds[0]}, {', '.join(variants)}, {workers} at a time")
        return [
            ArenaOutcome(
                seed=seed,
                variant=variant,
                factors={"place": "tank"},
                folder=folder / f"{seed}-{variant}",
                numbers=None if seed in failing else numbers(held_of_all_fraction=0.9 if number == 0 else 0.5),
                failure=Failure(sentence="OSError: no disk", trace="") if seed in failing else None,
            )
            for seed in seeds
            for number, variant in enumerate(variants)
        ]

    monkeypatch.setattr(run, "run_arena", run_arena)
    return failing


def test_it_writes_tables_and_a_page(dived, here):
    result = mirrorgaze("--seeds", "3", "--first-seed", "7", "--variant", "default,paper", "--worst", "0", "-o", "a")
    assert result.exit_code == 0, result.stderr
    assert "3 seeds from 7, default, paper" in result.stderr
    (line,) = [line for line in result.stdout.splitlines() if line.startswith("held_of_all_fraction")]
    assert line.split()[1] == "0.9"
    found = json.loads(Path("a/arena.json").read_text(encoding="utf-8"))
    assert len(found["dives"]) == 6
    assert found["differences"][0]["interval"]["estimate"] == pytest.approx(-0.4)
    assert "difference to default" in result.stdout
    (line,) = [line for line in result.stdout.splitlines() if line.startswith("paper ")]
    assert line.split()[1:3] == ["3", "-0.4"]
    page = Path("a/report.html").read_text(encoding="utf-8")
    assert "By factor, loop paper" in page
    assert Path("a/dives.csv").read_text(encoding="utf-8").count("\n") == 7
    assert Path("a/summary.csv").is_file()


def test_ablations_join_the_loops_that_are_named(dived, here):
    result = mirrorgaze("--seeds", "2", "--variant", "default,paper", "--ablate", "--worst", "0", "-o", "a")
    assert result.exit_code == 0, result.stderr
    assert f"default, paper, {', '.join(ABLATIONS)}" in result.stderr
    lines = [line.split()[:3] for line in result.stdout.splitlines() if "without-contrast" in line]
    assert lines == [["default-without-contrast", "2", "-0.4"]]


def test_ablations_are_compared_with_the_default(dived, here):
    result = mirrorgaze("--variant", "paper,default", "--ablate")
    assert result.exit_code == 2
    assert "--ablate: expected default as the first --variant, got paper" in result.stderr


def test_videos_of_the_worst_are_asked_for(dived, here, monkeypatch):
    asked = []

    def write_arena_report(*given, videos, **named):
        asked.append(videos)
        raise ValueError("asked")

    monkeypatch.setattr(arena_report, "write_arena_report", write_arena_report)
    mirrorgaze("--seeds", "1", "--worst-videos")
    mirrorgaze("--seeds", "1")
    assert asked == [True, False]


def test_dives_that_failed_are_named_and_the_others_count(dived, here):
    dived.add(1)
    result = mirrorgaze("--seeds", "2", "--worst", "0", "--json")
    assert result.exit_code == 1
    assert "no disk" in result.stderr
    assert json.loads(result.stdout)["available"] == {"default": 1}
