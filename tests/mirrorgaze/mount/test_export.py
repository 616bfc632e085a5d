"""`mirrorgaze export`: what it prints and writes."""

from __future__ import annotations

import json

from typer.testing import CliRunner

from cad.checks.assembly_checks import MountChecks
from cad.export import mount
from mirrorgaze.cli import app
from reports.studies import mount_export


def test_export_names_what_it_wrote(here, monkeypatch):
    # The checks, a slicer on the PATH, drawings, steps and the robot's files take a minute; they have their own
    # tests, and tests/cad/export makes the whole.
    monkeypatch.setattr(mount_export, "mount_checks", lambda *_, **__: MountChecks(findings=(), steps=()))
    for slow in ("write_drawings", "write_steps", "write_robot"):
        monkeypatch.setattr(mount, slow, lambda *_: None)
    result = CliRunner().invoke(app, ["export", "aqua2", "-o", "mount", "--json"])
    assert result.exit_code == 0, result.stderr
    files = json.loads(result.stdout)["files"]
    assert {"mount/parts/yoke.stl", "mount/aqua2.step", "mount/bom.csv", "mount/manifest.json"} <= set(files)
    there = [path for path in (here / "mount").rglob("*") if path.is_file()]
    assert sorted(files) == sorted(str(path.relative_to(here)) for path in there)
    assert "export: drawings" in result.stderr
