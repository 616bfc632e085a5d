"""The page of a coverage: what a rig sees of the sphere around the robot, for people to hand round."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from optics.coverage.blind import BlindPatch, cause_name
from optics.coverage.convergence import Refinement
from optics.coverage.dwell import Dwell
from optics.coverage.openings.openings import Opening
from optics.coverage.summary import REGIONS, CoverageSummary, name_of
from optics.coverage.uncertainty import CoveredRange
from reports.figures.plotting import OUTCOME_NAMES, REGION_NAMES, THINGS
from reports.figures.sphere import CAUSE_NAMES
from reports.pages import content, page
from rigs import Rig

LISTED_PATCHES = 8

POLE_DEG = 88
"""Elevation from which a patch is said to be straight up or down: two cells from the pole."""


@dataclass(frozen=True, kw_only=True)
class OpenedSummary(CoverageSummary):
    """A coverage in numbers, with what to change for each blind patch."""

    openings: tuple[Opening, ...]


@dataclass(frozen=True, kw_only=True)
class GridSummary(OpenedSummary):
    """A coverage in numbers, with the largest step of the joints and the triangles of all parts.

    `covered_range` says how far the covered fraction is off.
    """

    step_deg: float
    triangles: int
    covered_range: CoveredRange


@dataclass(frozen=True, kw_only=True)
class CoverageResults:
    """What the page reports: the coverage, and how its numbers change with its grids."""

    coverage: GridSummary
    convergence: tuple[Refinement, ...]


def coverage_page(rig: Rig, results: CoverageResults, figures: Path) -> str:
    """Page of a rig's coverage as HTML, with the figures that lie in a folder embedded."""
    found, study = results.coverage, results.convergence
    usable, redundancy = found.usable_solid_angle_sr, found.poses_seeing_a_direction
    key_numbers = content.tiles(
        [
            (
                f"{found.covered_fraction:.1%}",
                f"of all directions seen in some pose; {_range(found.covered_range)} with finer steps",
            ),
            (f"{found.upper_fraction:.1%} / {found.lower_fraction:.1%}", "of the upper / lower hemisphere"),
            (f"{1000 * usable.mean:.0f} msr", f"usable at a time, mean; at most {1000 * usable.largest:.0f} msr"),
            (f"{redundancy.median:.0f} poses", f"see a direction (median), of {found.poses}"),
            (f"{found.pixels_per_degree.median:.1f} px/°", "best resolution of a direction in the water (median)"),
        ]
    )

    def image(name: str, caption: str) -> content.Figure:
        return content.figure(figures / name, caption)

    sections: list[content.Block] = [
        content.Title(name=f"{rig.name}: what the gaze covers", lead=rig.description),
        key_numbers,
        content.section(
            "Directions",
            image("coverage.png", _CAPTIONS["coverage"]),
            blind_table(found.blind_patches),
            *openings_blocks(found),
        ),
        content.section(
            "Usable field of view",
            image("usable_fov.png", _CAPTIONS["usable_fov"]),
            content.table(
                ["Where the image goes", "Share of the pixels", "Solid angle (msr)"], _shares(found), numbers=[1, 2]
            ),
        ),
        content.section(
            "What each region of the image shows",
            image("regions.png", _CAPTIONS["regions"]),
            _region_table(found.mean_solid_angle_by_region_sr),
        ),
        content.section("Resolution", image("resolution.png", _CAPTIONS["resolution"])),
        content.section("Redundancy", image("dwell.png", _dwell_caption(redundancy))),
        content.section(
            "How exact this is",
            content.table(
                ["Halved", "", *_LEVEL_NAMES, "Order", "Estimate"], _study_rows(study), numbers=[2, 3, 4, 5, 6]
            ),
            content.bullets(_exactness(found, study)),
        ),
        content.section("Rig", content.table(["", ""], rig.facts)),
        content.section("Files", content.bullets(_FILES)),
        content.section("What this leaves out", content.bullets(_LIMITS)),
        content.footer(f"Made by mirrorgaze from the rig file {rig.name}."),
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

_OPENINGS = (
    "What helps: the cheapest change of one number that opens at least half of a patch, or that which opens most of "
    "it, traced again with the changed rig. The mount is moved and stretched along, not designed again. All in all: "
    "what the change does to the whole sphere, on a coarse grid."
)

_FILES = (
    "coverage.json: every number of this page",
    "poses.csv: gaze, usable solid angle and the image's cells by outcome, of every pose",
    "sphere.csv: every direction, with the number of its HEALPix cell (ring scheme; colatitude from the body's z, "
    "longitude from its x to the left)",
    "blind.csv: every blind patch; openings.csv: what opens them; convergence.csv: the study above",
    "*.png: the figures",
)

_LIMITS = (
    "Geometry is computed at 550 nm with an ideal pinhole: no depth of field, no dispersion, perfectly flat mirrors, "
    "rigid parts in their nominal places.",
    "Directions are those of far away things: near the robot, the centimetres between the poses' viewpoints matter.",
    "A direction counts as seen whatever the water, the light and the image's sharpness make of it.",
    "Only the grid's poses count, not the way between them; whether the mount can reach a pose is checked elsewhere.",
)


def _shares(found: CoverageSummary) -> list[list[str]]:
    named = ((name_of(outcome), name) for outcome, name in OUTCOME_NAMES.items())
    return [
        [name, f"{found.share_of_image[key]:.1%}", f"{1000 * found.mean_solid_angle_sr[key]:.1f}"]
        for key, name in named
        if found.share_of_image[key]
    ]


def blind_table(patches: tuple[BlindPatch, ...]) -> content.Block:
    """Table of the largest blind patches and what blinds them."""
    if not patches:
        return content.paragraph("No direction is blind.")
    words = {cause_name(cause): name for cause, name in CAUSE_NAMES.items()}
    rows = [
        [
            _place(patch.azimuth_deg, patch.elevation_deg),
            f"{patch.radius_deg:.1f}°",
            f"{1000 * patch.solid_angle_sr:.1f}",
            f"{patch.solid_angle_sr / (4 * np.pi):.2%}",
            f"{words[patch.cause]} ({patch.cause_share:.0%})",
        ]
        for patch in patches[:LISTED_PATCHES]
    ]
    left_out = patches[LISTED_PATCHES:]
    if left_out:
        area = sum(patch.solid_angle_sr for patch in left_out)
        rest = [f"{1000 * area:.1f}", f"{area / (4 * np.pi):.2%}", "see blind.csv"]
        rows.append([f"{len(left_out)} smaller", "", *rest])
    header = ["Blind patch around azimuth, elevation", "Radius", "Solid angle (msr)", "Of the sphere", "Because of"]
    return content.table(header, rows, numbers=[1, 2, 3])


def _range(covered: CoveredRange) -> str:
    return f"{covered.low:.1%} to {covered.high:.1%}"


def openings_blocks(found: OpenedSummary) -> tuple[content.Block, ...]:
    """What to change for each patch, the most that is gained first."""
    if not found.openings:
        return (content.paragraph("No change of one number opens a blind patch without taking more elsewhere."),)
    rows = []
    for opening in found.openings:
        patch = found.blind_patches[opening.patch]
        rows.append(
            [
                _place(patch.azimuth_deg, patch.elevation_deg),
                opening_words(opening),
                f"{1000 * opening.gained_sr:.1f}",
                f"{opening.share:.0%}",
                f"{1000 * opening.net_sr:+.0f}",
            ]
        )
    header = [
        "Blind patch around azimuth, elevation",
        "Change that opens it",
        "Gained (msr)",
        "Of the patch",
        "All in all",
    ]
    return content.paragraph(_OPENINGS), content.table(header, rows, numbers=[2, 3, 4])


def opening_words(opening: Opening) -> str:
    """A change in words: key, values, unit, and what must give way."""
    if opening.key == "joints.stow":
        return "M1 swung away (joints.stow): the camera looks there itself"
    also = f" ({opening.also})" if opening.also else ""
    return f"{opening.key}: {opening.before:g} → {opening.after:g} {opening.unit}{also}"


def _place(azimuth_deg: float, elevation_deg: float) -> str:
    """Direction in words; at the poles azimuth has no meaning. Adding zero turns the -0 of rounding into 0."""
    if abs(elevation_deg) > POLE_DEG:
        return "straight up" if elevation_deg > 0 else "straight down"
    return f"{round(azimuth_deg) + 0}°, {round(elevation_deg) + 0}°"


def _region_table(regions: dict[str, dict[str, float]]) -> content.Table:
    names = {region: REGION_NAMES[region] for region in REGIONS}
    rows = []
    for outcome, thing in THINGS.items():
        values = [1000 * regions[name_of(region)][name_of(outcome)] for region in names]
        if any(values):
            rows.append([thing, *(f"{value:.1f}" for value in values)])
    return content.table(["Shown (msr)", *names.values()], rows, numbers=[1, 2, 3])


def _dwell_caption(redundancy: Dwell) -> str:
    return (
        f"Distinct poses, not rays. Of the directions seen, the least seen is seen by {redundancy.minimum}, half by "
        f"at least {redundancy.median:.0f}, the most seen by {redundancy.maximum}; "
        f"{redundancy.once_fraction:.2%} of the sphere is seen by exactly one pose of the grid."
    )


def _study_rows(study: tuple[Refinement, ...]) -> list[list[str]]:
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


def _exactness(found: GridSummary, study: tuple[Refinement, ...]) -> list[str]:
    covered, words = found.covered_range, {"joints": "joints' steps", "cells": "sphere's cells"}
    grids = "; ".join(f"{refinement.name}: {refinement.sizes[-1]}" for refinement in study)
    return [
        "Exact: the path of each ray through port and mirrors (float64), the solid angle of each cell's corners, and "
        "which poses see the centre of a cell of the sphere, traced back to its pixel. Parts are "
        f"{found.triangles} triangles, intersected in float32 (0.1 micrometre at 1 m).",
        "Not exact: a cell of the image counts by its centre's ray, so that solid angles gain or lose part of a row of "
        "cells at an edge. A cell of the sphere counts when its centre is seen: at the rim too much as often as too "
        f"little, by chance. Cells at the rim of what is seen are {found.rim_fraction:.1%} of the sphere, which "
        f"makes ±{covered.cells:.2%} (two standard errors, and what their quarters change). Gaps between poses only "
        f"take from what is covered: with half the steps it is {covered.half_step_fraction:.2%}, and finer ones add at "
        f"most {covered.joints:.2%} in all. The {words[covered.coarsest]} are the coarsest: "
        f"{_range(covered)}.",
        "Each line halves its step twice and keeps the others, as coarse as they may be: compare along a line, not "
        "between lines. Order p: the error shrinks as step^p. “none”: the "
        "differences do not shrink steadily, so that nothing can be said beyond their size. The finest grids are "
        f"{grids}.",
    ]
