"""Every link of the manual leads somewhere: relative links, their anchors, and the pages that the code names."""

from __future__ import annotations

import importlib
import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "notebooks").glob("*.ipynb")])
FOLDERS = ("benchmarks", "cad", "dives", "mirrorgaze", "optics", "reports", "rigs", "scenes", "tests", "tracking")
CODE = sorted(p for f in FOLDERS for p in (ROOT / f).rglob("*") if p.suffix in {".py", ".toml", ".md"})

GENERATED = {ROOT / "docs" / page for page in importlib.import_module("docs.site.staging").GENERATED}
"""Pages and folders that are made with the site."""

LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#{1,6} +(.+?)\s*$", re.MULTILINE)
NAMED_PAGE = re.compile(r"\bdocs/[\w/-]+\.md\b")


def markdown(page: Path) -> str:
    """A page's text, of a notebook its markdown cells, without what stands between fences."""
    text = page.read_text(encoding="utf-8")
    if page.suffix == ".ipynb":
        cells = json.loads(text)["cells"]
        text = "\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    return re.sub(r"^ *```.*?^ *```", "", text, flags=re.MULTILINE | re.DOTALL)


def anchors(page: Path) -> set[str]:
    """The anchors of a page's headings, as GitHub and MyST make them."""
    return {
        re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
        for title in (re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", h) for h in HEADING.findall(markdown(page)))
    }


def broken_links(page: Path) -> list[str]:
    broken = []
    for target in LINK.findall(re.sub(r"`[^`\n]*`", "", markdown(page))):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        there = (page.parent / path).resolve() if path else page
        if GENERATED & {there, *there.parents}:
            continue
        if not there.exists() or (anchor and anchor not in anchors(there)):
            broken.append(target)
    return broken


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    assert broken_links(page) == []


def test_a_broken_link_is_found(tmp_path):
    (tmp_path / "there.md").write_text("# A title, with `code` in it\n")
    page = tmp_path / "page.md"
    page.write_text(
        "[a](there.md) [b](there.md#a-title-with-code-in-it) `[c](code.md)` [d](nowhere.md) [e](there.md#no)\n"
        "```\n[f](fenced.md)\n```\n[g](#no)\n"
    )
    assert broken_links(page) == ["nowhere.md", "there.md#no", "#no"]


def test_pages_named_in_the_code_exist():
    named = {(path, page) for path in CODE for page in NAMED_PAGE.findall(path.read_text(encoding="utf-8"))}
    assert named
    assert sorted(f"{path.relative_to(ROOT)}: {page}" for path, page in named if not (ROOT / page).exists()) == []


def test_every_page_is_on_its_doors_index():
    """A page that no index names is not found by anybody."""
    for door in ("tutorials", "how-to", "reference", "explanation"):
        index = ROOT / "docs" / door / "index.md"
        linked = {(index.parent / target).resolve() for target in LINK.findall(markdown(index))}
        pages = set(index.parent.glob("*.md")) - {index}
        assert sorted(page.name for page in pages - linked) == []
