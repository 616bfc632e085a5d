"""Every command line that README, manual and help show is one that the command line takes."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import click
import pytest
from typer.main import get_command

from mirrorgaze.cli import app

ROOT = Path(__file__).parents[2]
CHANGELOG = ROOT / "CHANGELOG.md"  # tells of commands as they were
PAGES = sorted(
    {*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "notebooks").glob("*.ipynb")} - {CHANGELOG}
)
COMMANDS: dict[str, click.Command] = get_command(app).commands  # type: ignore[attr-defined]

OF_RUN = set(re.findall(r"^([a-z]+)\)$", (ROOT / "run").read_text(encoding="utf-8"), re.MULTILINE))
"""What `./run` does itself: setup, test and so on."""


def options_of(command: click.Command) -> set[str]:
    return {option for p in command.params for option in (*p.opts, *p.secondary_opts)} | {"--help"}


LINE = re.compile(r"(?:^|[\s(`])(?P<by>\./run|mirrorgaze) +(?P<rest>(?!import)[a-z-][^`]*)")


def shown(text: str) -> list[str]:
    """What is set as code in a page: blocks between fences, indented blocks, and spans between backticks."""
    fenced = re.findall(r"^ *```(?!python|toml)[a-z]*\n(.*?)^ *```", text, re.MULTILINE | re.DOTALL)
    prose = re.sub(r"^ *```.*?^ *```", "", text, flags=re.MULTILINE | re.DOTALL)
    lines = "\n".join([*fenced, *re.findall(r"^ {4,}(.*)$", prose, re.MULTILINE)]).replace("\\\n", " ").split("\n")
    return [*lines, *(" ".join(span.split()) for span in re.findall(r"`([^`]+)`", prose))]


def problems(line: str) -> list[str]:
    """What is wrong with the command lines in a line."""
    found = []
    if alone := re.match(r"(--[a-z][a-z0-9-]*)", line):
        known = set().union(*map(options_of, COMMANDS.values()))
        found += [] if alone[1] in known else [f"no command has {alone[1]}"]
    for match in LINE.finditer(line):
        words = shlex.split(re.split(r"[;>|]", match["rest"])[0], comments=True)
        name, arguments = words[0], words[1:]
        if name.startswith("-") or (match["by"] == "./run" and name in OF_RUN):
            continue
        if name not in COMMANDS:
            found.append(f"no command {name}")
            continue
        options = options_of(COMMANDS[name])
        given = (word.partition("=")[0] for word in arguments if re.match(r"--?[a-z]", word))
        found += [f"{name} has no {option}" for option in given if option not in options]
    return found


def text_of(page: Path) -> str:
    text = page.read_text(encoding="utf-8")
    if page.suffix != ".ipynb":
        return text
    return "\n\n".join("".join(c["source"]) for c in json.loads(text)["cells"] if c["cell_type"] == "markdown")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_command_lines_are_taken(page):
    assert [problem for line in shown(text_of(page)) for problem in problems(line)] == []


@pytest.mark.parametrize("name", COMMANDS)
def test_the_examples_of_help_are_taken(name):
    help_lines = (COMMANDS[name].help or "").splitlines()
    examples = [line for line in help_lines if re.match(r"\s*(\./run|mirrorgaze) ", line)]
    assert [problem for line in examples for problem in problems(line)] == []


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("`mirrorgaze render aqua2 --q1-deg 30 -o x.png`", []),
        ("`mirrorgaze rendr aqua2`", ["no command rendr"]),
        ("```\n./run render aqua2 --q9 30   # a comment with --flags\n```", ["render has no --q9"]),
        ("    mirrorgaze gaze aqua2 --azimuth-deg -40 \\\n        --elevaton=3", ["gaze has no --elevaton"]),
        ("`--samples 3`, `--sampels`", ["no command has --sampels"]),
        ("`./run bench train` and mirrorgaze designs things", []),
    ],
)
def test_what_is_wrong_is_found(text, found):
    assert [problem for line in shown(text) for problem in problems(line)] == found
