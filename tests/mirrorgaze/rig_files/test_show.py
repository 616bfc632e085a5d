"""`mirrorgaze show`: three files and a table, for rigs too that nothing can be built of."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from mirrorgaze.cli import app
from reports.studies.show import show_rig
from rigs import Rig, load_document, preset_path, save_document

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture
def buried(here) -> str:
    """No mount can be built of it, and its numbers alone are impossible: M1 and M2 are inside of each other."""
    document = load_document(preset_path("aqua2"))
    document["camera"]["position_mm"] = [200.0, 60.0, 0.0]
    document["gaze_mirror"]["distance_mm"] = 10.0
    save_document(document, here / "buried.toml")
    return "buried.toml"


def test_a_rig_that_cannot_be_built_is_shown(buried, here):
    result = CliRunner().invoke(app, ["show", buried])
    assert result.exit_code == 0, result.stderr
    rows = {line[:30].strip(): line[30:].split(maxsplit=1) for line in result.stdout.splitlines()[1:]}
    assert rows["gaze mirror M2 at rest"][1] == "in the hull"
    assert float(rows["gaze mirror M2 at rest"][0]) < 0
    folder = here / "out" / "aqua2-show"
    assert sorted(path.name for path in folder.iterdir()) == ["show.glb", "show.json", "show.png"]
    assert (folder / "show.png").read_bytes().startswith(PNG)
    numbers = json.loads((folder / "show.json").read_text(encoding="utf-8"))
    assert not numbers["good"]
    named = {place["name"]: place for place in numbers["places"]}
    assert named["gaze mirror M2 at rest"]["wrong"] == "in the hull"


def test_numbers_and_picture_are_those_of_a_notebook(here):
    result = CliRunner().invoke(app, ["show", "aqua2", "-o", "there", "--json"])
    shown = json.loads(result.stdout)
    assert shown["good"]
    view = show_rig(Rig.load("aqua2"))
    assert shown == json.loads(json.dumps(view.numbers))
    assert view._repr_png_() == (here / "there" / "show.png").read_bytes()
    assert shown == json.loads((here / "there" / "show.json").read_text(encoding="utf-8"))


def test_a_rig_without_mirrors_is_bad_input(here):
    result = CliRunner().invoke(app, ["show", "bench"])
    assert result.exit_code == 2
    assert "mirrors" in result.stderr
    assert not list(here.iterdir())
