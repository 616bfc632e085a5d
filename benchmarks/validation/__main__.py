"""`./run validate [WORD ...]`: run every row of the validation page, or those that hold a word, and write the page.

Prints claim, judge, difference, limit and outcome of each, and returns 1 when one fails. All of it takes hours (whole
images alone more than one); rows that are not run keep the day of their last run.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from benchmarks.validation.page import PAGE, page
from benchmarks.validation.rows import Row, keep, results, rows
from benchmarks.validation.running import run_row


def main(arguments: Sequence[str] | None = None) -> int:
    """Run rows, keep what became of them, and write the page."""
    parser = argparse.ArgumentParser(prog="./run validate", description="Run every row of the validation page.")
    parser.add_argument("words", nargs="*", metavar="word", help="only rows whose claim, judge or check holds a word")
    options = parser.parse_args(arguments)
    chosen = [row for row in rows() if row.run and _is_meant(row, options.words)]
    if not chosen:
        parser.error(f"expected a word of some row, got {' '.join(options.words)}")
    failed = 0
    for row in chosen:
        result = run_row(row)
        failed += not result.held
        # At once: a run of hours may be stopped.
        keep({row.claim: result})
        PAGE.write_text(page(rows(), results()), encoding="utf-8")
        difference = result.difference or row.difference
        print(
            f"{'held  ' if result.held else 'FAILED'} {row.claim} | {row.judge} | {difference} | {row.limit}",
            flush=True,
        )
    print(f"{len(chosen) - failed} of {len(chosen)} rows held; {PAGE}")
    return 1 if failed else 0


def _is_meant(row: Row, words: Sequence[str]) -> bool:
    text = " ".join([row.claim, row.judge, *row.run]).lower()
    return not words or any(word.lower() in text for word in words)


if __name__ == "__main__":
    sys.exit(main())
