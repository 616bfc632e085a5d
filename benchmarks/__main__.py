"""`python -m benchmarks [NAME ...] [--json]`: measure, and print a table (or JSON for machines).

Each module that measures speed has ``run() -> list of rows``; a row's `ratio` says how many times better `ours` is than
`peer`, whichever way the unit counts. A module that judges numbers, one of `CHECKS`, is run alone with options of its
own: ``main(arguments)`` prints the differences, and returns 1 when one is beyond its tolerance.

Each benchmark runs in a process of its own: what one has loaded would count as memory of what the next one starts,
since Linux counts what a process held before it became another program.
"""

from __future__ import annotations

import argparse
import importlib
import json
import sys
from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.processes import measured

NAMES = ("first", "design", "train", "projection", "coverage", "render", "search", "loop")
CHECKS = ("healpix", "distances", "bias", "robots", "detector", "control", "studio", "kills", "simulator")
COLUMNS = ("name", "ours", "peer", "unit", "ratio", "note")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmarks named, all by default, or one check; 2 for a name that does not exist."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    if arguments and arguments[0] in CHECKS:
        return int(importlib.import_module(f"benchmarks.{arguments[0]}").main(arguments[1:]))
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks",
        description="Speed side by side with other codes.",
        epilog=f"Numbers side by side with other codes: {', '.join(CHECKS)}; one at a time, each with its own --help.",
    )
    parser.add_argument("names", nargs="*", metavar="name", help=f"{', '.join(NAMES)}; all by default")
    parser.add_argument("--json", action="store_true", help="print rows for machines")
    options = parser.parse_args(arguments)
    unknown = [name for name in options.names if name not in NAMES]
    if unknown:
        expected = f"expected benchmarks among {', '.join(NAMES)}, or first one of {', '.join(CHECKS)}"
        print(f"{expected}, got {', '.join(unknown)}", file=sys.stderr)
        return 2
    rows = []
    for name in options.names or NAMES:
        print(f"{name} ...", file=sys.stderr, flush=True)
        rows += measured(f"benchmarks.{name}")
    if options.json:
        print(json.dumps(rows, indent=2))
    else:
        Console().print(table(rows))
    return 0


def table(rows: list[dict[str, Any]]) -> Table:
    """Rows as people read them: numbers to three digits, the ratio as a factor."""
    result = Table(*COLUMNS)
    for row in rows:
        cells = {**row, "ours": f"{row['ours']:.3g}", "peer": f"{row['peer']:.3g}", "ratio": f"{row['ratio']:.3g} x"}
        result.add_row(*(str(cells[column]) for column in COLUMNS))
    return result


if __name__ == "__main__":
    sys.exit(main())
