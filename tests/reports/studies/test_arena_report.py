"""The arena's report: which frames are shown, and that images of the worst dives are made once."""

import json

import numpy as np
import pytest

from dives.metrics.frames import Frames
from optics.workers.run import Ended
from reports.studies import arena_report
from reports.studies.arena_report import arena_key_frames, write_arena_report
from tests.dives.arena.test_tables import NEVER, outcome


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
    thing = np.where(away, "robot", "target")
    (key,) = [each for each in arena_key_frames(Frames.of(table), thing) if each.name == "on_something_else"]
    assert time_s[key.frame] == pytest.approx(21, abs=0.1)
    assert "on the robot for 2.0 s" in key.caption


def test_the_worst_dives_are_drawn(drawn, tmp_path):
    outcomes = [outcome(0), outcome(1, **NEVER), outcome(2, held_of_all_fraction=0.4)]
    found = write_arena_report(outcomes, tmp_path, worst=2, workers=1, log=lambda line: None)
    assert [each.outcome.seed for each in found.worst] == [1, 2]
    assert set(drawn) == {"1-default", "2-default"}
    assert json.loads((tmp_path / "arena.json").read_text(encoding="utf-8")) == found.as_dict()
    assert "Never acquired" in (tmp_path / "report.html").read_text(encoding="utf-8")
