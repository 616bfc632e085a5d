"""A report as a self-contained HTML page: it opens from disk and fetches nothing."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from functools import singledispatch
from html import escape
from pathlib import Path
from string import Template
from urllib.parse import quote

from reports.pages.content import (
    Block,
    Bullets,
    Figure,
    Gallery,
    Judgements,
    Line,
    Link,
    Paragraph,
    Section,
    Table,
    Tiles,
    Title,
    Video,
)

TEMPLATE = Path(__file__).parent / "page.html"
STYLE = Path(__file__).parent / "page.css"
MEDIA_TYPES = {".png": "image/png", ".svg": "image/svg+xml", ".mp4": "video/mp4"}


def page(title: str, blocks: Iterable[Block]) -> str:
    """Whole page of a report."""
    template = Template(TEMPLATE.read_text(encoding="utf-8"))
    style = STYLE.read_text(encoding="utf-8")
    return template.substitute(title=escape(title), style=style, body="\n".join(map(html, blocks)))


@singledispatch
def html(block: Block) -> str:
    """HTML of a block."""
    raise TypeError(f"expected a block of a report, got {block!r}")


@html.register
def _(block: Title) -> str:
    lead = f'<p class="lead">{escape(block.lead)}</p>' if block.lead else ""
    return f"<h1>{escape(block.name)}</h1>{lead}"


@html.register
def _(block: Section) -> str:
    return "\n".join([f"<h2>{escape(block.heading)}</h2>", *map(html, block.content)])


@html.register
def _(block: Paragraph) -> str:
    tag = "footer" if block.small else "p"
    return f"<{tag}>{_line(block.line)}</{tag}>"


@html.register
def _(block: Tiles) -> str:
    cells = "".join(
        f'<div class="tile"><b>{escape(number)}</b><span>{escape(label)}</span></div>' for number, label in block.facts
    )
    return f'<div class="tiles">{cells}</div>'


@html.register
def _(block: Figure) -> str:
    words = escape(block.caption)
    return f'<figure><img src="{_embedded(block.file)}" alt="{words}"><figcaption>{words}</figcaption></figure>'


@html.register
def _(block: Gallery) -> str:
    return f'<div class="views">{"".join(map(html, block.figures))}</div>'


@html.register
def _(block: Video) -> str:
    words, kind = escape(block.caption), MEDIA_TYPES[Path(block.file).suffix]
    return (
        f'<figure><video controls muted playsinline preload="metadata" poster="{_embedded(block.still)}">'
        f'<source src="{escape(quote(block.file))}" type="{kind}"></video><figcaption>{words}</figcaption></figure>'
    )


@html.register
def _(block: Table) -> str:
    header = _row(block.header, "th", block.numbers) if any(block.header) else ""
    return f"<table>{header}{''.join(_row(cells, 'td', block.numbers) for cells in block.rows)}</table>"


@html.register
def _(block: Judgements) -> str:
    cells = "".join(
        f'<tr><td class="outcome {escape(outcome.split()[0])}">{escape(outcome)}</td><td>{escape(what)}</td>'
        f"<td>{escape(words)}</td></tr>"
        for outcome, what, words in block.rows
    )
    return f'<table class="judgements">{cells}</table>'


@html.register
def _(block: Bullets) -> str:
    return "<ul>" + "".join(f"<li>{_line(item)}</li>" for item in block.items) + "</ul>"


def _line(line: Line) -> str:
    return "".join(
        f'<a href="{escape(quote(part.file))}">{escape(part.words)}</a>' if isinstance(part, Link) else escape(part)
        for part in line
    )


def _row(cells: Sequence[str], tag: str, numbers: Sequence[int]) -> str:
    inner = "".join(
        f'<{tag} class="number">{escape(cell)}</{tag}>' if k in numbers else f"<{tag}>{escape(cell)}</{tag}>"
        for k, cell in enumerate(cells)
    )
    return f"<tr>{inner}</tr>"


def _embedded(file: Path) -> str:
    data = base64.b64encode(file.read_bytes()).decode("ascii")
    return f"data:{MEDIA_TYPES[file.suffix]};base64,{data}"
