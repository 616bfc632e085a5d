"""`./run bench robots FOLDER`: public hulls of robots taken from `new` to a design, and a table of how that went.

Each hull of benchmarks/robots.toml that lies in FOLDER goes through `mirrorgaze new`, `check --cad` and `design
--no-dive`, each step in a process of its own, with a cache that was empty when the robot began. A step that was done is
not done again; without the robot's folder in the output all of it is.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import re
import shutil
import sys
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.processes import CACHE, finished

ROBOTS = Path(__file__).with_name("robots.toml")
STEPS = ("new", "check", "design")
ALLOWED_S = 180.0
"""Processor time that a robot may take from its file to its design."""
BEGIN, END = "<!-- table of ./run bench robots -->", "<!-- end of the table -->"
HEADER = (
    "robot",
    "triangles",
    "its solid",
    "deviation, median and p95",
    "`new` + `check --cad` + `design`",
    "coverage",
    "print",
    "outcome",
)


@dataclass(frozen=True, kw_only=True)
class Robot:
    """A hull of the list; `folder` is where its rig, results and cache are."""

    key: str
    name: str
    hull: Path
    options: tuple[str, ...]
    source: str
    licence: str
    folder: Path

    @property
    def arguments(self) -> dict[str, list[str]]:
        """Of `mirrorgaze`, by step."""
        rig = f"{self.key}.toml"
        return {
            "new": ["new", self.key, "--hull", str(self.hull), *self.options],
            "check": ["check", rig, "--cad", "-o", "checks"],
            "design": ["design", rig, "--no-dive", "-o", "design"],
        }


def main(arguments: Sequence[str]) -> int:
    """Take the robots through the steps and print the table; 1 when one of them did not come through in time."""
    parser = argparse.ArgumentParser(prog="./run bench robots", description=__doc__)
    parser.add_argument("hulls", type=Path, metavar="FOLDER", help="where the files of robots.toml are")
    parser.add_argument("names", nargs="*", metavar="NAME", help="sections of robots.toml; all by default")
    parser.add_argument("-o", "--output", type=Path, default=Path("out/robots"), metavar="DIR", help="out/robots")
    parser.add_argument("--page", type=Path, metavar="FILE", help="put the table into this page, between its marks")
    options = parser.parse_args(arguments)
    listed = tomllib.loads(ROBOTS.read_text(encoding="utf-8"))
    unknown = [name for name in options.names if name not in listed]
    if unknown or not options.hulls.is_dir():
        expected = f"expected robots among {', '.join(listed)}" if unknown else "expected a folder with hulls"
        print(f"{expected}, got {', '.join(unknown) or options.hulls}", file=sys.stderr)
        return 2
    if options.page is not None and not _has_marks(options.page):
        print(f"{options.page}: expected a page with the lines {BEGIN!r} and {END!r}", file=sys.stderr)
        return 2
    robots = [_robot(key, listed[key], options.hulls, options.output) for key in options.names or listed]
    for robot in robots:
        _take_through(robot, lambda line: print(line, file=sys.stderr, flush=True))
    rows = [_row(robot) for robot in robots]
    table = _markdown(robots, rows)
    (options.output / "robots.md").write_text(table, encoding="utf-8")
    print(table)
    if options.page is not None:
        _put_into(options.page, table)
    return int(not all(row["good"] and row["processor_s"] <= ALLOWED_S for row in rows))


def _robot(key: str, listed: dict[str, Any], hulls: Path, output: Path) -> Robot:
    return Robot(
        key=key,
        name=listed["robot"],
        hull=(hulls / listed["file"]).absolute(),
        options=tuple(listed.get("options", ())),
        source=listed["source"],
        licence=listed["licence"],
        folder=output / key,
    )


def _take_through(robot: Robot, log: Callable[[str], None]) -> None:
    """Run the steps that were not done, until one fails."""
    done = _done(robot)
    if not done:
        shutil.rmtree(robot.folder, ignore_errors=True)
        robot.folder.mkdir(parents=True)
    for step in STEPS:
        if step not in done:
            log(f"{robot.name}: {' '.join(robot.arguments[step])}")
            done[step] = _run(robot, step)
            state = {"arguments": robot.arguments, "steps": done}
            (robot.folder / "steps.json").write_text(json.dumps(state, indent=2), encoding="utf-8")
        if done[step]["status"]:
            return


def _done(robot: Robot) -> dict[str, dict[str, Any]]:
    """Steps that were done with the arguments of today."""
    file = robot.folder / "steps.json"
    state = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
    found: dict[str, dict[str, Any]] = state["steps"] if state.get("arguments") == robot.arguments else {}
    return found


def _run(robot: Robot, step: str) -> dict[str, Any]:
    """A step in a process of its own: exit status, processor time with that of the slicer, and what went wrong."""
    command = ["-m", "mirrorgaze", *robot.arguments[step]]
    cache = {CACHE: str((robot.folder / "cache").absolute())}
    done = finished(command, folder=robot.folder, name=step, variables=cache)
    return {
        "status": done.status,
        "processor_s": done.processor_s,
        "sentence": _sentence(done.said) if done.status else "",
    }


def _sentence(said: str) -> str:
    """What a command says is wrong: all after its name, or the last line of a traceback."""
    _, _, problem = said.rpartition("mirrorgaze: ")
    if problem == said:
        problem = (said.strip().splitlines() or ["nothing was said"])[-1]
    return " ".join(problem.split())


def _row(robot: Robot) -> dict[str, Any]:
    """What the table says of a robot."""
    steps = _done(robot)
    notes = _notes(robot)
    failed = [f"{step}: {found['sentence']}" for step, found in steps.items() if found["status"]]
    return {
        "good": not failed,
        "triangles": _triangles(robot),
        "notes": notes,
        "deviation": _deviation(notes),
        "seconds": [found["processor_s"] for found in steps.values()],
        "processor_s": sum(found["processor_s"] for found in steps.values()),
        "coverage": _coverage(robot),
        "print_h": _print_hours(robot),
        "outcome": failed[0] if failed else "built",
    }


def _triangles(robot: Robot) -> int | None:
    said = robot.folder / "new.stdout"
    found = re.search(r"([\d,]+) triangles", said.read_text(encoding="utf-8"))
    return None if found is None else int(found[1].replace(",", ""))


def _notes(robot: Robot) -> list[str]:
    """What was done to make surface and solid of a hull, from the robot's cache."""
    from cad.hulls.hull_mesh import hull_notes
    from rigs import Rig

    rig = robot.folder / f"{robot.key}.toml"
    if not rig.is_file():
        return []
    before = os.environ.get(CACHE)
    os.environ[CACHE] = str(robot.folder / "cache")
    try:
        return [note.removeprefix(f"{robot.hull.name}: ") for note in hull_notes(Rig.load(rig))]
    finally:
        os.environ.pop(CACHE)
        os.environ.update({} if before is None else {CACHE: before})


