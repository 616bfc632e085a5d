"""What commands share in what they print."""

from __future__ import annotations

import json
import sys
import webbrowser
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from optics.kernels.clock import Pace

TENTHS = 10
DOTS = "..."

BAR = 20
"""Characters of the bar that fills at a terminal."""

CLEAR = "\x1b[K"
"""Takes away what is left of a longer line at a terminal."""

_PACES: dict[str, Pace] = {}
"""Of what is being counted, by name."""


def print_json(data: Any) -> None:
    """Print data as JSON; numbers that JSON does not know are printed as text."""
    typer.echo(json.dumps(_plain(data), indent=2, ensure_ascii=False, allow_nan=False))


def print_table(rows: Iterable[Sequence[str]]) -> None:
    """Print rows of text, with all columns but the last as wide as their widest entry."""
    lines = [list(row) for row in rows]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)][:-1]
    for line in lines:
        padded = [text.ljust(width) for text, width in zip(line, widths, strict=False)]
        typer.echo("  ".join([*padded, line[-1]]))


def open_page(path: Path) -> None:
    """Open a written page in the user's browser; where there is none, say so."""
    if not webbrowser.open(path.resolve().as_uri()):
        print_note(f"{path}: found no browser to open it with")


def print_note(line: str) -> None:
    """Print a line on stderr, which leaves stdout to the results."""
    typer.echo(line, err=True)


def print_step(line: str) -> None:
    """Print a line on stderr of what is being done.

    One that ends in dots begins a part of the work (`optics.kernels.clock`): how long that took the last time is said
    with it.
    """
    if not line.endswith(DOTS):
        print_note(line)
        return
    from optics.kernels.clock import CLOCK, last_time

    name = line.removesuffix(DOTS).strip()
    CLOCK.begin(name)
    print_note(line + last_time(name))


def print_progress(name: str, done: int, total: int) -> None:
    """Print how far something is, and how long the rest takes at the pace since its first call, on stderr.

    At a terminal over what was printed before; into a file a line for every tenth.
    """
    from optics.kernels.clock import Pace

    pace = _PACES.setdefault(name, Pace())
    line = f"{name}: {done} of {total}{pace.to_go(done, total)}"
    if done >= total:
        _PACES.pop(name)
    if sys.stderr.isatty():
        filled = BAR * done // total
        typer.echo(f"\r{'█' * filled}{'░' * (BAR - filled)} {line}{CLEAR}", err=True, nl=done == total)
    elif done * TENTHS // total > (done - 1) * TENTHS // total:
        typer.echo(line, err=True)


def _plain(data: Any) -> Any:
    if isinstance(data, dict):
        return {str(key): _plain(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_plain(value) for value in data]
    try:
        json.dumps(data, allow_nan=False)
    except (TypeError, ValueError):
        return str(data)
    return data
