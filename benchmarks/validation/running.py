"""Rows run: tests by pytest, comparisons by the benchmarks."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
from datetime import UTC, datetime
from pathlib import Path

from benchmarks.validation.rows import Result, Row

ROOT = Path(__file__).parents[2]
DIFFERENCE = "difference"
"""The property by which a test says what it found."""
SAID = "difference: "
"""How a line begins by which a script says what it found."""
PYTEST = ("-m", "pytest", "-q", "-n", "0", "-o", "junit_family=xunit1")
LAST_LINES = 15


def run_row(row: Row) -> Result:
    """Run all that a row names; it holds when all of it does. What fails is shown on stderr."""
    found = [_ran(each) for each in row.run]
    said = [difference for _, differences in found for difference in differences]
    return Result(
        date=datetime.now(UTC).date().isoformat(), held=all(held for held, _ in found), difference="; ".join(said)
    )


def _ran(check: str) -> tuple[bool, list[str]]:
    """Whether a check held, and the differences that it said."""
    kind, *arguments = shlex.split(check)
    if kind == "bench":
        return _done(["-m", "benchmarks", *arguments])
    if kind == "script":
        return _done(["-m", f"benchmarks.validation.{arguments[0]}"])
    with tempfile.TemporaryDirectory() as scratch:
        report = Path(scratch) / "tests.xml"
        held, _ = _done([*PYTEST, check, "--junitxml", str(report)])
        return held, _differences(report) if report.is_file() else []


def _differences(report: Path) -> list[str]:
    """What tests said of the differences that they found."""
    found = []
    for case in ET.parse(report).iter("testcase"):
        which = case.get("name", "").partition("[")[2].rstrip("]")
        found += [
            f"{which}: {said.get('value')}" if which else str(said.get("value"))
            for said in case.iter("property")
            if said.get("name") == DIFFERENCE
        ]
    return found


def _done(arguments: list[str]) -> tuple[bool, list[str]]:
    """Whether a Python program in the repository ends well, and the differences that it prints."""
    ended = subprocess.run(
        [sys.executable, *arguments],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    lines = ended.stdout.splitlines()
    if ended.returncode:
        print("\n".join(lines[-LAST_LINES:]), file=sys.stderr)
    said = [line.removeprefix(SAID) for line in lines if line.startswith(SAID)]
    return ended.returncode == 0, said
