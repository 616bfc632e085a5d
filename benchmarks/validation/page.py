"""The page of the manual: every claim, its judge, the difference, the limit, and when it was last run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from benchmarks.validation.rows import HERE, Result, Row

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "validation.md"
TEXT = HERE / "page.md"
TABLE = "TABLE\n"
HEAD = ("claim", "checked against", "difference", "fails at", "where", "last run")


def page(rows: Sequence[Row], results: Mapping[str, Result]) -> str:
    """Markdown of the page: the text beside this module with the table in it."""
    lines = [HEAD, ("---",) * len(HEAD), *(_cells(row, results.get(row.claim)) for row in rows)]
    table = "".join(f"| {' | '.join(cells)} |\n" for cells in lines)
    return TEXT.read_text(encoding="utf-8").replace(TABLE, table)


def _cells(row: Row, result: Result | None) -> tuple[str, ...]:
    where = ", ".join(map(_place, row.run)) or row.why
    difference = row.difference if result is None or not result.difference else result.difference
    return row.claim, row.judge, difference, row.limit, where, _last_run(row, result)


def _place(check: str) -> str:
    kind, _, rest = check.partition(" ")
    if kind == "script":
        return f"`benchmarks/validation/{rest}.py`"
    return f"`./run {check}`" if kind == "bench" else f"`{check}`"


def _last_run(row: Row, result: Result | None) -> str:
    if not row.run:
        return "needs a graphics card"
    if result is None:
        return "in `./run test`" if all(run.startswith("tests/") for run in row.run) else "by hand"
    return f"{result.date}: {'held' if result.held else 'FAILED'}"
