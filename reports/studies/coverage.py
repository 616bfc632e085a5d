"""The workspace coverage report: what a rig sees of the sphere around the robot, as a page to hand round.

Two stages, each of which an interrupted run need not repeat: the coverage with its figures and tables, and the study of
how far its numbers are off.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

from cad.assembly.meshes import rig_meshes
from optics.coverage.convergence import Refinement, convergence
from optics.coverage.coverage import Coverage, compute_coverage, stepped_joints
from optics.coverage.openings.openings import blind_openings
from optics.coverage.summary import coverage_summary
from optics.coverage.uncertainty import covered_range
from optics.feasibility.feasibility import feasibility_problems
from reports.figures.plotting import draw_dwell, draw_regions, draw_usable_fov
from reports.figures.sphere import draw_coverage, draw_resolution
from reports.pages.coverage import CoverageResults, GridSummary, coverage_page
from reports.pages.tables import write_blind, write_convergence, write_openings, write_poses, write_sphere
from reports.progress import Log, Stages, counter, plain
from rigs import Rig
from rigs.atomic_files import write_text

COLUMNS, ROWS, NSIDE = 96, 72, 64
"""Cells of the image and of the sphere: both a little under a degree wide for lenses like the presets'."""

SMALLEST_STEP_DEG = 0.25
"""A quarter of a million to half a million poses; finer grids fill the memory and change no digit that counts."""

FIGURES: dict[str, Callable[[Coverage, Rig, Path], None]] = {
    "coverage.png": draw_coverage,
    "usable_fov.png": lambda result, rig, path: draw_usable_fov(result, path),
    "regions.png": lambda result, rig, path: draw_regions(result, path),
    "resolution.png": draw_resolution,
    "dwell.png": lambda result, rig, path: draw_dwell(result, path),
}


def coverage_report(rig: Rig, folder: Path, *, step_deg: float, log: Log) -> Path:
    """Make the coverage report of a rig.

    Parameters
    ----------
    rig : Rig
        With mirrors, physically possible (`optics.feasibility.feasibility`).
    folder : Path
        New, empty, or an earlier report, which is brought up to date.
    step_deg : float
        Largest step between joint values.
    log : callable
        Takes lines of progress.

    Returns
    -------
    Path
        The report, `coverage.html`; `coverage.json` beside it holds its numbers.

    Raises
    ------
    ValueError
        For a rig without mirrors or a step out of range.
    FileExistsError
        When the folder holds something else.
    """
    rig.require_gaze()
    if not SMALLEST_STEP_DEG <= step_deg <= 90:
        raise ValueError(f"expected a step of the joints from {SMALLEST_STEP_DEG:g} to 90 degrees, got {step_deg:g}")
    stages = Stages.open(folder, rig, log, settings=f"coverage and openings {step_deg!r}")
    results = CoverageResults(
        coverage=stages.run("coverage", GridSummary, lambda: _coverage(rig, folder, step_deg, log)),
        convergence=stages.run("convergence", tuple[Refinement, ...], lambda: _convergence(rig, folder, step_deg, log)),
    )
    log("report ...")
    data = {"rig": rig.model_dump(mode="json"), **plain(results)}
    write_text(folder / "coverage.json", json.dumps(data, indent=2))
    report = folder / "coverage.html"
    write_text(report, coverage_page(rig, results, folder))
    log(str(report))
    return report


def _coverage(rig: Rig, folder: Path, step_deg: float, log: Log) -> tuple[GridSummary, list[Path]]:
    parts = rig_meshes(rig)
    q1, q2 = stepped_joints(rig, step_deg)
    result = compute_coverage(
        rig,
        parts,
        q1=q1,
        q2=q2,
        columns=COLUMNS,
        rows=ROWS,
        nside=NSIDE,
        progress=counter(log, "poses"),
    )
    summary = coverage_summary(result, image_cells=(COLUMNS, ROWS))
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / name for name in (*FIGURES, "openings.csv", "poses.csv", "sphere.csv", "blind.csv")]
    for path, draw in zip(files, FIGURES.values(), strict=False):
        draw(result, rig, path)
    write_poses(result, rig, files[-3])
    write_sphere(result, files[-2])
    write_blind(summary.blind_patches, files[-1])
    log("  what to change ...")
    openings = blind_openings(
        rig,
        parts,
        result,
        possible=lambda changed: not feasibility_problems(changed),
        stowed=rig_meshes(rig, stowed=True) if rig.require_gaze().joints.stow else None,
    )
    write_openings(openings, summary.blind_patches, files[-4])
    triangles = sum(len(part.faces) for part in parts)
    covered = covered_range(rig, parts, result)
    found = GridSummary(
        **vars(summary), step_deg=step_deg, triangles=triangles, covered_range=covered, openings=tuple(openings)
    )
    return found, files


def _convergence(rig: Rig, folder: Path, step_deg: float, log: Log) -> tuple[tuple[Refinement, ...], list[Path]]:
    study = convergence(
        rig,
        rig_meshes(rig),
        step_deg=step_deg,
        columns=COLUMNS,
        rows=ROWS,
        nside=NSIDE,
        done=lambda grid: log(f"  {grid}"),
    )
    path = folder / "convergence.csv"
    write_convergence(study, path)
    return tuple(study), [path]
