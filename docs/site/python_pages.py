"""The reference of the Python packages: a page for each room, made from the docstrings of its modules."""

from __future__ import annotations

import importlib
import inspect
import tomllib
from pathlib import Path
from typing import Any

_TITLE = "mirrorgaze"


def packages(root: Path) -> list[str]:
    """The import packages, in the order of pyproject.toml, without the command line (its page is another)."""
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))
    named: list[str] = project["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]
    return [name for name in named if name != _TITLE]


def write_python_pages(root: Path, folder: Path) -> None:
    """Write an index of the packages and their public names, and a page for each folder of modules."""
    folder.mkdir(parents=True, exist_ok=True)
    contents = []
    for package in packages(root):
        rooms = [root / package, *sorted(p for p in (root / package).rglob("*") if p.is_dir())]
        pages = []
        for room in rooms:
            modules = sorted(p for p in room.glob("*.py") if not p.name.startswith("_"))
            name = ".".join(room.relative_to(root).parts)
            if modules:
                (folder / f"{name}.rst").write_text(_room_page(root, name, modules), encoding="utf-8")
                pages.append(name)
        contents.append("\n".join(["```{toctree}", ":hidden:", f":caption: {package}", "", *pages, "```"]))
    (folder / "index.md").write_text("\n\n".join([*_index(packages(root)), *contents]) + "\n", encoding="utf-8")


def public_names(package: str) -> list[str]:
    """What a package promises to be imported from it."""
    return sorted(getattr(importlib.import_module(package), "__all__", ()))


def _room_page(root: Path, name: str, modules: list[Path]) -> str:
    parts = [_heading(name, "="), f".. automodule:: {name}\n   :no-members:\n   :noindex:"]
    for module in modules:
        dotted = ".".join(module.relative_to(root).with_suffix("").parts)
        parts += [_heading(module.stem, "-"), f".. automodule:: {dotted}\n   :members:"]
    return "\n\n".join(parts) + "\n"


def _index(names: list[str]) -> list[str]:
    parts = [
        "# Python",
        "Made from the docstrings. Each package says below what it promises to be imported from it; everything else "
        "may move from one version to the next. Units are in the names, shapes in the docstrings, frames and signs on "
        "the page of [conventions](../conventions.md).",
    ]
    for package in names:
        module = importlib.import_module(package)
        parts += [f"## {package}", (module.__doc__ or "").strip()]
        rows = [_row(getattr(module, name), name) for name in public_names(package)]
        if rows:
            parts.append("\n".join(["| name | what it is |", "|---|---|", *rows]))
    return parts


def _row(value: Any, name: str) -> str:
    """A public name, linked to where it is defined, and the first sentence of its docstring; of an alias the name."""
    if not (isinstance(value, type) or inspect.isroutine(value)) or not value.__doc__:
        return f"| `{name}` | |"
    summary = " ".join(value.__doc__.strip().split("\n\n")[0].split()).replace("|", "\\|")
    return f"| {{py:obj}}`{name} <{value.__module__}.{value.__qualname__}>` | {summary} |"


def _heading(text: str, line: str) -> str:
    return f"{text}\n{line * len(text)}"
