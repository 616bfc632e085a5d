"""Sections of a page about a mount: its parts, checks and loads."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cad.checks.assembly_checks import MountChecks
from cad.loads.study import LoadStudy
from reports.figures.check import findings_as_dicts, summary_rows
from reports.figures.load import load_lines, load_summary
from reports.pages import page

CHECKS_FOLDER, LOADS_FOLDER = "checks", "loads"
"""Folders of an exported mount that the sections' figures lie in."""

TORQUES = {"off_balance_water": "Weight", "turning": "Turning", "flow": "Flow", "needed": "Needed", "rated": "Rated"}


@dataclass(frozen=True, kw_only=True)
class PartResults:
    """A part of the mount, in numbers."""

    name: str
    role: str
    moves_with: str
    printed: bool
    size_mm: tuple[float, float, float]
    volume_cm3: float


@dataclass(frozen=True, kw_only=True)
class MountResults:
    """What a page reports of an exported mount; files are named from the page's folder."""

    parts: tuple[PartResults, ...]
    files: tuple[str, ...]
    checks: list[dict[str, Any]]
    check_rows: list[tuple[str, str, str]]
    loads: dict[str, Any]
    load_lines: list[str]


def mount_results(
    parts: Iterable[PartResults], files: Iterable[str], checks: MountChecks, loads: LoadStudy
) -> MountResults:
    """Results of a mount that was checked and whose loads were studied."""
    return MountResults(
        parts=tuple(parts),
        files=tuple(files),
        checks=findings_as_dicts(checks),
        check_rows=summary_rows(checks),
        loads=load_summary(loads),
        load_lines=load_lines(loads),
    )


def parts_table(mount: MountResults) -> str:
    """Table of the parts: what is printed, what is bought, and with which joint each moves."""
    rows = [
        [
            part.name,
            "print" if part.printed else "reference" if part.role == "hull" else "buy",
            " × ".join(f"{side:.0f}" for side in part.size_mm),
            f"{part.volume_cm3:.1f}",
            part.moves_with,
        ]
        for part in mount.parts
    ]
    return page.table(["Part", "", "Size (mm)", "Volume (cm³)", "Moves with"], rows, numbers=[3])


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
    """Files of the mount, those of a folder in one line."""
    paths = [Path(file) for file in mount.files]
    folders = Counter(path.parts[1] for path in paths if len(path.parts) > 2)
    single = [str(path) for path in paths if len(path.parts) == 2]
    return [*single, *(f"mount/{name}/: {count} files" for name, count in folders.items())]
