"""The reference of the command line, from the help that typer makes."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from typer.core import TyperGroup
from typer.main import get_command

from mirrorgaze.cli import app

OTHERS = "Commands"
"""Heading of commands that belong to no group."""


def write_command_pages(folder: Path) -> None:
    """Write an index of all commands by group, and a page for each."""
    program = get_command(app)
    assert isinstance(program, TyperGroup)
    folder.mkdir(parents=True, exist_ok=True)
    groups: dict[str, list[str]] = {}
    for name, command in program.commands.items():
        groups.setdefault(_panel(command) or OTHERS, []).append(name)
        (folder / f"{name}.md").write_text(command_page(name, command), encoding="utf-8")
    (folder / "index.md").write_text(_index(program, groups), encoding="utf-8")


def command_page(name: str, command: Any) -> str:
    """A command as Markdown: what it does, its arguments and options, examples."""
    said, examples = _said(command)
    context = command.make_context(f"mirrorgaze {name}", [], resilient_parsing=True)
    usage = " ".join(command.collect_usage_pieces(context))
    parts = [f"# {name}", said, f"```\nmirrorgaze {name} {usage}\n```"]
    tables: dict[str, list[str]] = {}
    for parameter in command.params:
        record = parameter.get_help_record(context)
        if record is not None:
            heading = "Arguments" if parameter.param_type_name == "argument" else _panel(parameter) or "Options"
            tables.setdefault(heading, []).append(_row(*record))
    for heading, rows in tables.items():
        parts.append(f"## {heading}\n\n| name | what it does | default |\n|---|---|---|\n" + "\n".join(rows))
    if examples:
        parts.append("## Example\n\n```\n" + "\n".join(examples) + "\n```")
    return "\n\n".join(parts) + "\n"


def _said(command: Any) -> tuple[str, list[str]]:
    """A command's help without its examples, and the examples."""
    lines = [line.strip() for line in (command.help or "").replace("\b", "").splitlines()]
    examples = [line for line in lines if re.match(r"(mirrorgaze|\./run) [a-z-]+ ", line)]
    said = [line for line in lines if line not in {*examples, "Example:", "Examples:"}]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(said)).strip(), examples


def _row(names: str, text: str) -> str:
    """A row of a table: names and value, what it says, and what typer adds in brackets: default, limits, required."""
    text, _, more = text.removesuffix("]").partition("  [") if text.endswith("]") else (text, "", "")
    return f"| `{_cell(names)}` | {_cell(text)} | {_cell(more.removeprefix('default: '))} |"


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def _panel(item: Any) -> str | None:
    panel = getattr(item, "rich_help_panel", None)
    return panel if isinstance(panel, str) else None


def _index(program: TyperGroup, groups: dict[str, list[str]]) -> str:
    parts = [
        "# Command line",
        "`./run COMMAND` and `mirrorgaze COMMAND` do the same; `mirrorgaze COMMAND --help` prints what these pages "
        "say. Exit status: 0 success, 1 failure, 2 bad input.",
    ]
    contents = []
    for group, names in groups.items():
        rows = [
            f"| [{name}]({name}.md) | {_cell(_said(program.commands[name])[0].splitlines()[0])} |" for name in names
        ]
        parts.append(f"## {group}\n\n| command | what it does |\n|---|---|\n" + "\n".join(rows))
        contents.append(f"```{{toctree}}\n:hidden:\n:caption: {group}\n\n" + "\n".join(names) + "\n```")
    return "\n\n".join([*parts, *contents]) + "\n"
