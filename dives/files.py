"""A finished dive's folder: what the segments of its journal are put together to."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from cad.assembly.meshes import rig_meshes
from cad.export.drawings.manifest import rig_text
from cad.hulls.files.triangles import hull_files
from dives.dive import Dive
from dives.journal import FOLDER, Journal
from dives.metrics import dive_metrics
from dives.metrics.frames import Frames
from dives.metrics.search_time import search_time_metrics
from dives.named_files import copied_files, named_files
from dives.planning.availability import availability
from dives.planning.followable import possible_metrics
from dives.recorder import FRAMES, OVERLAY, ROWS, VIDEO
from dives.views.robot_view import robot_view
from rigs import Rig
from rigs.atomic_files import as_digests_say, atomic_file, digest_of, write_text
from tracking.log import LOG, read_log, write_table
from tracking.video import concatenate

VIDEO_FILE, OVERLAY_FILE, METRICS_FILE = "video.mkv", "overlay.mp4", "metrics.json"
DIVE_FILE, RIG_FILE = "dive.toml", "rig.toml"
IDENTITY_KEY, DIGESTS_KEY = b"identity", b"digests"


def is_finished(folder: Path, identity: str) -> bool:
    """Whether a folder holds this dive, finished and as it was then; `ValueError` when it holds another."""
    log = folder / LOG
    if not log.is_file() or (folder / FOLDER).exists():
        return False
    about = read_log(folder).schema.metadata or {}
    if about.get(IDENTITY_KEY) != identity.encode():
        raise ValueError(f"{folder}: expected the same dive as before or a new folder; another dive is in it")
    try:
        return as_digests_say(folder, json.loads(about[DIGESTS_KEY]))
    except (KeyError, ValueError, AttributeError, TypeError):
        # Of an earlier version, or damaged where the log has no checksums: the dive is made again.
        return False


def finish_dive(dive: Dive, rig: Rig, folder: Path, journal: Journal, identity: str, *, light: dict[str, str]) -> None:
    """Put the segments together; the log comes last, and then the journal goes.

    The rig is put beside them with every number in it: the folder can be handed on, and says how the dive was made;
    `light` (`scenes.baking.light_quality.light_marks`) goes to the metrics.
    """
    table = pa.concat_tables([pq.read_table(path) for path in journal.paths(ROWS)])
    written = [RIG_FILE, DIVE_FILE, METRICS_FILE]
    for name, file, container in ((VIDEO, VIDEO_FILE, "matroska"), (OVERLAY, OVERLAY_FILE, "mp4")):
        segments = journal.paths(name)
        if segments:
            written.append(file)
            with atomic_file(folder / file) as partial:
                concatenate(segments, partial, container=container, frame_rate_hz=dive.frame_rate_hz)
    write_text(folder / RIG_FILE, rig_text(rig))
    if rig.file_hull is not None:
        # A robot's description finds the meshes that it names beside it.
        for part in hull_files(rig.file_hull.file):
            shutil.copyfile(part, folder / part.name)
            written.append(part.name)
    recorded = copied_files(dive, folder).model_copy(update={"rig": RIG_FILE})
    write_text(folder / DIVE_FILE, recorded.as_toml())
    frames, parts = Frames.of(table), rig_meshes(rig)
    shown = robot_view(rig, parts)
    searched = search_time_metrics(rig, dive.loop_variant(), frames, shown)
    possible = possible_metrics(dive, rig, shown, frames, availability(dive, rig, parts, frames.time_s))
    write_text(folder / METRICS_FILE, json_text(dive_metrics(table) | searched | possible | light))
    written += named_files(recorded).values()
    if dive.video == "frames":
        written += [str(image.relative_to(folder)) for image in sorted((folder / FRAMES).glob("*.png"))]
    digests = {name: digest_of(folder / name) for name in sorted(written)}
    with atomic_file(folder / LOG) as partial:
        write_table(table, partial, about={"identity": identity, "digests": json.dumps(digests)})
    journal.remove()


def read_metrics(folder: Path) -> dict[str, Any]:
    """Metrics of a finished dive (`dives.metrics.dive_metrics`), and how it looks for its target."""
    metrics: dict[str, Any] = json.loads((folder / METRICS_FILE).read_text(encoding="utf-8"))
    return metrics


def json_text(data: Any) -> str:
    """JSON as it is kept in files; what is not a finite number is null already."""
    return json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
