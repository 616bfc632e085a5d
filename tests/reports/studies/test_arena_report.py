"""The arena's report: which frames are shown, and that images of the worst dives are made once."""

import json
from dataclasses import replace

import numpy as np
import pytest

from dives.metrics.frames import Frames
from optics.workers.run import Ended
from reports.studies import arena_report
from reports.studies.arena_report import arena_key_frames, write_arena_report
from tests.dives.arena.test_tables import NEVER, outcome
from tracking.loop.ablations import ABLATIONS

LOOPS = ("default", "paper")


@pytest.fixture
def drawn(monkeypatch, dive_log):
    """What is asked to be drawn, instead of drawing it; each log is the same."""
    asked = {}

    def draw(work, jobs, *, workers, scheduler):
        asked.update(jobs)
        return [Ended(name=name, value=None, failure=None) for name in jobs]

    monkeypatch.setattr(arena_report, "run_many", draw)
    monkeypatch.setattr(arena_report, "read_log", lambda folder: dive_log)
    return asked


def test_a_time_on_something_else_is_shown_in_its_middle(dive_log):
    """From 20 to 22 s the detector finds the robot and nothing of the target, which was acquired at 15 s."""
    time_s = np.array(dive_log["time_s"])
    away = (time_s >= 20) & (time_s < 22)
    both = np.where(away, 0, dive_log["detector_both_px"])
    number = dive_log.column_names.index("detector_both_px")
    table = dive_log.set_column(number, "detector_both_px", [both])
    number = table.column_names.index("detected_thing")
    table = table.set_column(number, "detected_thing", [np.where(away, "robot", "target").tolist()])
    (key,) = [each for each in arena_key_frames(Frames.of(table)) if each.name == "on_something_else"]
    assert time_s[key.frame] == pytest.approx(21, abs=0.1)
    assert "on the robot for 2.0 s" in key.caption


def test_the_worst_dives_are_drawn(drawn, tmp_path):
    outcomes = [outcome(0), outcome(1, **NEVER), outcome(2, held_of_all_fraction=0.4)]
    found = write_arena_report(outcomes, tmp_path, worst=2, workers=1, log=lambda line: None)
    assert [each.outcome.seed for each in found.worst] == [1, 2]
    assert set(drawn) == {"1-default", "2-default"}
    assert {video for *_, video in drawn.values()} == {None}
    assert json.loads((tmp_path / "arena.json").read_text(encoding="utf-8")) == found.as_dict()
    assert "Never acquired" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_videos_are_of_the_first_loop_and_made_once(drawn, tmp_path):
    outcomes = [replace(outcome(seed, loop), folder=tmp_path / f"{seed}-{loop}") for loop in LOOPS for seed in (0, 1)]
    film = tmp_path / "1-default" / "overlay.mp4"
    film.parent.mkdir()
    film.write_bytes(b"made before")
    found = write_arena_report(outcomes, tmp_path, worst=2, videos=True, workers=1, log=lambda line: None)
    videos = {name: video for name, (*_, video) in drawn.items()}
    assert videos == {
        "0-default": str(tmp_path / "0-default" / "overlay.mp4"),
        "1-default": None,
        "0-paper": None,
        "1-paper": None,
    }
    assert [each["video"] for each in found.as_dict()["worst"]] == [None, "1-default/overlay.mp4", None, None]
    assert 'href="1-default/overlay.mp4"' in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_an_ablation_is_compared_and_not_told_in_full(drawn, tmp_path):
    outcomes = [outcome(seed, loop) for loop in (*LOOPS, *ABLATIONS) for seed in (0, 1)]
    found = write_arena_report(outcomes, tmp_path, worst=1, workers=1, log=lambda line: None)
    assert set(drawn) == {"0-default", "0-paper"}
    assert found.table()[0] == ["metric", *LOOPS]
    head, *rows = found.difference_table()
    assert head[:4] == ["difference to default", "pairs", "held_of_all_fraction", "acquired_fraction"]
    assert [row[:3] for row in rows] == [[loop, "2", "0 (0 to 0)"] for loop in ("paper", *ABLATIONS)]
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "By factor, loop paper" in page
    assert "By factor, loop default-without" not in page


def test_an_ablation_alone_is_told_in_full(drawn, tmp_path):
    (name, *_) = ABLATIONS
    found = write_arena_report([outcome(0, name)], tmp_path, worst=0, workers=1, log=lambda line: None)
    assert found.table()[0] == ["metric", name]


def test_dives_without_a_red_decoy_stand_beside_all(drawn, tmp_path):
    def held(seed, share, red):
        return replace(outcome(seed, held_of_all_fraction=share), factors={"red decoy": red})

    outcomes = [held(0, 0.9, "no"), held(1, 0.7, "no"), held(2, 0.2, "yes")]
    rows = write_arena_report(outcomes, tmp_path, worst=0, workers=1, log=lambda line: None).table()
    first = [name for name, _ in rows].index("held_of_all_fraction")
    assert [(name.strip(), cell.split()[0]) for name, cell in rows[first : first + 3]] == [
        ("held_of_all_fraction", "0.6"),
        ("without a red decoy", "0.8"),
        ("with one", "0.2"),
    ]
