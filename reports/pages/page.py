"""Pieces of a self-contained HTML page: it opens from disk and fetches nothing."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from string import Template
from urllib.parse import quote

TEMPLATE = Path(__file__).parent / "page.html"


def page(title: str, sections: Iterable[str]) -> str:
    """Whole page around its sections."""
    template = Template(TEMPLATE.read_text(encoding="utf-8"))
    return template.substitute(title=escape(title), body="\n".join(sections))


def text(plain: str) -> str:
    """Plain text, safe to stand in HTML."""
    return escape(plain)


def link(file: str, words: str) -> str:
    """Link to a file, named from the page's folder."""
    return f'<a href="{escape(quote(file))}">{escape(words)}</a>'


def section(heading: str, *content: str) -> str:
    """Heading with what belongs under it."""
    return f"<h2>{escape(heading)}</h2>\n" + "\n".join(content)


def tiles(facts: Iterable[tuple[str, str]]) -> str:
    """Row of key numbers: (number, what it is)."""
    cells = "".join(
        f'<div class="tile"><b>{escape(number)}</b><span>{escape(label)}</span></div>' for number, label in facts
    )
    return f'<div class="tiles">{cells}</div>'


def image(path: Path, caption: str) -> str:
    """PNG, embedded, with its caption."""
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    words = escape(caption)
    embedded = f'<img src="data:image/png;base64,{data}" alt="{words}">'
    return f"<figure>{embedded}<figcaption>{words}</figcaption></figure>"


def gallery(images: Iterable[str]) -> str:
    """Images side by side."""
    return f'<div class="views">{"".join(images)}</div>'


def table(header: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """Table; `numbers` are the columns that are set flush right."""

    def row(cells: Sequence[str], tag: str) -> str:
        inner = "".join(
            f'<{tag} class="number">{escape(cell)}</{tag}>' if k in numbers else f"<{tag}>{escape(cell)}</{tag}>"
            for k, cell in enumerate(cells)
        )
        return f"<tr>{inner}</tr>"

    return f"<table>{row(header, 'th')}{''.join(row(cells, 'td') for cells in rows)}</table>"


def bullets(items: Iterable[str]) -> str:
    """List of plain sentences."""
    return listed(map(escape, items))


def listed(items: Iterable[str]) -> str:
    """List of pieces of HTML, such as links."""
    return "<ul>" + "".join(f"<li>{item}</li>" for item in items) + "</ul>"


def judgements(rows: Iterable[Sequence[str]]) -> str:
    """Table of (outcome, what, words), the outcome marked by a colour of its own name."""
    cells = "".join(
        f'<tr><td class="outcome {escape(outcome.split()[0])}">{escape(outcome)}</td><td>{escape(what)}</td>'
        f"<td>{escape(words)}</td></tr>"
        for outcome, what, words in rows
    )
    return f'<table class="judgements">{cells}</table>'
