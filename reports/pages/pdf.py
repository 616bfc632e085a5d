"""A report as a PDF on A4: the blocks of its page, typeset by Typst; the same blocks and date give the same bytes."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl

from reports.pages.content import Block, Figure, Gallery, Line, Link, Section, Video, figures_of

TEMPLATE = Path(__file__).parent / "pdf.typ"


@dataclass(frozen=True, kw_only=True)
class Imprint:
    """What stands at the foot of every page, and the date in the file itself.

    Attributes
    ----------
    title : str
    marks : tuple of str
        Such as revision, digest and version.
    date : str
        ISO 8601, a day.
    """

    title: str
    marks: tuple[str, ...]
    date: str


def pdf(imprint: Imprint, blocks: Sequence[Block]) -> bytes:
    """PDF of a report."""
    # Typst takes nearly half a second to import, and most commands write no report.
    import typst  # noqa: PLC0415

    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        images = {file: f"{number}{file.suffix}" for number, file in enumerate(figures_of(blocks))}
        for file, name in images.items():
            shutil.copyfile(file, folder / name)
        data = {"imprint": asdict(imprint), "blocks": [_plain(block, images) for block in blocks]}
        (folder / "content.json").write_text(json.dumps(data), encoding="utf-8")
        main = folder / TEMPLATE.name
        shutil.copyfile(TEMPLATE, main)
        # The fonts of the figures, which every machine has that can draw them.
        fonts = Path(mpl.get_data_path()) / "fonts/ttf"
        made: bytes = typst.compile(main, root=folder, font_paths=[fonts], ignore_system_fonts=True)
    return made


def _plain(block: Block, images: Mapping[Path, str]) -> dict[str, Any]:
    """A block as the template reads it."""
    fields = {name: getattr(block, name) for name in block.__dataclass_fields__}
    if isinstance(block, Section):
        fields["content"] = [_plain(each, images) for each in block.content]
    elif isinstance(block, Gallery):
        fields["figures"] = [_plain(each, images) for each in block.figures]
    elif isinstance(block, Figure):
        fields["file"] = images[block.file]
    elif isinstance(block, Video):
        fields["still"] = images[block.still]
    for name in {"line", "items"} & fields.keys():
        fields[name] = _parts(fields[name]) if name == "line" else [_parts(line) for line in fields[name]]
    return {"kind": type(block).__name__, **fields}


def _parts(line: Line) -> list[dict[str, str]]:
    return [asdict(part) if isinstance(part, Link) else {"words": part} for part in line]
