"""`mirrorgaze check RIG --cad`: a table, files, exit status."""

from __future__ import annotations

import json

from typer.testing import CliRunner

from mirrorgaze.cli import app
from rigs import load_document, preset_path, save_document


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, list(arguments))


def test_a_printer_that_is_too_small_is_told_with_every_other_figure(here, monkeypatch):
    """Without a slicer on the PATH; the printer's key is named, exit status 2."""
    monkeypatch.setenv("PATH", "")
    document = load_document(preset_path("aqua2"))
    document["mount"]["printer_bed_mm"] = [150.0, 150.0, 150.0]
    save_document(document, here / "small.toml")
    result = mirrorgaze("check", "small.toml", "--cad", "-o", "out")
    assert result.exit_code == 2
    assert "mount.printer_bed_mm" in result.stderr
    assert "clearance over the joint range" in result.stdout
    assert "not run: no prusa-slicer on the PATH" in result.stdout
    assert sorted(path.name for path in (here / "out").iterdir()) == ["checks.csv", "checks.png"]


def test_good_checks_are_part_of_the_json(monkeypatch):
    monkeypatch.setenv("PATH", "")
    result = mirrorgaze("check", "aqua2", "--cad", "--json")
    assert result.exit_code == 0
    answer = json.loads(result.stdout)
    assert answer["good"]
    assert {"check", "subject", "figure", "limit", "verdict", "place"} <= set(answer["checks"][0])
