"""The site's source folder: pages and notebooks of the repository at the places that they have on the site.

On GitHub a page links a notebook by its place in the repository; on the site the notebook lies beside the tutorials'
index. Links are therefore turned from the one place to the other, and the tables of contents are read off the indexes.
"""

from __future__ import annotations

import json
import os
import re
import shutil
from pathlib import Path

DOORS = ("tutorials", "how-to", "reference", "explanation")

GENERATED = ("reference/command_line/index.md", "reference/rig_file.md", "reference/python/index.md", "gallery")
"""Pages and folders that may be linked though they are made with the site; below `docs`."""

_LINK = re.compile(r"(!?\[[^\]]*\]\()([^)#\s]+)([^)\s]*\))")

IMAGES = (".png", ".webp")
"""Suffixes of the pictures and films that pages show."""


def places(root: Path) -> dict[Path, Path]:
    """Where each file of the repository that the site shows lies below the site's source folder."""
    manual = root / "docs"
    pages = [p for p in manual.rglob("*") if p.suffix in {".md", *IMAGES} and manual / "site" not in p.parents]
    return {
        **{page: page.relative_to(manual) for page in sorted(pages)},
        **{page: Path("tutorials", page.name) for page in sorted((root / "notebooks").glob("*.ipynb"))},
        root / "CHANGELOG.md": Path("changelog.md"),
        root / "CONTRIBUTING.md": Path("contributing.md"),
    }


ELSEWHERE = {"README.md": Path("index.md")}
"""Files that the site does not show, and the page that links to them lead to."""


def stage(root: Path, source: Path) -> None:
    """Fill the folder `source` with what the site is built from, but for what is generated."""
    where = places(root)
    for file, place in where.items():
        target = source / place
        target.parent.mkdir(parents=True, exist_ok=True)
        if file.suffix in IMAGES:
            shutil.copyfile(file, target)
        elif file.suffix == ".ipynb":
            target.write_text(_notebook(file, where), encoding="utf-8")
        else:
            text = relinked(file.read_text(encoding="utf-8"), file, where)
            target.write_text(text + _contents(text, place), encoding="utf-8")


def relinked(text: str, file: Path, where: dict[Path, Path]) -> str:
    """A page's text with its relative links as they are on the site."""

    def turned(match: re.Match[str]) -> str:
        linked = (file.parent / match[2]).resolve()
        there = where.get(linked) or ELSEWHERE.get(linked.name)
        if there is None:
            return match[0]
        return f"{match[1]}{os.path.relpath(there, where[file].parent)}{match[3]}"

    return _LINK.sub(turned, text)


def _notebook(file: Path, where: dict[Path, Path]) -> str:
    notebook = json.loads(file.read_text(encoding="utf-8"))
    for cell in notebook["cells"]:
        if cell["cell_type"] == "markdown":
            cell["source"] = relinked("".join(cell["source"]), file, where)
    return json.dumps(notebook)


def _contents(text: str, place: Path) -> str:
    """The table of contents of an index page: what it links, in its order."""
    if place.name != "index.md":
        return ""
    links = [m[2] for m in _LINK.finditer(text) if m[2].endswith((".md", ".ipynb")) and not m[2].startswith("..")]
    return "\n\n```{toctree}\n:hidden:\n\n" + "\n".join(dict.fromkeys(links)) + "\n```\n"
