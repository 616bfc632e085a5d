"""Sections of a page about a mount: its parts, checks and loads."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cad.checks.assembly_checks import MountChecks
from cad.export.drawings.bill_of_materials import Item
from cad.loads.study import LoadStudy
from reports.figures.check import findings_as_dicts, summary_rows
from reports.figures.load import load_lines, load_summary
from reports.pages import page

CHECKS_FOLDER, LOADS_FOLDER, ASSEMBLY_FOLDER = "checks", "loads", "assembly"
"""Folders of an exported mount that the sections' figures lie in."""

TORQUES = {"off_balance_water": "Weight", "turning": "Turning", "flow": "Flow", "needed": "Needed", "rated": "Rated"}


@dataclass(frozen=True, kw_only=True)
class MountResults:
    """What a page reports of an exported mount; files are named from the page's folder."""

    bill: tuple[Item, ...]
    files: tuple[str, ...]
    checks: list[dict[str, Any]]
    check_rows: list[tuple[str, str, str]]
    loads: dict[str, Any]
    load_lines: list[str]


def mount_results(bill: Iterable[Item], files: Iterable[str], checks: MountChecks, loads: LoadStudy) -> MountResults:
    """Results of a mount that was checked and whose loads were studied."""
    return MountResults(
        bill=tuple(bill),
        files=tuple(files),
        checks=findings_as_dicts(checks),
        check_rows=summary_rows(checks),
        loads=load_summary(loads),
        load_lines=load_lines(loads),
    )


def bill_table(mount: MountResults) -> str:
    """Table of what is printed and what is bought, with the mass of all pieces of a line."""
    rows = [
        [
            item.kind,
            str(item.count),
            item.name.replace("_", " "),
            item.material or "bought",
            " × ".join(f"{side:.0f}" for side in item.size_mm) if item.kind == "print" else "",
            f"{item.count * item.mass_g:.1f}",
        ]
        for item in mount.bill
    ]
    total = sum(item.count * item.mass_g for item in mount.bill)
    rows.append(["", "", "all of it", "", "", f"{total:.0f}"])
    return page.table(["", "Pieces", "Name", "Material", "Size (mm)", "Mass (g)"], rows, numbers=[1, 5])


def steps_section(folder: Path) -> list[str]:
    """Section on how the mount in a folder is put together, in pictures; none where the folder has no steps."""
    guide = folder / ASSEMBLY_FOLDER / "steps.md"
    if not guide.is_file():
        return []
    steps = re.findall(r"^\d+\. .*$", guide.read_text(encoding="utf-8"), re.MULTILINE)
    pictures = sorted(guide.parent.glob("step_*.png"))
    images = [page.image(picture, words) for picture, words in zip(pictures, steps, strict=True)]
    return [page.section("How to put it together", page.gallery(images))]


def checks_section(mount: MountResults, folder: Path) -> str:
    """Section of the checks, with the figure that lies in the mount's folder."""
    return page.section(
        "Checks",
        page.table(["Check", "", "Nearest to its limit"], mount.check_rows),
        page.image(folder / CHECKS_FOLDER / "checks.png", "Tightest pairs over all joint values, and walls"),
    )


def loads_section(mount: MountResults, folder: Path) -> str:
    """Section of the loads, with the figure that lies in the mount's folder."""
    rows = [
        [servo["servo"], *(f"{servo[f'{key}_n_m']:.3f}" for key in TORQUES), f"{servo['margin']:.1f}"]
        for servo in mount.loads["servos"]
    ]
    return page.section(
        "Loads",
        page.bullets(mount.load_lines),
        page.table(["Servo (N m)", *TORQUES.values(), "Margin"], rows, numbers=range(1, len(TORQUES) + 2)),
        page.image(folder / LOADS_FOLDER / "torques.png", "Torque on each servo against its rating"),
    )


def mount_files(mount: MountResults) -> list[str]:
    """Links to the mount's files, those of a folder in one line."""
    folders: dict[str, list[str]] = {}
    for file in mount.files:
        folders.setdefault(str(Path(file).parent), []).append(file)
    return [
        f"{page.text(folder)}/: {', '.join(page.link(file, Path(file).name) for file in files)}"
        for folder, files in folders.items()
    ]
