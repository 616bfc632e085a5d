"""The workspace coverage report: what a rig sees of the sphere around the robot, as a page to hand round.

Two stages, each of which an interrupted run need not repeat: the coverage with its figures and tables, and the study of
how far its numbers are off.
"""

from __future__ import annotations

import dataclasses
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from cad.assembly.meshes import rig_meshes
from optics.coverage.blind import OUT_OF_REACH, BlindPatch, blind_causes, blind_patches, rim_fraction
from optics.coverage.convergence import Extrapolation, Refinement, convergence
from optics.coverage.coverage import Coverage, compute_coverage, stepped_joints
from optics.coverage.dwell import dwell
from optics.coverage.outcome import Outcome
from optics.coverage.sphere import cell_count
from optics.status import Region
from reports.figures.plotting import OUTCOME_NAMES, REGION_NAMES, THINGS, draw_dwell, draw_regions, draw_usable_fov
from reports.figures.sphere import CAUSE_NAMES, draw_coverage, draw_resolution
from reports.pages import page
from reports.pages.tables import cause_name, rig_facts, write_blind, write_convergence, write_poses, write_sphere
from reports.progress import Announce, Stages
from rigs import Rig
from rigs.atomic_files import write_text

COLUMNS, ROWS, NSIDE = 96, 72, 64
"""Cells of the image and of the sphere: both a little under a degree wide for lenses like the presets'."""

SMALLEST_STEP_DEG = 0.25
"""A quarter of a million to half a million poses; finer grids fill the memory and change no digit that counts."""

LISTED_PATCHES = 8

POLE_DEG = 88
"""Elevation from which a patch is said to be straight up or down: two cells from the pole."""

FIGURES: dict[str, Callable[[Coverage, Rig, Path], None]] = {
    "coverage.png": draw_coverage,
    "usable_fov.png": lambda result, rig, path: draw_usable_fov(result, path),
    "regions.png": lambda result, rig, path: draw_regions(result, path),
    "resolution.png": draw_resolution,
    "dwell.png": lambda result, rig, path: draw_dwell(result, path),
}

Result = dict[str, Any]


