"""Checks of a mount as a table and in figures: clearances, walls, and the joint values that keep the clearance."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from cad.checks.assembly_checks import MountChecks
from cad.checks.clearance import clearance
from cad.checks.clearance.admissible import AdmissibleRegion, CellState
from cad.checks.printing import walls
from cad.finding import Finding, Verdict
from reports.figures.plotting import INK, STYLE, save_figure
from rigs import Rig
from rigs.atomic_files import csv_text, write_text

TIGHTEST_PAIRS = 18
COLOURS = {Verdict.PASSED: "#2a9d8f", Verdict.FAILED: "#e76f51", Verdict.NOT_RUN: "#94a3b8"}
CELL_COLOURS = {"clear": "#2a9d8f", "not proven": "#e9c46a", "too near": "#e76f51", "clear, not reachable": "#94a3b8"}
COLUMNS = ("check", "subject", "verdict", "figure", "unit", "sense", "limit", "place", "note", "problem")


def write_checks(checks: MountChecks, rig: Rig, folder: Path) -> list[Path]:
    """Write `checks.csv`, `checks.png` and, when not all joint values are admissible, `admissible.png`."""
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / "checks.csv", folder / "checks.png"]
    write_text(files[0], findings_csv(checks))
    save_figure(checks_figure(checks, rig), files[1])
    if checks.admissible is not None:
        files.append(folder / "admissible.png")
        save_figure(admissible_figure(checks.admissible, rig), files[2])
    return files


def findings_csv(checks: MountChecks) -> str:
    """Every finding as a row."""
    return csv_text([COLUMNS, *([row[column] for column in COLUMNS] for row in findings_as_dicts(checks))])


def findings_as_dicts(checks: MountChecks) -> list[dict[str, object]]:
    """Every finding as plain data."""
    return [
        {
            "check": finding.check,
            "subject": finding.subject,
            "verdict": str(finding.verdict),
            "figure": finding.figure,
            "unit": finding.unit,
            "sense": str(finding.sense) if finding.limit is not None else "",
            "limit": finding.limit,
            "place": finding.place,
            "note": finding.note,
            "problem": None if finding.problem is None else str(finding.problem),
        }
        for finding in checks.findings
    ]


def summary_rows(checks: MountChecks) -> list[tuple[str, str, str]]:
    """One row per check: its name, how many passed, and the finding that is nearest to its limit."""
    names = list(dict.fromkeys(finding.check for finding in checks.findings))
    rows = []
    for name in names:
        findings = checks.of(name)
        counts = {verdict: sum(f.verdict is verdict for f in findings) for verdict in Verdict}
        words = ", ".join(f"{count} {verdict}" for verdict, count in counts.items() if count)
        rows.append((name, words, str(min(findings, key=_margin)).removeprefix(f"{name}: ")))
    return rows


def checks_figure(checks: MountChecks, rig: Rig) -> Figure:
    """Clearance of the tightest pairs, and wall thickness of the printed parts, against their limits."""
    gaps = sorted((f for f in checks.of(clearance.CHECK) if f.figure is not None), key=lambda f: f.figure or 0.0)
    thicknesses = checks.of(walls.CHECK)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10.5, 5.6), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(3, 2))
        _bars(left, gaps[:TIGHTEST_PAIRS], "proven gap over the joint range (mm)")
        _bars(right, thicknesses, "wall, first percentile (mm)")
        figure.suptitle(f"{rig.name}: what the checks measured; the mark is the limit")
    return figure


def admissible_figure(region: AdmissibleRegion, rig: Rig) -> Figure:
    """Joint values that keep the clearance, and the largest rectangle of them."""
    state = np.where((region.state == CellState.CLEAR) & ~region.reachable, len(CellState), region.state)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.4, 5.6), layout="constrained")
        axes = figure.subplots()
        colours = ListedColormap(list(CELL_COLOURS.values()))
        norm = BoundaryNorm(np.arange(len(CELL_COLOURS) + 1) - 0.5, len(CELL_COLOURS))
        axes.pcolormesh(region.q1_edges_deg, region.q2_edges_deg, state.T, cmap=colours, norm=norm)
        if region.largest is not None:
            (low1, high1), (low2, high2) = region.largest.q1_deg, region.largest.q2_deg
            axes.add_patch(
                Rectangle((low1, low2), high1 - low1, high2 - low2, fill=False, edgecolor=INK, linewidth=1.6)
            )
        axes.set_xlabel("q1, pan (degrees)")
        axes.set_ylabel("q2, tilt (degrees)")
        axes.set_title(f"{rig.name}: {region.fraction:.0%} of the joint range is admissible and reachable")
        handles = [Patch(color=colour, label=name) for name, colour in CELL_COLOURS.items()]
        axes.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=4, frameon=False)
    return figure


def _bars(axes: Axes, findings: list[Finding], title: str) -> None:
    rows = np.arange(len(findings))[::-1]
    figures = [finding.figure or 0.0 for finding in findings]
    axes.barh(rows, figures, color=[COLOURS[finding.verdict] for finding in findings], height=0.7)
    for row, finding in zip(rows, findings, strict=True):
        if finding.limit is not None:
            axes.plot([finding.limit] * 2, [row - 0.45, row + 0.45], color=INK, linewidth=1.5)
    axes.set_yticks(rows, [finding.subject for finding in findings])
    axes.set_title(title)
    axes.grid(axis="y", visible=False)


def _margin(finding: Finding) -> tuple[int, float]:
    """Order of findings: failed first, then by how near the figure is to its limit."""
    rank = (Verdict.FAILED, Verdict.PASSED, Verdict.NOT_RUN).index(finding.verdict)
    if finding.figure is None or finding.limit is None:
        return rank, 0.0
    scale = max(abs(finding.limit), 1e-12)
    return rank, abs(finding.figure - finding.limit) / scale
