"""The commit rule of CONTRIBUTING.md, as .pre-commit-config.yaml has it checked."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

problems = runpy.run_path(str(Path(__file__).parents[2] / ".ci" / "commit_message.py"))["problems"]

GOOD = "optics: aim at a dome without arcsines\n\nThey cost a third of the projection. 24 M points/s instead of 17.\n"


@pytest.mark.parametrize("message", [GOOD, "Merge branch 'x'\n", f"{GOOD}# Please enter the commit message\n"])
def test_good_messages_pass(message):
    assert problems(message) == []


@pytest.mark.parametrize(
    ("message", "problem"),
    [
        (f"optics: {'x' * 65}\n\nWhy.\n", "73 characters"),
        ("Aim at a dome\n\nWhy.\n", "component"),
        ("optics: aim\nWhy.\n", "empty line"),
        ("optics: aim\n\n# a comment\n", "no body"),
    ],
)
def test_bad_messages_are_told(message, problem):
    assert problem in "; ".join(problems(message))
