"""Modules, names and files of the code that the manual mentions exist, and so do parameters that docstrings list."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = sorted([ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").rglob("*.md")])
ROOMS = "rigs|optics|cad|scenes|tracking|dives|reports|studio|mirrorgaze|benchmarks"

DOTTED = re.compile(rf"(?<![\w./-])(?:{ROOMS})(?:\.[A-Za-z_]\w*)+")
FILE = re.compile(rf"(?<![\w./-])(?:{ROOMS}|tests|docs|notebooks)/[\w/.-]*[\w/]")
IMPORT = re.compile(rf"^from ((?:{ROOMS})[\w.]*) import (\w[\w, ]*)", re.MULTILINE)
TEST = re.compile(r"`((?:\w+/)*test_\w+)`")

SECTION = re.compile(r"^(Parameters|Attributes)\n-+\n(.*?)(?=\n\S[^\n]*\n-+(?:\n|$)|\Z)", re.MULTILINE | re.DOTALL)
LISTED = re.compile(r"^\S.*", re.MULTILINE)

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


def documented(tree: ast.Module) -> Iterator[ast.FunctionDef | ast.ClassDef]:
    """Public functions and classes of a module, and public methods of public classes."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
            yield node
            if isinstance(node, ast.ClassDef):
                yield from (n for n in node.body if isinstance(n, ast.FunctionDef) and not n.name.startswith("_"))


def listed(node: ast.FunctionDef | ast.ClassDef) -> set[str]:
    """Names that a docstring's sections of parameters and attributes list."""
    sections = [entries for _, entries in SECTION.findall(ast.get_docstring(node) or "")]
    lines = [line.split(" : ")[0] for entries in sections for line in LISTED.findall(entries)]
    return {name.strip().lstrip("*") for line in lines for name in line.split(",")}


def parameters(function: ast.FunctionDef) -> set[str]:
    """Names in a function's signature."""
    a = function.args
    return {arg.arg for arg in (*a.posonlyargs, *a.args, *a.kwonlyargs, a.vararg, a.kwarg) if arg is not None}


def names_of_class(node: ast.ClassDef, classes: dict[str, list[ast.ClassDef]]) -> set[str]:
    """Names of a class: of its constructor, fields, properties and what it sets on itself, also by its bases."""
    found = {n.attr for n in ast.walk(node) if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store)}
    for part in node.body:
        if isinstance(part, ast.FunctionDef):
            found |= parameters(part) if part.name == "__init__" else {part.name}
        elif isinstance(part, ast.Assign | ast.AnnAssign):
            targets = part.targets if isinstance(part, ast.Assign) else [part.target]
            found |= {target.id for target in targets if isinstance(target, ast.Name)}
    bases = {base.id for base in node.bases if isinstance(base, ast.Name)}
    for name in bases - {node.name}:
        found = found.union(*(names_of_class(base, classes) for base in classes[name]))
    return found


def names_nowhere(trees: dict[str, ast.Module]) -> list[str]:
    """Parameters and attributes that docstrings list and that the code beside them lacks."""
    classes: dict[str, list[ast.ClassDef]] = defaultdict(list)
    for node in (node for tree in trees.values() for node in tree.body):
        if isinstance(node, ast.ClassDef):
            classes[node.name].append(node)
    wrong = []
    for file, tree in trees.items():
        for node in documented(tree):
            if names := listed(node):
                there = names_of_class(node, classes) if isinstance(node, ast.ClassDef) else parameters(node)
                wrong += [f"{file}:{node.lineno} {node.name}: {name}" for name in sorted(names - there)]
    return wrong


def test_parameters_that_docstrings_list_are_there():
    files = [path for room in ROOMS.split("|") for path in sorted((ROOT / room).rglob("*.py"))]
    trees = {str(path.relative_to(ROOT)): ast.parse(path.read_text(encoding="utf-8")) for path in files}
    assert names_nowhere(trees) == []


LISTS_TOO_MANY = """
class Fold:
    \"\"\"A mirror.

    Parameters
    ----------
    angle, tilt : float
        Of its normal.

    Attributes
    ----------
    corners : array
    size : float
    \"\"\"

    def __init__(self, angle):
        self.corners = angle

def turned(fold, *, by):
    \"\"\"A mirror, turned.

    Parameters
    ----------
    mirror : Fold
    by : float

    Returns
    -------
    Fold
    \"\"\"
"""


def test_a_parameter_that_is_nowhere_is_found():
    found = names_nowhere({"fold.py": ast.parse(LISTS_TOO_MANY)})
    assert [wrong.split(" ", 1)[1] for wrong in found] == ["Fold: size", "Fold: tilt", "turned: mirror"]
