"""What the benchmarks import of ours is there: types are not checked in them, and nothing else runs them."""

import ast
import importlib
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

OURS = ("rigs", "optics", "cad", "scenes", "tracking", "dives", "reports", "benchmarks")
FILES = sorted((Path(__file__).parents[2] / "benchmarks").rglob("*.py"))


def is_there(module, name):
    """Whether a module has a name, or a module of that name, which others may not have loaded yet."""
    return hasattr(importlib.import_module(module), name) or _is_module(module, name)


def _is_module(package, name):
    # What is no package has no modules.
    return hasattr(sys.modules[package], "__path__") and find_spec(f"{package}.{name}") is not None


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_what_a_benchmark_imports_of_ours_is_there(file):
    tree = ast.parse(file.read_text(encoding="utf-8"))
    found = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module.split(".")[0] in OURS]
    missing = [
        f"{node.module}.{alias.name}" for node in found for alias in node.names if not is_there(node.module, alias.name)
    ]
    assert missing == []
