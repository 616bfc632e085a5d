"""`mirrorgaze --help` and the help of each command."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib.metadata import version
from itertools import chain

import pytest
from typer.testing import CliRunner

from mirrorgaze.cli import COMMANDS, EXAMPLES, app
from tests.docs.test_command_lines import problems

NAMES = [command.__name__.replace("_", "-") for command in chain(*COMMANDS.values())]

UNITS = {
    "degrees": "-deg",
    "metres": "-m",
    "millimetres": "-mm",
    "metres per second": "-m-per-s",
    "seconds": "-s",
    "pixels": "-px",
}
"""Units as the help says them, and as the names of the options do."""


def help_of(*command: str) -> str:
    result = CliRunner().invoke(app, [*command, "--help"])
    assert result.exit_code == 0
    return result.stdout


def test_commands_stand_under_their_headings():
    listed = re.findall(r"^(\w[\w ]*):\n((?:  .*\n)+)", help_of(), flags=re.MULTILINE)
    names = {heading: [line.split()[0] for line in block.splitlines()] for heading, block in listed}
    assert {heading: names[heading] for heading in COMMANDS} == {
        heading: [*(command.__name__.replace("_", "-") for command in commands), "e.g."]
        for heading, commands in COMMANDS.items()
    }


def test_the_example_below_a_heading_is_of_a_command_there():
    assert list(EXAMPLES) == list(COMMANDS)
    for heading, line in EXAMPLES.items():
        assert line.split()[1] in {command.__name__.replace("_", "-") for command in COMMANDS[heading]}
        assert problems(line) == []


def test_the_version_is_that_of_the_package():
    assert CliRunner().invoke(app, ["--version"]).stdout == f"mirrorgaze {version('mirrorgaze')}\n"


def test_presets_and_rig_files_are_completed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").touch()
    (tmp_path / "notes.txt").touch()
    environment = {"_MIRRORGAZE_COMPLETE": "complete_bash", "COMP_CWORD": "2"}
    for command, typed, found in (
        ("check", "aq", ["aqua-shell", "aqua2"]),
        ("render", "m", ["mine.toml"]),
        ("dive", "sp", ["spiral"]),
    ):
        words = {**environment, "COMP_WORDS": f"mirrorgaze {command} {typed}"}
        result = CliRunner().invoke(app, [], env=words, prog_name="mirrorgaze")
        assert result.stdout.split() == found


def test_no_summary_is_cut_short():
    assert "..." not in help_of().partition("Rig files:")[2]


@pytest.mark.parametrize("name", NAMES)
def test_every_command_shows_an_example(name):
    assert f"Example:\n    mirrorgaze {name}" in help_of(name)


@pytest.mark.parametrize("name", NAMES)
def test_options_with_a_unit_name_it(name):
    """docs/reference/conventions.md: the name of an option carries the unit where its number has one."""
    for option, text in re.findall(r"^  (?:-\w, )?--([\w-]+) <float>\s+((?:.+\n)(?:      .+\n)*)", help_of(name), re.M):
        words = " ".join(text.split()).partition("[default")[0]
        for unit, suffix in UNITS.items():
            if re.search(rf"in {unit}\b(?! per)", words):
                assert option.endswith(suffix), (option, words)


def test_scene_options_have_headings_of_their_own():
    options, scene = help_of("render").split("Scene options:")
    scene, light = scene.split("Light options:")
    assert "--q1-deg" in options
    assert "--depth-m" in scene
    assert "--sun-elevation-deg" in light


def test_the_module_runs_as_the_command_does():
    module = subprocess.run([sys.executable, "-m", "mirrorgaze", "--help"], capture_output=True, text=True, check=True)
    assert "Rig files:" in module.stdout


def test_help_loads_nothing_heavy():
    code = """
import sys
from mirrorgaze.cli import app
try:
    app(["--help"])
except SystemExit:
    pass
heavy = {"mitsuba", "drjit", "build123d", "OCP", "numpy", "scipy", "matplotlib", "trimesh", "pydantic", "rich"}
print(sorted(heavy & set(sys.modules)))
"""
    child = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "Rig files:" in child.stdout
    assert child.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--width-px", "wide"], "'--width-px': expected a whole number, got 'wide'"),
        (["--q1-deg", "left"], "'--q1-deg': expected a number, got 'left'"),
        (["--samples", "0"], "'--samples': expected a number greater than or equal to 1, got '0'"),
        (["--light", "none"], "'--light': 'none' is not one of 'draft', 'full'"),
    ],
)
def test_a_bad_value_of_the_command_line_is_named_beside_what_was_expected(arguments, words):
    result = CliRunner().invoke(app, ["render", "aqua2", *arguments])
    assert (result.exit_code, words in result.stderr) == (2, True), result.stderr
