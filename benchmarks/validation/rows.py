"""Claims and what became of them: read from and written to the files beside this module."""

from __future__ import annotations

import json
import tomllib
from dataclasses import asdict, dataclass
from pathlib import Path

HERE = Path(__file__).parent
ROWS, RESULTS = HERE / "rows.toml", HERE / "results.json"


@dataclass(frozen=True, kw_only=True)
class Row:
    """A claim with its judge.

    Attributes
    ----------
    claim, judge : str
        What is said, and what it is checked against.
    difference : str
        The largest that was seen when the row was written; a run may say its own.
    limit : str
        At which the check fails.
    run : tuple of str
        Test files and folders, `bench NAME ARGUMENTS`, and `script NAME` of this folder.
    why : str
        Why there is nothing to run.
    """

    claim: str
    judge: str
    difference: str
    limit: str
    run: tuple[str, ...] = ()
    why: str = ""


@dataclass(frozen=True, kw_only=True)
class Result:
    """What became of a row: its day (ISO 8601), whether it held, and the difference where the run said one."""

    date: str
    held: bool
    difference: str = ""


def rows() -> list[Row]:
    """Every row of the page, in its order."""
    found = tomllib.loads(ROWS.read_text(encoding="utf-8"))["rows"]
    return [Row(**(row | {"run": tuple(row.get("run", ()))})) for row in found]


def results() -> dict[str, Result]:
    """What became of each row when it was last run, by its claim."""
    if not RESULTS.is_file():
        return {}
    return {claim: Result(**found) for claim, found in json.loads(RESULTS.read_text(encoding="utf-8")).items()}


def keep(found: dict[str, Result]) -> None:
    """Keep what became of rows, beside that of the rows that were not run."""
    whole = results() | found
    known = {row.claim: asdict(whole[row.claim]) for row in rows() if row.claim in whole}
    RESULTS.write_text(json.dumps(known, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
