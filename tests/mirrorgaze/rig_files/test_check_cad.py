"""`mirrorgaze check RIG --cad`: a table, files, exit status; the checks themselves are stood in for."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

import reports.studies.mount_export
from cad.checks.assembly_checks import MountChecks
from cad.finding import Finding
from mirrorgaze.cli import app
from rigs import Problem

PROBLEM = Problem(place="mount.printer_bed_mm", value="yoke of 1 x 1 x 1 mm", expected="parts within 0 mm")
GOOD = Finding(check="wall thickness", subject="yoke", figure=1.2, unit="mm", limit=0.8)
BAD = Finding(check="fits the printer", subject="yoke", figure=-1.0, unit="mm of bed left", limit=0.0, problem=PROBLEM)


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, list(arguments))


@pytest.fixture
def found(monkeypatch):
    """Let the checks find what a test says."""

    def find(*findings):
        checks = MountChecks(findings=findings)
        monkeypatch.setattr(reports.studies.mount_export, "mount_checks", lambda *_, **__: checks)

    return find


def test_what_is_wrong_is_told_with_every_other_figure(here, found):
    found(GOOD, BAD)
    result = mirrorgaze("check", "aqua2", "--cad", "-o", "out")
    assert result.exit_code == 2
    assert str(PROBLEM) in result.stderr
    assert [line.split("  ")[0] for line in result.stdout.splitlines()] == ["wall thickness", "fits the printer"]
    assert sorted(path.name for path in (here / "out").iterdir()) == ["checks.csv", "checks.png"]


def test_good_checks_are_part_of_the_json(found):
    found(GOOD)
    result = mirrorgaze("check", "aqua2", "--cad", "--json")
    assert result.exit_code == 0
    answer = json.loads(result.stdout)
    assert answer["good"]
    assert answer["checks"] == [
        {
            "check": "wall thickness",
            "subject": "yoke",
            "verdict": "passed",
            "figure": 1.2,
            "unit": "mm",
            "sense": "at least",
            "limit": 0.8,
            "place": "",
            "note": "",
            "problem": None,
        }
    ]
