"""The page of a design: views, coverage, mount, checks, loads and a dive of one rig."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from optics.coverage.summary import CoverageSummary, name_of
from reports.figures.plotting import OUTCOME_NAMES
from reports.pages import content
from reports.pages.coverage import OpenedSummary, blind_table, openings_blocks
from reports.pages.dive import DiveResults, dive_section
from reports.pages.mount import (
    MountResults,
    bill_of_materials_blocks,
    checks_section,
    drawings_section,
    loads_section,
    mount_files,
    steps_section,
)
from reports.pages.sizing import SizingResults, sizing_section
from reports.pages.standing import Standing, standing_section
from reports.pages.tolerance import ToleranceResults, tolerance_section
from rigs import Rig

LIMITS = (
    "Geometry is computed at 550 nm with an ideal pinhole: no depth of field, no dispersion, perfectly flat mirrors.",
    "Coverage counts directions as seen from far away; a cell of the sphere counts as covered when some pose sees its "
    "centre, which is decided by tracing the centre back to the image.",
    "Views show water of constant properties under a flat sea; the robot's shadow in it is that of joints at zero; the "
    "blur by forward scattering and the sensor's noise are left out.",
    "Clearances are those of rigid parts, and loads are bounds for steady flow.",
)


DIVE = "dive"
"""Folder of the dive in the report's."""


@dataclass(frozen=True, kw_only=True)
class DesignView:
    """What the camera sees in one pose; its file is named from the page's folder."""

    name: str
    file: str
    q1_deg: float
    q2_deg: float
    width_px: int
    height_px: int
    region_px: dict[str, int]
    gaze_deg: dict[str, float]
    target_px: tuple[float, float] | None

    @property
    def caption(self) -> str:
        """Pose, gaze and size of the view in words."""
        # Adding zero turns the -0 of a rounded tiny angle into 0.
        gaze = {name: round(value) + 0 for name, value in self.gaze_deg.items()}
        q1, q2 = (round(value, 1) + 0 for value in (self.q1_deg, self.q2_deg))
        return (
            f"{self.name}: q1 = {q1}°, q2 = {q2}°; gaze azimuth {gaze['azimuth']}°, elevation "
            f"{gaze['elevation']}°, roll {gaze['roll']}°; {self.region_px['gaze']} gaze pixels"
        )


@dataclass(frozen=True, kw_only=True)
class Views:
    """Views through the mirrors."""

    views: tuple[DesignView, ...]


@dataclass(frozen=True, kw_only=True)
class Exterior:
    """Files of the views from outside, and what they show."""

    files: tuple[str, ...]
    caption: str


@dataclass(frozen=True, kw_only=True)
class DesignResults:
    """What the page reports of a design, and a summary holds for machines; None for what was not made."""

    coverage: OpenedSummary | None = None
    sizing: SizingResults | None = None
    outside: Exterior | None = None
    mount: MountResults | None = None
    tolerance: ToleranceResults | None = None
    views: Views | None = None
    dive: DiveResults | None = None


def design_blocks(rig: Rig, standing: Standing, results: DesignResults, folder: Path) -> list[content.Block]:
    """What the report of a design says, in a folder that holds its images; of what was made, and what was not."""
    missing = [name for name in DesignResults.__dataclass_fields__ if getattr(results, name) is None]
    mount, dive = results.mount, results.dive
    return [
        content.Title(name=rig.name, lead=rig.description),
        content.paragraph(f"{standing.marked}."),
        standing_section(standing, mount, results.tolerance),
        *([content.paragraph(f"Not made: {', '.join(missing)}.")] if missing else []),
        *([] if results.coverage is None else [content.tiles(_key_numbers(results.coverage))]),
        *([] if results.views is None else [_views_section(results.views, folder)]),
        *([] if results.coverage is None else [_coverage_section(results.coverage, folder)]),
        *([] if results.sizing is None else [sizing_section(results.sizing, folder)]),
        *_mount_sections(results, folder),
        *([] if results.tolerance is None else [tolerance_section(results.tolerance, folder)]),
        *([] if dive is None else [dive_section(dive, folder / DIVE, beside=f"{DIVE}/")]),
        content.section("Rig", content.table(["", ""], rig.facts)),
        content.section("Files", content.listed([*_files(results), *([] if mount is None else mount_files(mount))])),
        content.section("What this leaves out", content.bullets(LIMITS)),
        content.footer(f"Made by mirrorgaze from the rig file {rig.name}."),
    ]


def _views_section(views: Views, folder: Path) -> content.Section:
    images = (content.figure(folder / view.file, view.caption) for view in views.views)
    return content.section("What the camera sees", content.gallery(images))


def _coverage_section(found: OpenedSummary, folder: Path) -> content.Section:
    return content.section(
        "Usable field of view and coverage",
        content.figure(folder / "coverage/usable_fov.png", f"{found.poses} poses over the joint ranges"),
        content.figure(
            folder / "coverage/coverage.png",
            "All directions around the robot, equal areas equal; red: where the axis can point",
        ),
        content.table(["Where the image goes, mean over all poses", "Share"], _shares(found), numbers=[1]),
        blind_table(found.blind_patches),
        *openings_blocks(found),
    )


def _mount_sections(results: DesignResults, folder: Path) -> list[content.Section]:
    """The mount from outside and its parts, and what checks and loads say of it."""
    outside, mount = results.outside, results.mount
    shown: list[content.Block] = []
    if outside is not None:
        shown.append(content.gallery(content.figure(folder / file, outside.caption) for file in outside.files))
    if mount is not None:
        shown += bill_of_materials_blocks(mount)
    sections = [content.section("Mount", *shown)] if shown else []
    if mount is not None:
        sections += [*steps_section(mount, folder), *drawings_section(mount, folder)]
        sections += [checks_section(mount, folder / "mount"), loads_section(mount, folder / "mount")]
    return sections


def _files(results: DesignResults) -> list[content.Line]:
    """Links to the files of the stages that were made."""
    of_stages = {
        "views": [f"views/{view.name}.png" for view in results.views.views] if results.views else [],
        "dive": [f"dive/{name}" for name in ("overlay.mp4", "video.mkv", "log.parquet", "metrics.json", "dive.toml")],
        "coverage": ["coverage/poses.csv", "coverage/sphere.csv"],
    }
    described = {
        "views": "the views above at full size",
        "dive": "the dive: what the loop saw, the camera's video, ground truth beside what the loop estimated",
        "coverage": "gaze, usable solid angle and losses of every pose; every direction",
    }
    made = [name for name in of_stages if getattr(results, name) is not None]
    numbers = content.file_line("every number of this page", ["summary.json"])
    return [numbers, *(content.file_line(described[name], of_stages[name]) for name in made)]


def _key_numbers(found: CoverageSummary) -> list[tuple[str, str]]:
    return [
        (f"{found.covered_fraction:.1%}", "of all directions seen through both mirrors"),
        (f"{found.upper_fraction:.1%} / {found.lower_fraction:.1%}", "of the upper / lower hemisphere"),
        (f"{found.usable_solid_angle_sr.largest * 1000:.0f} msr", "largest usable field of view of a pose"),
        (f"{found.share_of_image['seen']:.1%}", "of the image shows the gaze, mean over all poses"),
    ]


def _shares(found: CoverageSummary) -> list[list[str]]:
    shares = {name: found.share_of_image[name_of(outcome)] for outcome, name in OUTCOME_NAMES.items()}
    return [[name, f"{share:.1%}"] for name, share in shares.items() if share]