def _deviation(notes: Sequence[str]) -> str:
    found = re.search(r"within ([\d.e+-]+) mm of the file's surface, 95 % within ([\d.e+-]+) mm", " ".join(notes))
    return "0" if found is None else f"{float(found[1]):.2g}, {float(found[2]):.2g} mm"


def _coverage(robot: Robot) -> float | None:
    summary = robot.folder / "design/summary.json"
    if not summary.is_file():
        return None
    return float(json.loads(summary.read_text(encoding="utf-8"))["coverage"]["covered_fraction"])


def _print_hours(robot: Robot) -> float | None:
    """Printing time of all plates, as the slicer estimates it."""
    checks = robot.folder / "checks/checks.csv"
    if not checks.is_file():
        return None
    with checks.open(encoding="utf-8", newline="") as file:
        plates = [row for row in csv.DictReader(file) if row["subject"].startswith("plate ")]
    times = [re.match(r"(\d+) h (\d+) min", plate["note"]) for plate in plates]
    return sum(int(time[1]) + int(time[2]) / 60 for time in times if time) if plates else None


def _markdown(robots: Sequence[Robot], rows: Sequence[dict[str, Any]]) -> str:
    """Two tables: how it went, and where the hulls are from."""
    cells = [_cells(robot, row) for robot, row in zip(robots, rows, strict=True)]
    sources = [(robot.name, robot.hull.name, " ".join(robot.options), robot.source, robot.licence) for robot in robots]
    return f"{_table(HEADER, cells)}\n{_table(('robot', 'file', 'options', 'source', 'licence'), sources)}"


def _cells(robot: Robot, row: dict[str, Any]) -> Sequence[str]:
    seconds = " + ".join(f"{spent:.0f}" for spent in row["seconds"])
    return (
        robot.name,
        "" if row["triangles"] is None else f"{row['triangles']:,}",
        "; ".join(note.partition(": half of")[0].removeprefix("its solid is ") for note in row["notes"]) or "as it is",
        row["deviation"],
        f"{seconds} = {row['processor_s']:.0f} s" if len(row["seconds"]) > 1 else f"{seconds} s",
        "" if row["coverage"] is None else f"{row['coverage']:.1%}",
        "" if row["print_h"] is None else f"{row['print_h']:.1f} h",
        row["outcome"],
    )


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [header, ["---"] * len(header), *([cell.replace("|", "\\|") for cell in row] for row in rows)]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _has_marks(page: Path) -> bool:
    """Whether there is a page with the lines between which the table goes."""
    return page.is_file() and BEGIN in (text := page.read_text(encoding="utf-8")) and END in text


def _put_into(page: Path, table: str) -> None:
    """Replace what stands between the marks of a page."""
    before, _, rest = page.read_text(encoding="utf-8").partition(BEGIN)
    after = rest.partition(END)[2]
    page.write_text(f"{before}{BEGIN}\n\n{table}\n{END}{after}", encoding="utf-8")
