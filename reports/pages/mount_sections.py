"""Sections of the dossier's page about the mount's checks and loads."""

from __future__ import annotations

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

Result = dict[str, Any]


def checks_and_loads(checks: MountChecks, loads: LoadStudy) -> Result:
    """What the sections need, as plain data."""
    return {
        "checks": findings_as_dicts(checks),
        "check_rows": summary_rows(checks),
        "loads": load_summary(loads),
        "load_lines": load_lines(loads),
    }


def checks_section(found: Result, mount: Path) -> str:
    """Section of the checks, with the figure that lies in the mount's folder."""
    return page.section(
        "Checks",
        page.table(["Check", "", "Nearest to its limit"], found["check_rows"]),
        page.picture(mount / CHECKS_FOLDER / "checks.png", "Tightest pairs over all joint values, and walls"),
    )


def loads_section(found: Result, mount: Path) -> str:
    """Section of the loads, with the figure that lies in the mount's folder."""
    rows = [
        [servo["servo"], *(f"{servo[f'{key}_n_m']:.3f}" for key in TORQUES), f"{servo['margin']:.1f}"]
        for servo in found["loads"]["servos"]
    ]
    return page.section(
        "Loads",
        page.bullets(found["load_lines"]),
        page.table(["Servo (N m)", *TORQUES.values(), "Margin"], rows, numbers=range(1, len(TORQUES) + 2)),
        page.picture(mount / LOADS_FOLDER / "torques.png", "Torque on each servo against its rating"),
    )
