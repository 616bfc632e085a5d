"""Our packages have plain names: another distribution's `rigs` or `optics` must not stand in for ours."""

from __future__ import annotations

import importlib
import tomllib
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((CHECKOUT / "pyproject.toml").read_text(encoding="utf-8"))
PACKAGES = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]


@pytest.mark.parametrize("name", PACKAGES)
def test_a_package_is_the_one_in_this_checkout(name):
    file = importlib.import_module(name).__file__
    assert file is not None, f"{name} is a folder without __init__.py"
    assert Path(file).resolve().parent == CHECKOUT / name
