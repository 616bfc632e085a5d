"""The design report: one rig in, a folder out that an engineer can use.

Views at a handful of gazes, the mount's files, maps of usable field of view and coverage, a dive that shows whether the
tracking loop holds a target with it, one page that opens from disk, and a summary for machines. Each stage's files
appear whole; an interrupted run goes on where it stopped.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from cad.assembly.meshes import rig_meshes
from cad.export.drawings.manifest import HASH_DIGITS, rig_hash
from dives import Dive, dive_verdict, run_dive
from dives.validation import validation_dive
from optics.coverage.coverage import compute_coverage
from optics.coverage.openings.openings import blind_openings
from optics.coverage.summary import coverage_summary
from optics.feasibility.feasibility import feasibility_problems
from optics.feasibility.requirements import Achieved, judged
from optics.gaze.kinematics import inverse_gaze
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.tolerance.tolerance import PERCENTILES, tolerance_study
from reports.figures.plotting import draw_usable_fov
from reports.figures.sphere import draw_coverage
from reports.figures.tolerance import write_tolerances
from reports.pages.coverage import OpenedSummary
from reports.pages.design import DIVE, DesignResults, DesignView, Exterior, Views
from reports.pages.dive import DiveResults
from reports.pages.mount import CheckedMount, MountResults, mount_results
from reports.pages.report_files import write_report
from reports.pages.sizing import SizingResults
from reports.pages.standing import Standing
from reports.pages.tables import write_poses, write_sphere
from reports.pages.tolerance import RankedTolerance, ToleranceResults
from reports.progress import Log, Stages, counter
from reports.studies.dive_report import dive_results
from reports.studies.mount_export import checked_mount, export_checked_mount
from reports.studies.requirements import achieved_by
from reports.studies.sizing import sizing_results
from rigs import Rig
from scenes.baking.light_quality import LightQuality, light_identity
from scenes.baking.lit_scene import prepare
from scenes.exterior import write_exterior_views
from scenes.renderer import FastRenderer
from scenes.requests.render import render_with
from scenes.stage.scene import make_scene

GAZES_DEG = {
    "ahead": (0.0, 0.0),
    "target": (30.0, -20.0),
    "left": (70.0, 0.0),
    "right": (-70.0, 0.0),
    "down": (0.0, -50.0),
    "up": (0.0, 50.0),
    "behind": (180.0, 0.0),
}
"""Azimuth and elevation of the report's views; those outside the joint limits are left out."""

EXTERIOR_Q1_DEG = 20.0
EXTERIOR_CAPTION = f"From outside, in air, at q1 = {EXTERIOR_Q1_DEG:g}°, q2 = 0°"

VIEW_SAMPLES = 4
BUILT_RIGS = 10_000
"""As `mirrorgaze tolerance`."""
STAGES = ("coverage", "sizing", "outside", "mount", "tolerance", "views", "dive")
"""In their order: what is quick comes first."""


@dataclass(frozen=True, kw_only=True)
class MapGrid:
    """How finely the coverage maps are divided.

    Attributes
    ----------
    poses : int
        Steps of each joint over its range.
    columns, rows : int
        Of the image, for the usable field of view of a pose: with these its mean over the poses is good to 0.5 %. The
        sphere does not depend on them: its cells are decided by their centres.
    """

    poses: int = 91
    columns: int = 128
    rows: int = 96


