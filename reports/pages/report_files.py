"""The files of a design report: the summary for machines, and page and PDF, which are made from the summary."""

from __future__ import annotations

import json
from pathlib import Path

from pydantic import TypeAdapter

from reports.pages.design import DesignResults, design_blocks
from reports.pages.page import page
from reports.pages.pdf import Imprint, pdf
from reports.pages.standing import Standing
from reports.progress import plain
from rigs import Rig
from rigs.atomic_files import write_bytes, write_text

SUMMARY, PAGE, PDF = "summary.json", "report.html", "report.pdf"


def write_report(rig: Rig, standing: Standing, results: DesignResults, folder: Path) -> Path:
    """Write summary, page and PDF into a report's folder; the page's path."""
    data = {"rig": rig.model_dump(mode="json"), "standing": plain(standing), **plain(results)}
    write_text(folder / SUMMARY, json.dumps(data, indent=2))
    return write_pages(folder)


def write_pages(folder: Path) -> Path:
    """Write page and PDF of a report again, from its summary and images alone; the page's path."""
    data = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))
    rig = Rig.model_validate(data.pop("rig"))
    standing = TypeAdapter(Standing).validate_python(data.pop("standing"))
    results = TypeAdapter(DesignResults).validate_python(data)
    title = f"{rig.name}: design report"
    blocks = design_blocks(rig, standing, results, folder)
    write_text(folder / PAGE, page(title, blocks))
    write_bytes(folder / PDF, pdf(Imprint(title=title, marks=standing.marks, date=standing.date), blocks))
    return folder / PAGE
