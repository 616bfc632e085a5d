"""Sections of a page about a mount: its parts, checks and loads."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cad.assembly.assembly import Assembly
from cad.checks.assembly_checks import MountChecks
from cad.export.drawings.bill_of_materials import Item, bill_of_materials, settings_words
from cad.export.printing.prints import Prints
from cad.loads.study import LoadStudy
from reports.figures.check import findings_as_dicts, summary_rows
from reports.figures.load import load_lines, load_summary
from reports.pages import content

CHECKS_FOLDER, LOADS_FOLDER, ASSEMBLY_FOLDER = "checks", "loads", "assembly"
"""Folders of an exported mount that the sections' figures lie in."""

TORQUES = {"off_balance_water": "Weight", "turning": "Turning", "flow": "Flow", "needed": "Needed", "rated": "Rated"}


@dataclass(frozen=True, kw_only=True)
class CheckedMount:
    """A mount that passed its checks and whose servos are strong enough.

    Attributes
    ----------
    assembly : Assembly
    checks : MountChecks
    loads : LoadStudy
    prints : Prints
    """

    assembly: Assembly
    checks: MountChecks
    loads: LoadStudy
    prints: Prints


@dataclass(frozen=True, kw_only=True)
class MountResults:
    """What a page reports of an exported mount; files are named from the page's folder."""

    items: tuple[Item, ...]
    prints: Prints
    settings: str
    files: tuple[str, ...]
    checks: list[dict[str, Any]]
    check_rows: list[tuple[str, str, str]]
    loads: dict[str, Any]
    load_lines: list[str]
    steps: tuple[tuple[str, str], ...]
    """Image and words of each step of the assembly."""


def mount_results(made: CheckedMount, files: Iterable[str], folder: Path) -> MountResults:
    """Results of a mount whose files lie in the folder `mount` of a report's."""
    return MountResults(
        items=tuple(bill_of_materials(made.assembly, made.prints)),
        prints=made.prints,
        settings=settings_words(),
        files=tuple(files),
        checks=findings_as_dicts(made.checks),
        check_rows=summary_rows(made.checks),
        loads=load_summary(made.loads),
        load_lines=load_lines(made.loads),
        steps=_steps(folder),
    )


def bill_of_materials_blocks(mount: MountResults) -> list[content.Block]:
    """Tables of what is printed and of what is bought, with the mass of all pieces of a line, and sums."""
    printed, bought = bill_of_materials_tables(mount.items)
    # Silicone is no part of the assembly, nor of the loads.
    mass_g = sum(item.count * item.mass_g for item in mount.items if item.parts)
    return [
        printed,
        content.paragraph(f"Settings of every print: {mount.settings}. {_hours_words(mount)}"),
        bought,
        content.paragraph(f"The parts weigh {mass_g:.0f} g together; prints are counted as solid, as in the loads."),
    ]


def bill_of_materials_tables(items: Iterable[Item]) -> tuple[content.Table, content.Table]:
    """Tables of what is printed, and of what is bought."""
    items = tuple(items)
    bought = [
        [str(item.count), item.name, item.supplier, f"{item.count * item.mass_g:.1f}"]
        for item in items
        if item.kind != "print"
    ]
    return (
        content.table(PRINT_HEADER, _print_rows(items), numbers=[2, 3, 4, 7]),
        content.table(["Pieces", "To buy", "From", "Mass (g)"], bought, numbers=[0, 3]),
    )


PRINT_HEADER = (
    "To print",
    "Material",
    "Plate",
    "Hours",
    "Plastic (g)",
    "As printed (mm)",
    "Turned by (°)",
    "Mass if solid (g)",
)


def _print_rows(items: Iterable[Item]) -> list[list[str]]:
    rows = []
    for item in items:
        part = item.printed
        if part is not None:
            size, turn = (
                " × ".join(f"{side:.0f}" for side in part.size_mm),
                ", ".join(f"{a:g}" for a in part.turn_deg),
            )
            hours, plastic = f"{part.time_s / 3600:.1f}", f"{part.plastic_g:.0f}"
            row = [item.name.replace("_", " "), item.material, str(part.plate), hours, plastic]
            rows.append([*row, size, turn, f"{item.mass_g:.0f}"])
    return rows


def _hours_words(mount: MountResults) -> str:
    total = f"{mount.prints.time_s / 3600:.1f} h and {mount.prints.plastic_g:.0f} g with supports"
    if not mount.prints.sliced:
        return f"{total} in all are an estimate from the parts' shapes: there was no slicer."
    return f"{total} in all are the slicer's, for each plate; a plate's are shared among its parts by an estimate."


def steps_section(mount: MountResults, folder: Path) -> list[content.Section]:
    """Section on how the mount is put together, in images of a report's folder; none of a mount without steps."""
    images = [content.figure(folder / image, words) for image, words in mount.steps]
    return [content.section("How to put it together", content.gallery(images))] if images else []


def drawings_section(mount: MountResults, folder: Path) -> list[content.Section]:
    """Section of the drawings, assembly first, and of the drill template; none of a mount without drawings."""
    sheets = sorted(
        (file for file in mount.files if Path(file).parent.name == "drawings" and file.endswith(".svg")),
        key=lambda file: (Path(file).stem != "assembly", file),
    )
    if not sheets:
        return []
    template = [file for file in mount.files if file.endswith("drill_template.pdf")]
    line = (
        content.file_line("Holes in the hull, 1:1 to print", template)
        if template
        else ("No hole in the hull: nothing is screwed into it.",)
    )
    images = (content.figure(folder / sheet, Path(sheet).stem.replace("_", " ")) for sheet in sheets)
    return [content.section("Drawings", content.Paragraph(line=line), *images)]


def _steps(folder: Path) -> tuple[tuple[str, str], ...]:
    """Image, named from a report's folder, and words of each step that the mount's export wrote down."""
    guide = folder / "mount" / ASSEMBLY_FOLDER / "steps.md"
    if not guide.is_file():
        return ()
    words = re.findall(r"^\d+\. .*$", guide.read_text(encoding="utf-8"), re.MULTILINE)
    images = (image.relative_to(folder).as_posix() for image in sorted(guide.parent.glob("step_*.png")))
    return tuple(zip(images, words, strict=True))


def checks_section(mount: MountResults, folder: Path) -> content.Section:
    """Section of the checks, with the figure that lies in the mount's folder."""
    return content.section(
        "Checks",
        content.table(["Check", "", "Nearest to its limit"], mount.check_rows),
        content.figure(folder / CHECKS_FOLDER / "checks.png", "Tightest pairs over all joint values, and walls"),
    )


def loads_section(mount: MountResults, folder: Path) -> content.Section:
    """Section of the loads, with the figure that lies in the mount's folder."""
    rows = [
        [servo["servo"], *(f"{servo[f'{key}_n_m']:.3f}" for key in TORQUES), f"{servo['margin']:.1f}"]
        for servo in mount.loads["servos"]
    ]
    return content.section(
        "Loads",
        content.bullets(mount.load_lines),
        content.table(["Servo (N m)", *TORQUES.values(), "Margin"], rows, numbers=range(1, len(TORQUES) + 2)),
        content.figure(folder / LOADS_FOLDER / "torques.png", "Torque on each servo against its rating"),
    )


def mount_files(mount: MountResults) -> list[content.Line]:
    """Links to the mount's files, those of a folder in one line."""
    folders: dict[str, list[tuple[str, str]]] = {}
    for file in mount.files:
        folders.setdefault(str(Path(file).parent), []).append((file, Path(file).name))
    return [content.file_line(f"{folder}/", files) for folder, files in folders.items()]
