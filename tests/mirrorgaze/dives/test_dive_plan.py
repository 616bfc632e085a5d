"""From nothing to a plan of a dive: `new --dive`, `dive --plan`."""

import json

from typer.testing import CliRunner

from mirrorgaze.cli import app
from reports.studies import dive_report


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, [*arguments])


def test_a_new_dive_is_planned_and_nothing_is_rendered(here, monkeypatch):
    made = mirrorgaze("new", "harbour", "--dive")
    assert made.exit_code == 0
    assert "mirrorgaze dive harbour.toml --plan" in made.stdout
    # The mount does not matter to what is written, and takes seconds to build.
    monkeypatch.setattr(dive_report, "rig_meshes", lambda rig: [])
    planned = mirrorgaze("dive", "harbour.toml", "--set", "world=blue", "--plan", "-o", "plan", "--json")
    assert planned.exit_code == 0
    assert sorted(path.name for path in (here / "plan").iterdir()) == ["plan.json", "plan.png"]
    written = json.loads((here / "plan" / "plan.json").read_text(encoding="utf-8"))
    assert json.loads(planned.stdout) == {**written, "folder": "plan"}
    assert written["available_fraction"] == 1.0


def test_a_new_dive_takes_no_hull(here):
    for options, named in ((["--hull", "box"], "--hull box"), (["--up", "+z"], "--up +z")):
        refused = mirrorgaze("new", "harbour", "--dive", *options)
        assert refused.exit_code == 2
        assert named in refused.stderr
    assert list(here.iterdir()) == []