def design(
    rig: Rig,
    folder: Path,
    *,
    log: Log,
    dive: Dive | None = None,
    grid: MapGrid | None = None,
    only: Collection[str] = STAGES,
    quality: LightQuality | None = None,
) -> Path:
    """Make the design report of a rig.

    Parameters
    ----------
    rig : Rig
        With mirrors, physically possible (`optics.feasibility.feasibility`).
    folder : Path
        New, empty, or an earlier report, which is brought up to date.
    log : callable
        Takes lines of progress.
    dive : Dive, optional
        Through which the loop is run with this rig; by default `dives.validation.validation_dive`.
    grid : MapGrid, optional
        Of the coverage maps.
    only : collection of str
        Stages to make, of `STAGES`. The page shows what was made, then or before, and says what was not.
    quality : LightQuality, optional
        Of the light in views and dive, full by default.

    Returns
    -------
    Path
        The report, `report.html`; it is there from the first stage on, and every stage fills it up.

    Raises
    ------
    RigError
        When a check of the mount fails (parts collide, do not fit the printer, ...) or a servo is too weak.
    ValueError
        For a rig without mirrors or servos.
    DiveStoppedError
        When an image of the dive could not be made or written; the same call goes on from there.
    FileExistsError
        When the folder holds something else.
    """
    rig.require_gaze()
    dive = validation_dive(rig) if dive is None else dive
    grid = MapGrid() if grid is None else grid
    settings = " ".join(map(str, [dive.model_dump_json(), grid, *light_identity(quality)]))
    stages = Stages.open(folder, rig, log, settings=settings)
    if not stages.done:
        # A dive that another rig or program began would not end as this one's.
        shutil.rmtree(folder / DIVE, ignore_errors=True)
    # Nothing is written of a mount that cannot be made.
    made_before = stages.recall("mount", MountResults) is not None
    mount = _checked_mount(rig, log) if "mount" in only and not made_before else None
    makers: dict[str, tuple[type[Any], Callable[[], tuple[Any, list[Path]]]]] = {
        "coverage": (OpenedSummary, lambda: _coverage(rig, folder, grid)),
        "sizing": (SizingResults, lambda: sizing_results(rig, folder)),
        "outside": (Exterior, lambda: _outside(rig, folder)),
        "mount": (MountResults, lambda: _mount(mount or _checked_mount(rig, log), folder, log)),
        "tolerance": (ToleranceResults, lambda: _tolerance(rig, folder)),
        "views": (Views, lambda: _views(rig, folder, quality)),
        "dive": (DiveResults, lambda: _dive(rig, dive, folder, log, quality)),
    }
    results = DesignResults(**{name: stages.recall(name, kind) for name, (kind, _) in makers.items()})
    for name, (kind, make) in makers.items():
        if name in only:
            new = getattr(results, name) is None
            results = replace(results, **{name: stages.run(name, kind, make)})
            if new:
                report = write_report(rig, _standing(rig, results, dive, stages.date), results, folder)
                log(f"{report} shows {name}")
    return write_report(rig, _standing(rig, results, dive, stages.date), results, folder)


def _standing(rig: Rig, results: DesignResults, dive: Dive, date: str) -> Standing:
    """What the design is judged to be, by what was made of it."""
    metrics = None if results.dive is None else results.dive.metrics
    achieved = Achieved()
    if rig.requirements is not None:
        covered = None if results.coverage is None else results.coverage.covered_fraction
        achieved = achieved_by(rig, rig_meshes(rig), covered_fraction=covered)
    if results.mount is not None and results.mount.prints.sliced:
        achieved = replace(achieved, print_time_s=results.mount.prints.time_s)
    if metrics is not None:
        error_deg = metrics["gaze_error_held_rms_deg"] if metrics["acquired"] else np.inf
        achieved = replace(achieved, gaze_error_deg=error_deg)
    return Standing(
        date=date,
        revision=rig.revision,
        rig_digest=rig_hash(rig)[:HASH_DIGITS],
        version=version("mirrorgaze"),
        dive=None if metrics is None else dive_verdict(metrics, dive.limits, rig),
        gaze_error_limit_deg=None if rig.requirements is None else rig.requirements.gaze_error_deg,
        requirements=tuple(judged(rig.requirements, achieved)),
    )


def _checked_mount(rig: Rig, log: Log) -> CheckedMount:
    # A slicer's warning fails the report's verdict, and an export: a report is wanted all the same.
    return checked_mount(rig, log=log, slicing=False)


def _mount(made: CheckedMount, folder: Path, log: Log) -> tuple[MountResults, list[Path]]:
    files = export_checked_mount(made, folder / "mount", log=log)
    names = (str(file.relative_to(folder)) for file in files)
    return mount_results(made, names, folder), files