def coverage_report(rig: Rig, folder: Path, *, step_deg: float, announce: Announce) -> Path:
    """Make the coverage report of a rig.

    Parameters
    ----------
    rig : Rig
        With mirrors, physically possible (`optics.feasibility.feasibility`).
    folder : Path
        New, empty, or an earlier report, which is brought up to date.
    step_deg : float
        Largest step between joint values.
    announce : callable
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
    start = time.perf_counter()
    stages = Stages.open(folder, rig, announce, settings=f"coverage {step_deg!r}")
    maps = stages.run("coverage", lambda: _coverage(rig, folder, step_deg, announce))
    study = stages.run("convergence", lambda: _convergence(rig, folder, step_deg, announce))
    announce("report ...")
    results = {"coverage": maps, **study}
    write_text(folder / "coverage.json", json.dumps({"rig": rig.model_dump(mode="json"), **results}, indent=2))
    report = folder / "coverage.html"
    write_text(report, _page(rig, folder, results))
    announce(f"{report} in {time.perf_counter() - start:.0f} s")
    return report


def _coverage(rig: Rig, folder: Path, step_deg: float, announce: Announce) -> tuple[Result, list[Path]]:
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
        progress=lambda done, total: announce(f"  {done} of {total} poses"),
    )
    patches = blind_patches(result)
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / name for name in (*FIGURES, "poses.csv", "sphere.csv", "blind.csv")]
    for path, draw in zip(files, FIGURES.values(), strict=False):
        draw(result, rig, path)
    write_poses(result, rig, files[-3])
    write_sphere(result, files[-2])
    write_blind(patches, files[-1])
    triangles = sum(len(part.faces) for part in parts)
    return _numbers(result, patches) | {"step_deg": step_deg, "triangles": triangles}, files


def _convergence(rig: Rig, folder: Path, step_deg: float, announce: Announce) -> tuple[Result, list[Path]]:
    study = convergence(
        rig,
        rig_meshes(rig),
        step_deg=step_deg,
        columns=COLUMNS,
        rows=ROWS,
        nside=NSIDE,
        done=lambda grid: announce(f"  {grid}"),
    )
    path = folder / "convergence.csv"
    write_convergence(study, path)
    return {"convergence": [dataclasses.asdict(refinement) for refinement in study]}, [path]


def _numbers(result: Coverage, patches: list[BlindPatch]) -> Result:
    """Plain data for the page and for machines."""
    best = np.unravel_index(result.solid_angle_sr.argmax(), result.solid_angle_sr.shape)
    counts = result.pixels.sum(axis=(0, 1))
    lost = result.solid_angle_by_outcome_sr.mean(axis=(0, 1))
    shown = result.solid_angle_by_region_sr.mean(axis=(0, 1))
    seen = result.pixels_per_degree[result.covered]
    redundancy = dwell(result)
    causes = blind_causes(result)
    return {
        "poses": int(result.solid_angle_sr.size),
        "image_cells": [COLUMNS, ROWS],
        "nside": result.nside,
        "covered_fraction": result.covered_fraction,
        "covered_standard_error": _chance(result),
        "rim_fraction": rim_fraction(result),
        "upper_fraction": result.upper_fraction,
        "lower_fraction": result.lower_fraction,
        "blind_fraction_by_cause": {cause_name(cause): float((causes == cause).mean()) for cause in CAUSE_NAMES},
        "usable_solid_angle_sr": {
            "mean": result.mean_solid_angle_sr,
            "smallest": float(result.solid_angle_sr.min()),
            "largest": float(result.solid_angle_sr.max()),
            "largest_at_deg": [float(result.q1_deg[best[1]]), float(result.q2_deg[best[0]])],
        },
        "share_of_image": {outcome.name.lower(): float(counts[outcome] / counts.sum()) for outcome in Outcome},
        "mean_solid_angle_sr": {outcome.name.lower(): float(lost[outcome]) for outcome in Outcome},
        "mean_solid_angle_by_region_sr": {
            region.name.lower(): {outcome.name.lower(): float(shown[region, outcome]) for outcome in THINGS}
            for region in REGION_NAMES
        },
        "pixels_per_degree": {
            "worst": float(seen.min(initial=np.inf)) if len(seen) else 0.0,
            "median": float(np.median(seen)) if len(seen) else 0.0,
            "best": float(seen.max(initial=0.0)),
        },
        "poses_seeing_a_direction": {
            "minimum": redundancy.minimum,
            "median": redundancy.median,
            "maximum": redundancy.maximum,
            "once_fraction": redundancy.once_fraction,
            "histogram": redundancy.histogram.tolist(),
        },
        "blind_patches": [
            {**dataclasses.asdict(patch), "cause": cause_name(OUT_OF_REACH if patch.cause is None else patch.cause)}
            for patch in patches
        ],
    }


def _page(rig: Rig, folder: Path, results: Result) -> str:
    maps = results["coverage"]
    study = [_refinement(data) for data in results["convergence"]]
    usable, resolution, redundancy = (
        maps[name] for name in ("usable_solid_angle_sr", "pixels_per_degree", "poses_seeing_a_direction")
    )
    covered, error = maps["covered_fraction"], maps["covered_standard_error"]
    key_numbers = page.tiles(
        [
            (f"{covered:.1%}", f"of all directions seen in some pose, to ±{error:.2%}"),
            (f"{maps['upper_fraction']:.1%} / {maps['lower_fraction']:.1%}", "of the upper / lower hemisphere"),
            (f"{1000 * usable['mean']:.0f} msr", f"usable at a time, mean; at most {1000 * usable['largest']:.0f} msr"),
            (f"{redundancy['median']:.0f} poses", f"see a direction (median), of {maps['poses']}"),
            (f"{resolution['median']:.1f} px/°", "best resolution of a direction in the water (median)"),
        ]
    )

    def picture(name: str, caption: str) -> str:
        return page.picture(folder / name, caption)

    shares = [
        [name, f"{maps['share_of_image'][key]:.1%}", f"{1000 * maps['mean_solid_angle_sr'][key]:.1f}"]
        for key, name in ((outcome.name.lower(), name) for outcome, name in OUTCOME_NAMES.items())
        if maps["share_of_image"][key]
    ]
    sections = [
        f'<h1>{page.text(rig.name)}: what the gaze covers</h1><p class="lead">{page.text(rig.description)}</p>',
        key_numbers,
        page.section(
            "Directions",
            picture("coverage.png", _CAPTIONS["coverage"]),
            _blind_table(maps["blind_patches"]),
        ),
        page.section(
            "Usable field of view",
            picture("usable_fov.png", _CAPTIONS["usable_fov"]),
            page.table(["Where the image goes", "Share of the pixels", "Solid angle (msr)"], shares, numbers=[1, 2]),
        ),
        page.section(
            "What each region of the image shows",
            picture("regions.png", _CAPTIONS["regions"]),
            _region_table(maps["mean_solid_angle_by_region_sr"]),
        ),
        page.section("Resolution", picture("resolution.png", _CAPTIONS["resolution"])),
        page.section("Redundancy", picture("dwell.png", _dwell_caption(redundancy))),
        page.section(
            "How exact this is",
            page.table(["Halved", "", *_LEVEL_NAMES, "Order", "Estimate"], _study_rows(study), numbers=[2, 3, 4, 5, 6]),
            page.bullets(_exactness(maps, study)),
        ),
        page.section("Rig", page.table(["", ""], rig_facts(rig))),
        page.section("Files", page.bullets(_FILES)),
        page.section("What this leaves out", page.bullets(_LIMITS)),
        f"<footer>Made by mirrorgaze from the rig file <code>{page.text(rig.name)}</code>.</footer>",
    ]
    return page.page(f"{rig.name}: coverage", sections)


_LEVEL_NAMES = ("Coarse", "Middle", "Fine")

_CAPTIONS = {
    "coverage": "All directions around the robot as seen from far away, equal areas equal (Mollweide). Blue to yellow: "
    "how many poses see a direction. Blind directions are coloured by what stops the view in most poses that point "
    "there; pale grey: none does. Red: the limits of the joints, as directions of the optical axis.",
    "usable_fov": "Left: solid angle seen over both mirrors, pose by pose. Right: shares of the image over the tilt, "
    "mean over the pan. The table is the mean over all poses. A pixel is lost to the first thing in this order: the "
    "port, M1's edge, M2's edge; only what remains can be lost to a part in the way.",
    "regions": "Mean over all poses. The direct view passes both mirrors, the fold view is seen over M1 only, the gaze "
    "over both; parts in the way hide some of each.",
    "resolution": "Root of the pixels per solid angle in the water. Flat mirrors keep it: it comes from lens and port "
    "alone, and a direction is seen best by the pose that puts it near the image's edge. The two scales differ.",
}

_FILES = (
    "coverage.json: every number of this page",
    "poses.csv: gaze, usable solid angle and the image's cells by outcome, of every pose",
    "sphere.csv: every direction, with the number of its HEALPix cell (ring scheme; colatitude from the body's z, "
    "longitude from its x to the left)",
    "blind.csv: every blind patch; convergence.csv: the study above",
    "*.png: the figures",
)

_LIMITS = (
    "Geometry is computed at 550 nm with an ideal pinhole: no depth of field, no dispersion, perfectly flat mirrors, "
    "rigid parts in their nominal places.",
    "Directions are those of far away things: near the robot, the centimetres between the poses' viewpoints matter.",
    "A direction counts as seen whatever the water, the light and the image's sharpness make of it.",
    "Only the grid's poses count, not the way between them; whether the mount can reach a pose is checked elsewhere.",
)


def _refinement(data: Result) -> Refinement:
    quantities = {
        name: Extrapolation(**{**data[name], "values": tuple(data[name]["values"])})
        for name in ("covered_fraction", "mean_solid_angle_sr")
    }
    return Refinement(name=data["name"], sizes=tuple(data["sizes"]), **quantities)


def _blind_table(patches: list[Result]) -> str:
    if not patches:
        return "<p>No direction is blind.</p>"
    words = {cause_name(cause): name for cause, name in CAUSE_NAMES.items()}
    rows = [
        [
            _place(patch["azimuth_deg"], patch["elevation_deg"]),
            f"{patch['radius_deg']:.1f}°",
            f"{1000 * patch['solid_angle_sr']:.1f}",
            f"{patch['solid_angle_sr'] / (4 * np.pi):.2%}",
            f"{words[patch['cause']]} ({patch['cause_share']:.0%})",
        ]
        for patch in patches[:LISTED_PATCHES]
    ]
    left_out = patches[LISTED_PATCHES:]
    if left_out:
        area = sum(patch["solid_angle_sr"] for patch in left_out)
        rest = [f"{1000 * area:.1f}", f"{area / (4 * np.pi):.2%}", "see blind.csv"]
        rows.append([f"{len(left_out)} smaller", "", *rest])
    header = ["Blind patch around azimuth, elevation", "Radius", "Solid angle (msr)", "Of the sphere", "Because of"]
    return page.table(header, rows, numbers=[1, 2, 3])


def _place(azimuth_deg: float, elevation_deg: float) -> str:
    """Direction in words; at the poles azimuth has no meaning. Adding zero turns the -0 of rounding into 0."""
    if abs(elevation_deg) > POLE_DEG:
        return "straight up" if elevation_deg > 0 else "straight down"
    return f"{round(azimuth_deg) + 0}°, {round(elevation_deg) + 0}°"


def _region_table(regions: Result) -> str:
    names = {region: REGION_NAMES[region] for region in (Region.GAZE, Region.FOLD, Region.DIRECT)}
    rows = []
    for outcome, thing in THINGS.items():
        values = [1000 * regions[region.name.lower()][outcome.name.lower()] for region in names]
        if any(values):
            rows.append([thing, *(f"{value:.1f}" for value in values)])
    return page.table(["Shown (msr)", *names.values()], rows, numbers=[1, 2, 3])


def _dwell_caption(redundancy: Result) -> str:
    return (
        f"Distinct poses, not rays. Of the directions seen, the least seen is seen by {redundancy['minimum']}, half by "
        f"at least {redundancy['median']:.0f}, the most seen by {redundancy['maximum']}; "
        f"{redundancy['once_fraction']:.2%} of the sphere is seen by exactly one pose of the grid."
    )


def _study_rows(study: list[Refinement]) -> list[list[str]]:
    words = {
        "pixels": "cells of the image",
        "poses": "steps of the joints",
        "sphere": "cells of the sphere",
        "all": "all three",
    }
    rows = []
    for refinement in study:
        for what, found, number in (
            ("covered", refinement.covered_fraction, "{:.2%}"),
            ("mean usable (msr)", refinement.mean_solid_angle_sr, "{:.2f}"),
        ):
            scale = 1 if number.endswith("%}") else 1000
            rows.append(
                [
                    words[refinement.name],
                    what,
                    *(number.format(scale * value) for value in found.values),
                    "none" if found.order is None else f"{found.order:.1f}",
                    "–" if found.estimate is None else number.format(scale * found.estimate),
                ]
            )
    return rows


def _chance(result: Coverage) -> float:
    """Standard error of the covered fraction when each cell at the rim is seen, or not, with the same probability."""
    return 0.5 * float(np.sqrt(rim_fraction(result) / cell_count(result.nside)))


def _exactness(maps: Result, study: list[Refinement]) -> list[str]:
    grids = "; ".join(f"{refinement.name}: {refinement.sizes[-1]}" for refinement in study)
    return [
        "Exact: the way of each ray through port and mirrors (float64), the solid angle of each cell's corners, and "
        "which poses see the centre of a cell of the sphere, traced back to its pixel. Parts are "
        f"{maps['triangles']} triangles, met in float32 (0.1 micrometre at 1 m).",
        "Not exact: a cell of the image counts by its centre's ray, so that solid angles gain or lose part of a row of "
        "cells at an edge. A cell of the sphere counts when its centre is seen: at the rim too much as often as too "
        f"little, by chance. Cells at the rim of what is seen are {maps['rim_fraction']:.1%} of the sphere, which "
        f"makes some {maps['covered_standard_error']:.2%} of error. Gaps between poses only take from what is covered.",
        "Each line halves its step twice and keeps the others, as coarse as they may be: compare along a line, not "
        "between lines. Order p: the error shrinks as step^p. “none”: the "
        "differences do not shrink steadily, so that nothing can be said beyond their size. The finest grids are "
        f"{grids}.",
    ]
