"""Help as plain text, with commands and options under headings.

Typer shows headings (`rich_help_panel`) in its rich help only, which takes longer to import than all of ours to run.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from typing import Any, ClassVar

from typer import BadParameter
from typer.core import TyperCommand, TyperGroup

from mirrorgaze.errors import said_of_value

WIDEST_NAME = 30
"""Columns of the names, beyond which the text starts on the next line."""

EXAMPLE = "e.g."

NAMES_INDENT = 2
GAP = 2


class SectionedGroup(TyperGroup):
    """Commands under the headings that they were added with, and below each an example."""

    examples: ClassVar[dict[str, str]] = {}
    """By heading."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write a section of commands for each heading."""
        commands = [(name, self.commands[name]) for name in self.list_commands(ctx)]
        room = formatter.width - NAMES_INDENT - GAP - max(len(name) for name, _ in commands)
        listed = [
            (getattr(each, "rich_help_panel", None), (name, each.get_short_help_str(room))) for name, each in commands
        ]
        examples = [(heading, (EXAMPLE, line)) for heading, line in self.examples.items()]
        write_sections(formatter, [*listed, *examples], otherwise="Commands")


class SectionedCommand(TyperCommand):
    """Arguments, options, and the options of each heading."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse arguments; of a bad value it is said what was expected, and what it is."""
        try:
            return super().parse_args(ctx, args)
        except BadParameter as error:
            error.message = said_of_value(error)
            raise

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write a section of options for each heading."""
        records = ((parameter, parameter.get_help_record(ctx)) for parameter in self.get_params(ctx))
        shown = [(parameter, record) for parameter, record in records if record is not None]
        arguments = [("Arguments", record) for each, record in shown if each.param_type_name == "argument"]
        options = [
            (getattr(each, "rich_help_panel", None), record)
            for each, record in shown
            if each.param_type_name != "argument"
        ]
        # What belongs to no heading comes before what belongs to one.
        write_sections(formatter, arguments + sorted(options, key=lambda entry: entry[0] is not None))


def write_sections(
    formatter: Any, entries: Iterable[tuple[str | None, tuple[str, str]]], *, otherwise: str = "Options"
) -> None:
    """Write entries, each a name and its text, under their headings, with the texts of all sections in one column."""
    sections = defaultdict(list)
    for heading, entry in entries:
        sections[heading or otherwise].append(entry)
    width = min(max(len(name) for rows in sections.values() for name, _ in rows), WIDEST_NAME)
    for heading, rows in sections.items():
        with formatter.section(heading):
            formatter.write_dl([(name.ljust(width), text) for name, text in rows])
