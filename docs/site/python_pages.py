"""The reference of the Python packages: a page for each room, made from the docstrings of its modules."""

from __future__ import annotations

import importlib
import tomllib
from pathlib import Path

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
        contents.append("\n".join([".. toctree::", "   :hidden:", f"   :caption: {package}", "", *_indent(pages)]))
    (folder / "index.rst").write_text(_index(packages(root)) + "\n\n" + "\n\n".join(contents) + "\n", encoding="utf-8")


def public_names(package: str) -> list[str]:
    """What a package promises to be imported from it."""
    return sorted(getattr(importlib.import_module(package), "__all__", ()))


def _room_page(root: Path, name: str, modules: list[Path]) -> str:
    parts = [_heading(name, "="), f".. automodule:: {name}\n   :no-members:\n   :noindex:"]
    for module in modules:
        dotted = ".".join(module.relative_to(root).with_suffix("").parts)
        parts += [_heading(module.stem, "-"), f".. automodule:: {dotted}\n   :members:"]
    return "\n\n".join(parts) + "\n"


def _index(names: list[str]) -> str:
    parts = [
        _heading("Python", "="),
        "Made from the docstrings. Each package says below what it promises to be imported from it; everything else "
        "may move from one version to the next. Units are in the names, shapes in the docstrings, frames and signs on "
        "the page of :doc:`conventions </reference/conventions>`.",
    ]
    for package in names:
        module = importlib.import_module(package)
        parts += [_heading(package, "-"), (module.__doc__ or "").strip()]
        rows = [
            f"   * - :py:obj:`{name} <{_home(module, name)}>`\n     - {_summary(module, name)}"
            for name in public_names(package)
        ]
        if rows:
            parts.append("\n".join([".. list-table::", "   :widths: auto", "", *rows]))
    return "\n\n".join(parts)


def _home(package: object, name: str) -> str:
    """Where a public name is defined, and therefore described."""
    value = getattr(package, name)
    module, inner = getattr(value, "__module__", None), getattr(value, "__qualname__", None)
    return f"{module}.{inner}" if module and inner else f"{getattr(package, '__name__', '')}.{name}"


def _summary(package: object, name: str) -> str:
    value = getattr(package, name)
    if not (isinstance(value, type) or callable(value)):
        return ""
    return (value.__doc__ or "").strip().split("\n\n")[0].replace("\n", " ")


def _heading(text: str, line: str) -> str:
    return f"{text}\n{line * len(text)}"


def _indent(lines: list[str]) -> list[str]:
    return [f"   {line}" for line in lines]
