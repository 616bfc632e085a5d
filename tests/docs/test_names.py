"""Modules, names and files of the code that the manual mentions exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = sorted([ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").rglob("*.md")])
ROOMS = "rigs|optics|cad|scenes|tracking|dives|reports|studio|mirrorgaze|benchmarks"

DOTTED = re.compile(rf"(?<![\w./-])(?:{ROOMS})(?:\.[A-Za-z_]\w*)+")
FILE = re.compile(rf"(?<![\w./-])(?:{ROOMS}|tests|docs|notebooks)/[\w/.-]*[\w/]")
IMPORT = re.compile(rf"^from ((?:{ROOMS})[\w.]*) import (\w[\w, ]*)", re.MULTILINE)
TEST = re.compile(r"`((?:\w+/)*test_\w+)`")

EXAMPLES = {"optics/x.py", "tests/optics/test_x.py", "rigs/presets/NAME.toml", "rigs/aqua2-01.toml"}
"""Stand for a name of the reader's."""


def is_there(name: str) -> bool:
    """Whether a dotted name is a module, or a name in a module; what belongs to a class is not followed."""
    place = ROOT
    parts = name.split(".")
    for at, part in enumerate(parts):
        if (place / part).is_dir():
            place /= part
        elif (place / f"{part}.py").is_file():
            rest = parts[at + 1 :]
            return not rest or _names(place / f"{part}.py", rest[0])
        else:
            return _names(place / "__init__.pyi", part) or _names(place / "__init__.py", part)
    return True


def _names(module: Path, name: str) -> bool:
    return module.is_file() and re.search(rf"\b{name}\b", module.read_text(encoding="utf-8")) is not None


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_names_of_the_code_exist(page):
    text = page.read_text(encoding="utf-8")
    spans = "\n".join(re.findall(r"`+([^`]+)`+", text))
    named = set(DOTTED.findall(spans)) | set(re.findall(rf"^(?:from|import) ((?:{ROOMS})[\w.]*)", spans, re.MULTILINE))
    assert sorted(name for name in named if not is_there(name)) == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_files_that_are_named_exist(page):
    spans = "\n".join(re.findall(r"`([^`\n]+)`", page.read_text(encoding="utf-8")))
    assert sorted(name for name in {*FILE.findall(spans)} - EXAMPLES if not (ROOT / name).exists()) == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_tests_that_are_named_exist(page):
    """By the name of their file, with as much of its folder as tells it from others, or by that of the test."""
    files = [path.with_suffix("").as_posix() for path in (ROOT / "tests").rglob("test_*.py")]
    named = set(TEST.findall(page.read_text(encoding="utf-8")))
    assert sorted(name for name in named if not any(file.endswith(f"/{name}") for file in files)) == []


def test_what_is_imported_from_a_package_is_there():
    """Blocks of Python: `from X import a, b` finds each name in X."""
    missing = []
    for page in PAGES:
        for module, names in IMPORT.findall(page.read_text(encoding="utf-8")):
            missing += [
                f"{page.name}: {module}.{n}" for n in names.split(", ") if not is_there(f"{module}.{n.strip()}")
            ]
    assert missing == []


@pytest.mark.parametrize(
    ("name", "there"),
    [
        ("optics.train", True),
        ("optics.train.OpticalTrain", True),
        ("optics.trane", False),
        ("optics.train.Tram", False),
    ],
)
def test_a_wrong_name_is_found(name, there):
    assert is_there(name) == there
