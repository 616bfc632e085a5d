"""The design dossier: one rig in, a folder out that an engineer can use.

Views at a handful of gazes, the mount's files, maps of usable field of view and coverage, a dive that shows whether the
tracking loop holds a target with it, one page that opens from disk, and a summary for machines. Each stage's files
appear whole; an interrupted dossier goes on where it stopped.
"""

from __future__ import annotations

import json
import shutil
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from cad.assembly.meshes import rig_meshes
from dives import Dive, run_dive
from dives.validation import validation_dive
from optics.coverage.coverage import compute_coverage
from optics.coverage.outcome import Outcome
from optics.gaze.kinematics import inverse_gaze
from optics.layout import Layout
from reports.figures.dive import write_dive_figures
from reports.figures.plotting import OUTCOME_NAMES, draw_usable_fov
from reports.figures.sphere import draw_coverage
from reports.pages import page
from reports.pages.dive_report import dive_section
from reports.pages.mount_sections import checks_and_loads, checks_section, loads_section
from reports.pages.tables import rig_facts, write_poses, write_sphere
from reports.progress import Announce, Stages
from reports.studies.mount_export import export_checked_mount
from rigs import Rig
from rigs.atomic_files import write_text
from scenes.exterior import write_portraits
from scenes.renderer import FastRenderer
from scenes.requests.views import view_of
from scenes.stage.stage import stage
from tracking.log import read_log

GAZES_DEG = {
    "ahead": (0.0, 0.0),
    "target": (30.0, -20.0),
    "left": (70.0, 0.0),
    "right": (-70.0, 0.0),
    "down": (0.0, -50.0),
    "up": (0.0, 50.0),
    "behind": (180.0, 0.0),
}
"""Azimuth and elevation of the dossier's views; those outside the joint limits are left out."""

PORTRAIT_Q1_DEG = 20.0
PORTRAIT_CAPTION = f"From outside, in air, at q1 = {PORTRAIT_Q1_DEG:g}°, q2 = 0°"

VIEW_SAMPLES = 4
GRID_POSES = 91
"""Steps of each joint over its range in the coverage maps."""

IMAGE_CELLS = (128, 96)
"""Columns and rows into which the image is divided for the usable field of view of a pose: its mean over the poses is
good to 0.5 %. The sphere does not depend on them: its cells are decided by their centres."""

DIVE = "dive"
"""Folder of the dive in the dossier's."""

TOLD_EVERY_FRAMES = 300

Result = dict[str, Any]


def design(rig: Rig, folder: Path, *, announce: Announce, dive: Dive | None = None) -> Path:
    """Make the dossier of a rig.

    Parameters
    ----------
    rig : Rig
        With mirrors, physically possible (`optics.feasibility.feasibility`).
    folder : Path
        New, empty, or an earlier dossier, which is brought up to date.
    announce : callable
        Takes lines of progress.
    dive : Dive, optional
        Through which the loop is run with this rig; by default `dives.validation.validation_dive`.

    Returns
    -------
    Path
        The report, `report.html`.

    Raises
    ------
    RigError
        When a check of the mount fails (parts collide, do not fit the printer, ...) or a servo is too weak.
    ValueError
        For a rig without mirrors or servos.
    DiveStoppedError
        When a picture of the dive could not be made or written; the same call goes on from there.
    FileExistsError
        When the folder holds something else.
    """
    rig.require_gaze()
    start = time.perf_counter()
    dive = validation_dive(rig) if dive is None else dive
    stages = Stages.open(folder, rig, announce, settings=dive.model_dump_json())
    if not stages.done:
        # A dive that another rig or program began would not end as this one's.
        shutil.rmtree(folder / DIVE, ignore_errors=True)
    mount = stages.run("mount", lambda: _mount(rig, folder, announce))
    views = stages.run("views", lambda: _views(rig, folder))
    maps = stages.run("coverage", lambda: _maps(rig, folder))
    dived = stages.run("dive", lambda: _dive(rig, dive, folder, announce))
    announce("report ...")
    results = {"mount": mount, "views": views, "coverage": maps, "dive": dived}
    report = folder / "report.html"
    write_text(folder / "summary.json", json.dumps({"rig": rig.model_dump(mode="json"), **results}, indent=2))
    write_text(report, _report(rig, folder, results))
    announce(f"{report} in {time.perf_counter() - start:.0f} s")
    return report


