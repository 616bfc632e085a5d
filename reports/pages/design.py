"""The page of a design: views, coverage, mount, checks, loads and a dive of one rig."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from optics.coverage.summary import CoverageSummary, name_of
from reports.figures.plotting import OUTCOME_NAMES
from reports.pages import page
from reports.pages.dive import DiveResults, dive_section
from reports.pages.mount import MountResults, checks_section, loads_section, mount_files, parts_table
from rigs import Rig

LIMITS = (
    "Geometry is computed at 550 nm with an ideal pinhole: no depth of field, no dispersion, perfectly flat mirrors.",
    "Coverage counts directions as seen from far away; a cell of the sphere counts as covered when some pose sees its "
    "centre, which is decided by tracing the centre back to the image.",
    "Views show water of constant properties under a flat sea; the robot's shadow in it is that of joints at zero; the "
    "blur by forward scattering and the sensor's noise are left out.",
    "Clearances are those of rigid parts, and loads are bounds for steady flow; nothing is sliced here, see mirrorgaze "
    "export.",
)


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
    """Views through the mirrors, and files of the views from outside with what they show."""

    views: tuple[DesignView, ...]
    exterior: tuple[str, ...]
    exterior_caption: str


@dataclass(frozen=True, kw_only=True)
class DiveSummary:
    """A dive in numbers."""

    name: str
    metrics: dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class DesignResults:
    """What the page reports of a design, and a summary holds for machines; without a dive when none was asked for."""

    mount: MountResults
    views: Views
    coverage: CoverageSummary
    dive: DiveSummary | None


def design_page(rig: Rig, results: DesignResults, dive: DiveResults | None, folder: Path) -> str:
    """Page of a design as HTML, with the figures and views that lie in its folder embedded."""
    found, views, mount = results.coverage, results.views, results.mount
    sections = [
        f'<h1>{page.text(rig.name)}</h1><p class="lead">{page.text(rig.description)}</p>',
        page.tiles(_key_numbers(found)),
        page.section(
            "What the camera sees",
            page.gallery(page.image(folder / view.file, view.caption) for view in views.views),
        ),
        page.section(
            "Usable field of view and coverage",
            page.image(folder / "coverage/usable_fov.png", f"{found.poses} poses over the joint ranges"),
            page.image(
                folder / "coverage/coverage.png",
                "All directions around the robot, equal areas equal; red: where the axis can point",
            ),
            page.table(["Where the image goes, mean over all poses", "Share"], _shares(found), numbers=[1]),
        ),
        page.section(
            "Mount",
            page.gallery(page.image(folder / file, views.exterior_caption) for file in views.exterior),
            parts_table(mount),
        ),
        checks_section(mount, folder / "mount"),
        loads_section(mount, folder / "mount"),
        *([] if dive is None else [dive_section(dive)]),
        page.section("Rig", page.table(["", ""], rig.facts)),
        page.section("Files", page.bullets([*_files(dive), *mount_files(mount)])),
        page.section("What this leaves out", page.bullets(LIMITS)),
        f"<footer>Made by mirrorgaze from the rig file <code>{page.text(rig.name)}</code>.</footer>",
    ]
    return page.page(f"{rig.name}: design report", sections)


def _files(dive: DiveResults | None) -> list[str]:
    of_dive = (
        "dive/: video.mkv and overlay.mp4, log.parquet (ground truth beside what the loop estimated), metrics.json, "
        "dive.toml"
    )
    return [
        "summary.json: every number of this page",
        "views/*.png: the images above, at full size",
        *([] if dive is None else [of_dive]),
        "coverage/poses.csv: gaze, usable solid angle and losses of every pose; coverage/sphere.csv: every direction",
    ]


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
