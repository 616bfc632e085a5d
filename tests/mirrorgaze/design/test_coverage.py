"""`mirrorgaze coverage`: what it prints, where it writes, and what it refuses."""

from __future__ import annotations

import json

from typer.testing import CliRunner

from mirrorgaze.cli import app
from reports.studies import coverage as study


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, list(arguments))


def test_help_has_an_example():
    result = mirrorgaze("coverage", "--help")
    assert result.exit_code == 0
    assert "mirrorgaze coverage aqua2 -o" in result.stdout


def test_words_and_json_say_the_same(tmp_path, monkeypatch):
    # What opens blind patches takes seconds; the report's own tests look at it.
    monkeypatch.setattr(study, "blind_openings", lambda *_, **__: [])
    folder = tmp_path / "out"
    words = mirrorgaze("coverage", "aqua2", "-o", str(folder), "--step-deg", "12")
    assert words.exit_code == 0, words.output
    assert "coverage ..." in words.stderr
    machine = mirrorgaze("coverage", "aqua2", "-o", str(folder), "--step-deg", "12", "--json")
    assert "coverage: done before" in machine.stderr
    data = json.loads(machine.stdout)
    assert data == json.loads((folder / "coverage.json").read_text(encoding="utf-8"))
    assert f"{data['coverage']['covered_fraction']:.1%} of all directions" in words.stdout
    assert data["rig"]["name"] == "aqua2"
    # 155 degrees in steps of at most 12.
    assert data["coverage"]["poses"] == 14 * 14


def test_bad_input_ends_with_2_and_a_sentence(tmp_path):
    for arguments, message in [
        (("aqua2", "--step-deg", "0"), "expected a step of the joints from 0.25 to 90 degrees, got 0"),
        (("bench",), "expected a rig with mirrors, got 'bench'"),
        (("nobody",), "nobody"),
    ]:
        result = mirrorgaze("coverage", *arguments, "-o", str(tmp_path / "out"))
        assert result.exit_code == 2, result.output
        assert message in result.stderr
        assert not (tmp_path / "out").exists()


def test_a_folder_with_something_else_is_left_alone(tmp_path):
    (tmp_path / "thesis.tex").write_text("precious")
    result = mirrorgaze("coverage", "aqua2", "-o", str(tmp_path))
    assert result.exit_code == 2
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]
