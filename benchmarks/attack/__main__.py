"""`./run attack [NAME ...] --minutes N`: attack with damaged files, kills and a full disk, and print what became of it.

The damage of a case follows from seed, attack and number alone: `./run attack rigs --case 4711` does one of them again
and shows what it raises.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.attack.running import SCRATCH, attacked, drawn, module
from benchmarks.attack.verdicts import SLOW_S, Tally

SHARES = {"rigs": 24, "dives": 19, "hulls": 15, "caches": 5, "journals": 10, "kills": 20, "disk": 5, "builds": 2}
"""Attacks, and the share of the time that each may take until it has as many cases as its goal."""

HEAD = ("attack", "tried", "refused", "through", "tracebacks", "lost", f"over {SLOW_S:.0f} s", "slowest")


def main(arguments: Sequence[str] | None = None) -> int:
    """Attack, and print the counts; 1 when something was lost, slow, or a mistake of ours."""
    options = _options(arguments)
    if options.case is not None:
        return _again(options)
    names = options.names or list(SHARES)
    whole = sum(SHARES[name] for name in names)
    tallies = []
    for name in names:
        seconds = 60 * options.minutes * SHARES[name] / whole
        tallies.append(attacked(name, seed=options.seed, cases=module(name).GOAL, seconds=seconds, say=_say))
    if options.json:
        print(json.dumps([tally.as_dict() for tally in tallies], indent=2))
    else:
        Console().print(_table(tallies))
        for story in (story for tally in tallies for story in tally.stories):
            print(story)
    return 0 if all(tally.held for tally in tallies) else 1


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="./run attack", description="Attack with damaged files, kills, a full disk.")
    parser.add_argument("names", nargs="*", metavar="name", choices=[[], *SHARES], help=f"{', '.join(SHARES)}; all")
    parser.add_argument("--minutes", type=float, default=10.0, help="how long, all attacks together (10)")
    parser.add_argument("--seed", type=int, default=0, help="of all damage (0)")
    parser.add_argument("--case", type=int, help="do this case of one attack again, and show what it raises")
    parser.add_argument("--json", action="store_true", help="print counts for machines")
    options = parser.parse_args(arguments)
    if options.case is not None and len(options.names) != 1:
        parser.error("--case: expected the name of one attack before it")
    return options


def _again(options: argparse.Namespace) -> int:
    (name,) = options.names
    with tempfile.TemporaryDirectory(dir=SCRATCH) as scratch:
        module(name).prepare(Path(scratch))(drawn(options.seed, name, options.case))
    print(f"{name} {options.case}: through")
    return 0


def _table(tallies: Sequence[Tally]) -> Table:
    table = Table(*HEAD)
    for tally in tallies:
        counts = (tally.tried, tally.refused, tally.through, tally.tracebacks, tally.lost, tally.slow)
        table.add_row(tally.name, *map(str, counts), f"{tally.slowest_s:.1f} s")
    return table


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