def _mount(rig: Rig, folder: Path, announce: Announce) -> tuple[Result, list[Path]]:
    # Slicing takes minutes the first time; `mirrorgaze export` does it.
    made = export_checked_mount(rig, folder / "mount", announce=announce, slicing=False)
    parts = []
    for part, mesh in zip(made.assembly.parts, rig_meshes(rig), strict=True):
        size = np.ptp(mesh.vertices_m, axis=0) * 1000
        corners = mesh.vertices_m[mesh.faces]
        # Divergence theorem: a closed surface's volume is the sum of its faces' signed tetrahedra.
        volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
        parts.append(
            {
                "name": part.name,
                "role": str(part.role),
                "moves_with": str(part.group),
                "printed": part.printed,
                "size_mm": [round(float(side), 2) for side in size],
                "volume_cm3": round(float(volume) * 1e6, 3),
            }
        )
    result = {
        "parts": parts,
        "files": [str(file.relative_to(folder)) for file in made.files],
        **checks_and_loads(made.checks, made.loads),
    }
    return result, made.files


def _views(rig: Rig, folder: Path) -> tuple[Result, list[Path]]:
    target = folder / "views"
    target.mkdir(parents=True, exist_ok=True)
    renderer = FastRenderer(rig, rig_meshes(rig), stage(rig), samples=VIEW_SAMPLES)
    layout = Layout.from_rig(rig)
    views, files = [], []
    for name, (azimuth, elevation) in GAZES_DEG.items():
        solutions = inverse_gaze(layout, np.radians(azimuth), np.radians(elevation))
        if not len(solutions):
            continue
        # Of several ways to look there, the one nearest to rest.
        q1_deg, q2_deg = np.degrees(solutions[np.abs(solutions).max(axis=1).argmin()])
        path = target / f"{name}.png"
        view = view_of(renderer, q1_deg=float(q1_deg), q2_deg=float(q2_deg), path=path)
        facts = view.as_dict()
        # How long a frame took is not a property of the design, and would differ from run to run.
        del facts["time_s"]
        views.append({"name": name, **facts, "file": f"views/{path.name}"})
        files.append(path)
    portraits = write_portraits(rig, rig_meshes(rig), target, q1=np.radians(PORTRAIT_Q1_DEG), q2=0.0)
    return {"views": views, "portraits": [f"views/{path.name}" for path in portraits]}, files + portraits


def _maps(rig: Rig, folder: Path) -> tuple[Result, list[Path]]:
    layout = Layout.from_rig(rig)
    q1, q2 = (joint.values(GRID_POSES) for joint in (layout.pan, layout.tilt))
    result = compute_coverage(rig, rig_meshes(rig), q1=q1, q2=q2, columns=IMAGE_CELLS[0], rows=IMAGE_CELLS[1])
    target = folder / "coverage"
    target.mkdir(parents=True, exist_ok=True)
    files = [target / name for name in ("usable_fov.png", "coverage.png", "poses.csv", "sphere.csv")]
    draw_usable_fov(result, files[0])
    draw_coverage(result, rig, files[1])
    write_poses(result, rig, files[2])
    write_sphere(result, files[3])
    best = np.unravel_index(result.solid_angle_sr.argmax(), result.solid_angle_sr.shape)
    counts = result.pixels.sum(axis=(0, 1))
    summary = {
        "poses": int(result.solid_angle_sr.size),
        "covered_fraction": result.covered_fraction,
        "upper_fraction": result.upper_fraction,
        "lower_fraction": result.lower_fraction,
        "usable_solid_angle_sr": {
            "mean": result.mean_solid_angle_sr,
            "largest": float(result.solid_angle_sr.max()),
            "largest_at_deg": [float(result.q1_deg[best[1]]), float(result.q2_deg[best[0]])],
        },
        "share_of_image": {outcome.name.lower(): float(counts[outcome] / counts.sum()) for outcome in Outcome},
    }
    return summary, files


def _dive(rig: Rig, dive: Dive, folder: Path, announce: Announce) -> tuple[Result, list[Path]]:
    target = folder / DIVE

    def tell(done: int, total: int) -> None:
        if done == total or done % TOLD_EVERY_FRAMES == 0:
            announce(f"dive: {done} of {total} frames")

    run_dive(dive, target, rig=rig, announce=announce, progress=tell)
    write_dive_figures(read_log(target), target)
    metrics: Result = json.loads((target / "metrics.json").read_text(encoding="utf-8"))
    return {"name": dive.name, "metrics": metrics}, sorted(path for path in target.iterdir() if path.is_file())


