"""Findings as a table and in figures: all rows, all verdicts, and the joint values that are left."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from cad.checks.assembly_checks import MountChecks
from cad.checks.clearance import clearance
from cad.checks.clearance.admissible import AdmissibleRegion, CellState, Rectangle
from cad.checks.printing import walls
from cad.finding import Finding
from reports.figures.check import summary_rows, write_checks
from rigs import Problem, Rig

PROBLEM = Problem(place="mount.clearance_mm", value=3.0, expected="at most 1.2 mm")


@pytest.fixture
def checks():
    state = np.zeros((4, 4), dtype=np.int8)
    state[3, 0], state[2, 0] = CellState.TOO_NEAR, CellState.UNDECIDED
    return MountChecks(
        findings=(
            Finding(check=clearance.CHECK, subject="a and b", figure=4.0, unit="mm", limit=3.0),
            Finding(check=clearance.CHECK, subject="a and c", figure=1.2, unit="mm", limit=3.0, problem=PROBLEM),
            Finding(check=walls.CHECK, subject="a", figure=1.5, unit="mm", limit=0.8),
            Finding(check="slicer", subject="a", note="not run", ran=False),
        ),
        admissible=AdmissibleRegion(
            state=state,
            q1_edges_deg=np.linspace(-80, 80, 5),
            q2_edges_deg=np.linspace(-40, 40, 5),
            reachable=state == CellState.CLEAR,
            largest=Rectangle(q1_deg=(-80, 80), q2_deg=(-20, 40)),
        ),
    )


def test_table_and_figures_are_written_and_hold_every_finding(checks, tmp_path):
    files = write_checks(checks, Rig.load("aqua2"), tmp_path / "checks")
    assert [file.name for file in files] == ["checks.csv", "checks.png", "admissible.png"]
    assert sorted((tmp_path / "checks").iterdir()) == sorted(files)
    with files[0].open(encoding="utf-8") as text:
        rows = list(csv.DictReader(text))
    assert [row["verdict"] for row in rows] == ["passed", "failed", "passed", "not run"]
    assert rows[1]["problem"] == "mount.clearance_mm = 3.0: expected at most 1.2 mm"
    first = [file.read_bytes() for file in files]
    assert [file.read_bytes() for file in write_checks(checks, Rig.load("aqua2"), tmp_path / "checks")] == first


def test_the_summary_counts_and_shows_what_failed_first(checks):
    rows = summary_rows(checks)
    assert rows[0] == (clearance.CHECK, "1 passed, 1 failed", "a and c 1.2 mm (at least 3)")
    assert rows[2][1] == "1 not run"
