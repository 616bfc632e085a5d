"""What a report says, as blocks: a page (`reports.pages.page`) and a PDF (`reports.pages.pdf`) show the same ones."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, kw_only=True)
class Link:
    """Words that lead to a file, named from the report's folder."""

    file: str
    words: str


Line = tuple[str | Link, ...]
"""Words, some of which are links."""


@dataclass(frozen=True, kw_only=True)
class Title:
    """The report's name, and a sentence on it."""

    name: str
    lead: str = ""


@dataclass(frozen=True, kw_only=True)
class Paragraph:
    """Plain sentences; `small` are those at a report's foot."""

    line: Line
    small: bool = False


@dataclass(frozen=True, kw_only=True)
class Tiles:
    """Row of key numbers: (number, what it is)."""

    facts: tuple[tuple[str, str], ...]


@dataclass(frozen=True, kw_only=True)
class Table:
    """Cells in rows; `numbers` are the columns that are set flush right.

    An empty header is left out.
    """

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: tuple[int, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Judgements:
    """Rows of (outcome, what, words), the outcome marked by a colour of its own."""

    rows: tuple[tuple[str, str, str], ...]


@dataclass(frozen=True, kw_only=True)
class Figure:
    """An image (PNG, or SVG for what is drawn in lines) with its caption."""

    file: Path
    caption: str


@dataclass(frozen=True, kw_only=True)
class Gallery:
    """Figures side by side."""

    figures: tuple[Figure, ...]


@dataclass(frozen=True, kw_only=True)
class Video:
    """A video beside the report, with the image that stands for it where nothing moves."""

    file: str
    still: Path
    caption: str


@dataclass(frozen=True, kw_only=True)
class Bullets:
    """List of lines."""

    items: tuple[Line, ...]


@dataclass(frozen=True, kw_only=True)
class Section:
    """Heading with what belongs under it."""

    heading: str
    content: tuple[Block, ...]


Block = Title | Paragraph | Tiles | Table | Judgements | Figure | Gallery | Video | Bullets | Section


def section(heading: str, *content: Block) -> Section:
    """Heading with what belongs under it."""
    return Section(heading=heading, content=content)


def paragraph(*line: str | Link) -> Paragraph:
    """Words and links in a row."""
    return Paragraph(line=line)


def footer(words: str) -> Paragraph:
    """Words at a report's foot."""
    return Paragraph(line=(words,), small=True)


def tiles(facts: Iterable[tuple[str, str]]) -> Tiles:
    """Row of key numbers: (number, what it is)."""
    return Tiles(facts=tuple(facts))


def figure(file: Path, caption: str) -> Figure:
    """Image with its caption."""
    return Figure(file=file, caption=caption)


def gallery(figures: Iterable[Figure]) -> Gallery:
    """Figures side by side."""
    return Gallery(figures=tuple(figures))


def table(header: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int] = ()) -> Table:
    """Table; `numbers` are the columns that are set flush right."""
    return Table(header=tuple(header), rows=tuple(map(tuple, rows)), numbers=tuple(numbers))


def judgements(rows: Iterable[tuple[str, str, str]]) -> Judgements:
    """Table of (outcome, what, words)."""
    return Judgements(rows=tuple((str(outcome), what, words) for outcome, what, words in rows))


def bullets(items: Iterable[str]) -> Bullets:
    """List of plain sentences."""
    return Bullets(items=tuple((item,) for item in items))


def listed(items: Iterable[Line]) -> Bullets:
    """List of lines that may hold links."""
    return Bullets(items=tuple(items))


def file_line(words: str, files: Iterable[str | tuple[str, str]]) -> Line:
    """Words and after them links to files: names, or (name, words)."""
    line: list[str | Link] = [f"{words}: "]
    for position, file in enumerate(files):
        name, shown = (file, file) if isinstance(file, str) else file
        line += [", "] * (position > 0) + [Link(file=name, words=shown)]
    return tuple(line)


def figures_of(blocks: Iterable[Block]) -> list[Path]:
    """Files of all images of a report, in their order, each once."""
    found: dict[Path, None] = {}
    for block in blocks:
        if isinstance(block, Section):
            found |= dict.fromkeys(figures_of(block.content))
        elif isinstance(block, Gallery):
            found |= dict.fromkeys(figures_of(block.figures))
        elif isinstance(block, Figure):
            found[block.file] = None
        elif isinstance(block, Video):
            found[block.still] = None
    return list(found)