def _tolerance(rig: Rig, folder: Path) -> tuple[ToleranceResults, list[Path]]:
    study = tolerance_study(rig, samples=BUILT_RIGS)
    files = write_tolerances(study, folder / "tolerance")
    built, calibrated = (
        {str(percent): float(np.percentile(errors.gaze_deg, percent)) for percent in PERCENTILES}
        for errors in (study.built, study.calibrated)
    )
    ranking = tuple(
        RankedTolerance(
            name=each.source.name,
            value=each.source.value,
            gaze_rms_deg=each.gaze_rms_deg,
            gaze_share=each.gaze_share,
        )
        for each in study.ranking
    )
    figure = files[-1].relative_to(folder).as_posix()
    results = ToleranceResults(
        samples=BUILT_RIGS,
        built_deg=built,
        calibrated_deg=calibrated,
        built_rms_deg=_rms(study.built.gaze_deg),
        calibrated_rms_deg=_rms(study.calibrated.gaze_deg),
        ranking=ranking,
        figure=figure,
    )
    return results, files


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _views(rig: Rig, folder: Path, quality: LightQuality | None) -> tuple[Views, list[Path]]:
    target = folder / "views"
    target.mkdir(parents=True, exist_ok=True)
    renderer = FastRenderer(prepare(make_scene(rig), rig, quality=quality), samples=VIEW_SAMPLES)
    layout = Layout.from_rig(rig)
    views, files = [], []
    for name, (azimuth, elevation) in GAZES_DEG.items():
        solutions = inverse_gaze(layout, np.radians(azimuth), np.radians(elevation))
        if not len(solutions):
            continue
        # Of several ways to look there, the one nearest to rest.
        q1_deg, q2_deg = np.degrees(solutions[np.abs(solutions).max(axis=1).argmin()])
        path = target / f"{name}.png"
        view = render_with(renderer, q1_deg=float(q1_deg), q2_deg=float(q2_deg), path=path)
        assert view.gaze_deg is not None
        views.append(
            DesignView(
                name=name,
                file=f"views/{path.name}",
                q1_deg=view.q1_deg,
                q2_deg=view.q2_deg,
                width_px=view.width_px,
                height_px=view.height_px,
                region_px=view.region_px,
                gaze_deg=view.gaze_deg,
                target_px=view.target_px,
            )
        )
        files.append(path)
    return Views(views=tuple(views)), files


def _outside(rig: Rig, folder: Path) -> tuple[Exterior, list[Path]]:
    target = folder / "views"
    target.mkdir(parents=True, exist_ok=True)
    files = write_exterior_views(rig, rig_meshes(rig), target, q1=np.radians(EXTERIOR_Q1_DEG), q2=0.0)
    return Exterior(files=tuple(f"views/{path.name}" for path in files), caption=EXTERIOR_CAPTION), files


def _coverage(rig: Rig, folder: Path, grid: MapGrid) -> tuple[OpenedSummary, list[Path]]:
    layout = Layout.from_rig(rig)
    q1, q2 = (joint.values(grid.poses) for joint in (layout.pan, layout.tilt))
    meshes = rig_meshes(rig)
    result = compute_coverage(rig, meshes, q1=q1, q2=q2, columns=grid.columns, rows=grid.rows)
    target = folder / "coverage"
    target.mkdir(parents=True, exist_ok=True)
    files = [target / name for name in ("usable_fov.png", "coverage.png", "poses.csv", "sphere.csv")]
    draw_usable_fov(result, files[0])
    draw_coverage(result, rig, files[1])
    write_poses(result, rig, files[2])
    write_sphere(result, files[3])
    summary = coverage_summary(result, image_cells=(grid.columns, grid.rows))
    openings = blind_openings(
        rig,
        meshes,
        result,
        possible=lambda changed: not feasibility_problems(changed),
        stowed=rig_meshes(rig, stowed=True) if rig.require_gaze().joints.stow else None,
    )
    return OpenedSummary(**vars(summary), openings=tuple(openings)), files


def _dive(rig: Rig, dive: Dive, folder: Path, log: Log, quality: LightQuality | None) -> tuple[DiveResults, list[Path]]:
    target = folder / DIVE
    run_dive(dive, target, rig=rig, quality=quality, log=log, progress=counter(log, "frames of the dive"))
    results = dive_results(target)
    return results, sorted(path for path in target.rglob("*") if path.is_file())
