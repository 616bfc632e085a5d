"""What had to be done to a hull's file is told by the commands that use it."""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

from mirrorgaze.cli import app


@pytest.fixture
def holed_rig(here, monkeypatch, unplaced):
    """The torpedo's rig on a box of about its size from a file that lacks a triangle."""
    monkeypatch.setenv("MIRRORGAZE_CACHE", str(here / "cache"))
    box = trimesh.creation.box(extents=(1590, 230, 230))
    for _ in range(4):
        box = box.subdivide()
    keep = np.arange(len(box.faces)) != 100
    trimesh.Trimesh(box.vertices, box.faces[keep], process=False).export(here / "hull.stl")
    new = ("new", "mine", "--from", "torpedo", "--hull", "hull.stl", "--unit", "mm")
    result = CliRunner().invoke(app, list(new))
    assert result.exit_code == 0
    assert "\nhull.stl: closed 1 hole" in result.stderr
    return "mine.toml"


def test_check_tells_what_was_done_to_a_hulls_file(holed_rig):
    result = CliRunner().invoke(app, ["check", holed_rig])
    assert result.exit_code == 0, result.stderr
    assert result.stderr.startswith("hull.stl: closed 1 hole")
    assert "hull.stl" not in result.stdout
    answer = json.loads(CliRunner().invoke(app, ["check", holed_rig, "--json"]).stdout)
    assert answer["hull_notes"] == result.stderr.splitlines()


def test_a_hull_of_ours_needs_no_notes():
    result = CliRunner().invoke(app, ["check", "aqua2", "--json"])
    assert result.stderr == ""
    assert json.loads(result.stdout)["hull_notes"] == []
