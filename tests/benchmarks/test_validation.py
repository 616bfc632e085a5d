"""The validation page is what its rows and their last results say, and every row can be run."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest

from benchmarks.__main__ import CHECKS, NAMES
from benchmarks.validation import page, rows, running
from benchmarks.validation.rows import Result, Row

ROOT = Path(__file__).parents[2]


def test_the_page_is_made_from_its_rows():
    made = page.page(rows.rows(), rows.results())
    assert page.PAGE.read_text(encoding="utf-8") == made, "python -m benchmarks.validation WORD writes it again"


@pytest.mark.parametrize("check", sorted({check for row in rows.rows() for check in row.run}))
def test_what_a_row_runs_is_there(check):
    kind, *rest = check.split()
    if kind == "bench":
        assert rest[0] in (*NAMES, *CHECKS)
    elif kind == "script":
        assert importlib.util.find_spec(f"benchmarks.validation.{rest[0]}")
    else:
        assert (ROOT / check).exists()


def test_a_row_has_something_to_run_or_says_why_not():
    assert all(bool(row.run) != bool(row.why) for row in rows.rows())
    assert len({row.claim for row in rows.rows()}) == len(rows.rows())


def test_a_row_holds_when_all_that_it_runs_does_and_what_it_says_is_kept(tmp_path, monkeypatch):
    good, bad = tmp_path / "test_good.py", tmp_path / "test_bad.py"
    good.write_text("def test_it(record_property):\n    record_property('difference', '1 mm')\n")
    bad.write_text("def test_it():\n    raise AssertionError('beyond')\n")
    row = Row(claim="a", judge="b", difference="2 mm", limit="3 mm", run=(str(good),))
    held = running.run_row(row)
    assert (held.held, held.difference) == (True, "1 mm")
    assert not running.run_row(Row(claim="a", judge="b", difference="", limit="", run=(str(good), str(bad)))).held
    assert "| a | b | 1 mm | 3 mm |" in page.page([row], {"a": held})
    assert "FAILED" in page.page([row], {"a": Result(date="2026-01-01", held=False)})
