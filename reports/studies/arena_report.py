"""The arena's report: tables, the worst dives with images of what went wrong, and all of it on a page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from dives.arena.replay import write_frames
from dives.arena.run import ArenaOutcome
from dives.arena.tables import HEADLINES, arena_rows, dives_csv, pair_differences, story, summary_csv
from dives.arena.tables import worst_dives as worst_of
from dives.files import OVERLAY_FILE, json_text
from dives.metrics.frames import Frames
from dives.metrics.holding import runs
from optics.workers.run import all_ended, counted, run_many
from reports.pages.arena import ArenaResults, WorstDive, arena_page, in_full
from reports.studies.key_frames import KeyFrame, key_frames
from rigs.atomic_files import write_text
from scenes.baking.light_quality import LightQuality
from tracking.log import read_log

FRAMES_FOLDER = "key_frames"

LEAST_RUN_S = 0.5
"""On something else, that is worth an image."""


def write_arena_report(
    outcomes: Sequence[ArenaOutcome],
    folder: Path,
    *,
    worst: int,
    videos: bool = False,
    workers: int,
    scheduler: str | None = None,
    quality: LightQuality | None = None,
    log: Callable[[str], None],
) -> ArenaResults:
    """Write dives.csv, summary.csv, arena.json and report.html, and images of the worst dives of each loop.

    Ablations of the default beside another loop are compared with it alone (`reports.pages.arena.in_full`).

    Parameters
    ----------
    outcomes : sequence of ArenaOutcome
    folder : Path
    worst : int
        Dives of each loop that are looked at; their images take as long as the dives.
    videos : bool
        Whether those of the first loop are written as videos as well: a whole image is rendered for each frame.
    workers : int
        Dives at a time, in processes of this machine.
    scheduler : str, optional
        Address of a dask cluster that draws instead.
    quality : LightQuality, optional
        As the dives have it, full by default.
    log : callable
        Takes sentences about what is going on.

    Returns
    -------
    ArenaResults
        What arena.json holds.
    """
    rows, differences = arena_rows(outcomes), pair_differences(outcomes, HEADLINES)
    variants = list(dict.fromkeys(outcome.variant for outcome in outcomes))
    chosen = [outcome for variant in in_full(variants) for outcome in worst_of(outcomes, variant, worst)]
    pictured = _pictured(
        chosen,
        partial(write_frames, quality=quality),
        filmed=variants[0] if videos else None,
        workers=workers,
        scheduler=scheduler,
        log=log,
    )
    results = ArenaResults(
        outcomes=outcomes,
        rows=rows,
        differences=differences,
        worst=[
            WorstDive(
                outcome=outcome,
                story=story(outcome.numbers or {}),
                images=pictured[outcome.folder],
                video=video if (video := outcome.folder / OVERLAY_FILE).is_file() else None,
            )
            for outcome in chosen
        ],
    )
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / "dives.csv", dives_csv(outcomes))
    write_text(folder / "summary.csv", summary_csv(rows))
    write_text(folder / "arena.json", json_text(results.as_dict()))
    write_text(folder / "report.html", arena_page(results))
    return results


def arena_key_frames(frames: Frames) -> list[KeyFrame]:
    """Key frames of a dive, and the middle of the longest time on something else."""
    keys = key_frames(frames)
    away = max(runs(frames.false_tracking), key=lambda run: run[1] - run[0], default=(0, 0))
    lasting = float(frames.lasts_s[away[0] : away[1]].sum())
    if lasting >= LEAST_RUN_S:
        middle = sum(away) // 2
        said = f"{frames.time_s[middle]:.1f} s: on the {frames.followed[middle]} for {lasting:.1f} s"
        keys.append(KeyFrame(name="on_something_else", frame=middle, caption=said))
    return keys


def _pictured(
    chosen: Sequence[ArenaOutcome],
    draw: Callable[..., None],
    *,
    filmed: str | None,
    workers: int,
    scheduler: str | None,
    log: Callable[[str], None],
) -> dict[Path, list[tuple[Path, str]]]:
    """Images of dives with their captions, by the dive's folder, and videos of those of one loop.

    What is there is kept.
    """
    pictures: dict[Path, list[tuple[Path, str]]] = {}
    jobs: dict[str, tuple[Any, ...]] = {}
    for outcome in chosen:
        keys = arena_key_frames(Frames.of(read_log(outcome.folder)))
        paths = {key: outcome.folder / FRAMES_FOLDER / f"{key.name}.png" for key in keys}
        pictures[outcome.folder] = [(path, key.caption) for key, path in paths.items()]
        # Two may be of one frame.
        missing = {key.frame: str(path.absolute()) for key, path in paths.items() if not path.is_file()}
        video = outcome.folder / OVERLAY_FILE
        film = str(video.absolute()) if outcome.variant == filmed and not video.is_file() else None
        if missing or film:
            jobs[outcome.folder.name] = (outcome.seed, outcome.variant, missing, film)
    ends = run_many(draw, jobs, workers=workers, scheduler=scheduler)
    all_ended(ends, counted(log, 0, len(jobs), "dives drawn"))
    return {
        folder: [(path, caption) for path, caption in images if path.is_file()] for folder, images in pictures.items()
    }
