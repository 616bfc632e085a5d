"""What is written of a dive: its plan before it, and the report of its folder after it."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

from cad import rig_meshes
from dives.dive import Dive
from dives.files import read_metrics
from dives.metrics.frames import Frames
from dives.metrics.holding import losses
from dives.planning.plan import DivePlan, plan_dive
from reports.figures.dive import write_dive_figures
from reports.figures.plan import draw_plan
from reports.pages.dive import OVERLAY, DiveResults, dive_page, verdict
from reports.studies.key_frames import key_frames, save_key_frames
from rigs.atomic_files import atomic_files, write_text
from tracking.log import read_log

NEEDED = ("dive.toml", "rig.toml", "log.parquet", "metrics.json")


def write_dive_plan(dive: Dive, folder: Path) -> DivePlan:
    """Plan a dive, and write plan.png and plan.json into a folder; nothing is rendered."""
    rig = dive.load_rig()
    parts = rig_meshes(rig)
    plan = plan_dive(dive, rig, parts)
    with atomic_files(folder) as scratch:
        draw_plan(plan, rig, parts, scratch / "plan.png")
        (scratch / "plan.json").write_text(json.dumps(plan.numbers(), indent=2) + "\n", encoding="utf-8")
    return plan


def write_dive_report(folder: Path) -> Path:
    """Write the page of a dive into its folder, `report.html`, and return its path; see `dive_results`."""
    results = dive_results(folder)
    report = folder / "report.html"
    write_text(report, dive_page(f"{folder.resolve().name}: dive", results, folder))
    return report


def dive_results(folder: Path) -> DiveResults:
    """Read a finished dive, and put its figures and the images of its key frames beside the log.

    Raises
    ------
    ValueError
        When the folder holds no finished dive: with everything that is missing.
    """
    missing = [name for name in NEEDED if not (folder / name).is_file()]
    if missing:
        without = ", without ".join(missing)
        raise ValueError(f"{folder}: expected the folder of a finished dive, got one without {without}")
    dive, rig = (tomllib.loads((folder / name).read_text(encoding="utf-8")) for name in ("dive.toml", "rig.toml"))
    table = read_log(folder)
    frames = Frames.of(table)
    metrics = read_metrics(folder)
    return DiveResults(
        name=dive["name"],
        dive=dive | {"rig": rig["name"]},
        metrics=metrics,
        story=verdict(metrics, frames),
        losses=losses(frames),
        looking_frames=int(frames.looking.sum()),
        figures=[file.relative_to(folder).as_posix() for file in write_dive_figures(table, folder)],
        key_frames=_key_frames(folder, frames),
    )


def _key_frames(folder: Path, frames: Frames) -> list[tuple[str, str]]:
    if not (folder / OVERLAY).is_file():
        return []
    images = save_key_frames(folder / OVERLAY, key_frames(frames), folder / "key_frames")
    return [(image.relative_to(folder).as_posix(), caption) for image, caption in images]
