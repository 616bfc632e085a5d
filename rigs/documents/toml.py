"""TOML read in time that grows with its length, whoever wrote it: what no person writes is refused before it is parsed.

The parser calls itself for every list in a list, copies a dotted key for each of its parts, and leaves whole numbers to
a function with a limit of its own. So depth and length are looked at first, in one pass over the text.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

from rigs.documents.problems import Problem, SpecificationError

MOST_CHARACTERS = 2_000_000
MOST_DEEP = 32
"""Lists and tables inside each other, and parts of a dotted key: rig and dive files have three."""

LONGEST_WORD = 1000
"""Characters of a bare key or a number."""

SEGMENTS = re.compile(
    r'"""(?:[^\\]|\\.)*?(?:"""|\Z)'
    r"|'''.*?(?:'''|\Z)"
    r'|"(?:[^"\\\n]|\\.)*"'
    r"|'[^'\n]*'"
    r"|#[^\n]*"
    r"|(?P<word>[A-Za-z0-9_+-]+)"
    r"|(?P<mark>[\[\]{}.,=\n])",
    re.DOTALL,
)
"""Texts and comments, which are passed over, words, and the marks that nest."""


class TomlError(ValueError):
    """Text that is no TOML, or none that a person writes; `problem` says where and what was expected."""

    def __init__(self, problem: Problem):
        self.problem = problem
        super().__init__(str(problem))


def read_toml(path: Path, *, source: str, error: type[SpecificationError]) -> str:
    """Text of a TOML file; raises the error given when it is not UTF-8."""
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as found:
        place = f"byte {found.start}"
        raise error(source, [Problem(place=place, value=None, expected="text in UTF-8, as TOML is")]) from None


def parse_toml(text: str, *, source: str, error: type[SpecificationError]) -> dict[str, Any]:
    """Parsed TOML; raises the error given with the line where it is none."""
    try:
        return parsed(text)
    except TomlError as found:
        raise error(source, [found.problem]) from None


def file_beside(name: str, folder: Path) -> str:
    """Whole path of a file in a folder by its name with an ending, or the name as it is where there is no such file."""
    file = folder / name
    return str(file.resolve()) if Path(name).suffix and file.is_file() else name


def parsed(text: str) -> dict[str, Any]:
    """Parsed TOML; raises `TomlError` with the line where it is none."""
    _check_size(text)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        message, _, place = str(error).removesuffix(")").rpartition(" (at ")
        raise TomlError(Problem(place=place, value=None, expected=f"valid TOML: {message}")) from None


def _check_size(text: str) -> None:
    if len(text) > MOST_CHARACTERS:
        raise _too_much(1, f"a file of at most {MOST_CHARACTERS:,} characters, got {len(text):,}")
    line = open_brackets = dots = 0
    for piece in SEGMENTS.finditer(text):
        mark = piece["mark"]
        if mark == "\n":
            line += 1
        if mark is None:
            # Lines inside a text count as well.
            line += piece[0].count("\n")
        elif mark == ".":
            dots += 1
        else:
            dots = 0
            open_brackets += (mark in "[{") - (mark in "]}")
        if max(open_brackets, dots) >= MOST_DEEP:
            raise _too_much(line + 1, f"tables and lists at most {MOST_DEEP} deep")
        if piece["word"] is not None and len(piece["word"]) > LONGEST_WORD:
            raise _too_much(line + 1, f"keys and numbers of at most {LONGEST_WORD:,} characters")


def _too_much(line: int, expected: str) -> TomlError:
    return TomlError(Problem(place=f"line {line}", value=None, expected=expected))
