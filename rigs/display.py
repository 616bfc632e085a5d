"""How a rig, a coverage or a dive shows itself in a notebook."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

Facts = list[tuple[str, str]]
"""Rows of a table: a name, and its value."""


def facts_table(title: str, facts: Iterable[tuple[str, str]]) -> str:
    """HTML table of facts under a title."""
    rows = "".join(
        f'<tr><th style="text-align:left">{escape(name)}</th><td style="text-align:left">{escape(value)}</td></tr>'
        for name, value in facts
    )
    return f"<table><caption>{escape(title)}</caption>{rows}</table>"