def _report(rig: Rig, folder: Path, results: dict[str, Result]) -> str:
    maps, views, mount = results["coverage"], results["views"]["views"], results["mount"]
    usable = maps["usable_solid_angle_sr"]
    header = f'<h1>{page.text(rig.name)}</h1><p class="lead">{page.text(rig.description)}</p>'
    key_numbers = page.tiles(
        [
            (f"{maps['covered_fraction']:.1%}", "of all directions seen through both mirrors"),
            (f"{maps['upper_fraction']:.1%} / {maps['lower_fraction']:.1%}", "of the upper / lower hemisphere"),
            (f"{usable['largest'] * 1000:.0f} msr", "largest usable field of view of a pose"),
            (f"{maps['share_of_image']['seen']:.1%}", "of the image shows the gaze, mean over all poses"),
        ]
    )
    pictures = [page.picture(folder / view["file"], _caption(view)) for view in views]
    shares = {name: maps["share_of_image"][outcome.name.lower()] for outcome, name in OUTCOME_NAMES.items()}
    losses = [[name, f"{share:.1%}"] for name, share in shares.items() if share]
    parts = [
        [
            part["name"],
            "print" if part["printed"] else "reference" if part["role"] == "hull" else "buy",
            " × ".join(f"{side:.0f}" for side in part["size_mm"]),
            f"{part['volume_cm3']:.1f}",
            part["moves_with"],
        ]
        for part in mount["parts"]
    ]
    sections = [
        header,
        key_numbers,
        page.section("What the camera sees", page.gallery(pictures)),
        page.section(
            "Usable field of view and coverage",
            page.picture(folder / "coverage/usable_fov.png", f"{maps['poses']} poses over the joint ranges"),
            page.picture(
                folder / "coverage/coverage.png",
                "All directions around the robot, equal areas equal; red: where the axis can point",
            ),
            page.table(["Where the image goes, mean over all poses", "Share"], losses, numbers=[1]),
        ),
        page.section(
            "Mount",
            page.gallery(page.picture(folder / file, PORTRAIT_CAPTION) for file in results["views"]["portraits"]),
            page.table(["Part", "", "Size (mm)", "Volume (cm³)", "Moves with"], parts, numbers=[3]),
        ),
        checks_section(mount, folder / "mount"),
        loads_section(mount, folder / "mount"),
        dive_section(folder / DIVE),
        page.section("Rig", page.table(["", ""], rig_facts(rig))),
        page.section("Files", page.bullets(_files(mount))),
        page.section("What this leaves out", page.bullets(LIMITS)),
        f"<footer>Made by mirrorgaze from the rig file <code>{page.text(rig.name)}</code>.</footer>",
    ]
    return page.page(f"{rig.name}: design dossier", sections)


LIMITS = (
    "Geometry is computed at 550 nm with an ideal pinhole: no depth of field, no dispersion, perfectly flat mirrors.",
    "Coverage counts directions as seen from far away; a cell of the sphere counts as covered when some pose sees its "
    "centre, which is decided by tracing the centre back to the image.",
    "Views show water of constant properties under a flat sea; the robot's shadow in it is that of joints at zero; the "
    "blur by forward scattering and the sensor's noise are left out.",
    "Clearances are those of rigid parts, and loads are bounds for steady flow; nothing is sliced here, see mirrorgaze "
    "export.",
)


def _caption(view: Result) -> str:
    # Adding zero turns the -0 of a rounded tiny angle into 0.
    gaze = {name: round(value) + 0 for name, value in view["gaze_deg"].items()}
    q1, q2 = (round(view[name], 1) + 0 for name in ("q1_deg", "q2_deg"))
    return (
        f"{view['name']}: q1 = {q1}°, q2 = {q2}°; gaze azimuth {gaze['azimuth']}°, elevation "
        f"{gaze['elevation']}°, roll {gaze['roll']}°; {view['region_px']['gaze']} gaze pixels"
    )


def _files(mount: Result) -> list[str]:
    return [
        "summary.json: every number of this page",
        "views/*.png: the pictures above, at full size",
        "dive/: video.mkv and overlay.mp4, log.parquet (truth beside what the loop believed), metrics.json, dive.toml",
        "coverage/poses.csv: gaze, usable solid angle and losses of every pose; coverage/sphere.csv: every direction",
        *_mount_files(mount["files"]),
    ]


def _mount_files(files: list[str]) -> list[str]:
    """Files of the mount, those of a folder in one line."""
    folders = Counter(str(Path(file).parts[1]) for file in files if len(Path(file).parts) > 2)
    single = [file for file in files if len(Path(file).parts) == 2]
    return [*single, *(f"mount/{name}/: {count} files" for name, count in folders.items())]
