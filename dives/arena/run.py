"""Dive the arena: seeds and loops, each in its own folder; what is finished stays finished."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from cad.assembly.meshes import rig_meshes
from dives.arena.distribution import ArenaDive, arena_dive, arena_rig
from dives.arena.judged import judged
from dives.dive import Dive, varied
from dives.files import json_text
from dives.runner import run_dive
from optics.workers.run import Failure, all_ended, counted, run_many
from optics.workers.shards import Manifest, Shard
from rigs.atomic_files import write_text
from scenes.baking.light_quality import LightQuality, light_identity, light_marks
from tracking.log import read_log
from tracking.loop.ablations import LOOPS

NUMBERS_FILE = "arena.json"


@dataclass(frozen=True, kw_only=True)
class ArenaOutcome:
    """What became of a dive.

    Attributes
    ----------
    seed : int
    variant : str
        The loop.
    factors : mapping of str to str
        As `ArenaDive` has them.
    folder : Path
    numbers : dict, optional
        As `dives.arena.judged.judged` names them; None for a dive that failed.
    failure : Failure, optional
    """

    seed: int
    variant: str
    factors: Mapping[str, str]
    folder: Path
    numbers: dict[str, Any] | None
    failure: Failure | None


def run_arena(
    seeds: Sequence[int],
    variants: Sequence[str],
    folder: Path,
    *,
    workers: int,
    scheduler: str | None = None,
    shard: Shard | None = None,
    log: Callable[[str], None],
    quality: LightQuality | None = None,
    work: Callable[[int, str, str], None] | None = None,
) -> list[ArenaOutcome]:
    """Dive every seed with every loop, without video; those that fail do not keep the others.

    Parameters
    ----------
    seeds : sequence of int
    variants : sequence of str
        Names of loops, of `tracking.loop.ablations.LOOPS`.
    folder : Path
        Each dive is written to a folder in it. More seeds and loops may join those of an earlier run.
    workers : int
        Dives at a time, in processes of this machine.
    scheduler : str, optional
        Address of a dask cluster that dives instead; `folder` is then one that its workers share.
    shard : Shard, optional
        Dive this part alone, and write a manifest of it; what became of it is returned.
    log : callable
        Takes a line for each dive that ends.
    quality : LightQuality, optional
        Of the light in the images, full by default.
    work : callable, optional
        Dives and judges; `dive_and_judge` when none is given. Of a module's top level: other processes import it.

    Raises
    ------
    ValueError
        Before anything is dived: for an unknown loop, a negative seed, or a folder that holds another dive.
    """
    unknown = [variant for variant in variants if variant not in LOOPS]
    if unknown:
        raise ValueError(f"loop {', '.join(unknown)}: expected one of {', '.join(sorted(LOOPS))}")
    drawn = {seed: arena_dive(seed) for seed in seeds}
    every = [(seed, variant) for variant in variants for seed in seeds]
    keys = every if shard is None else shard.part(every)
    folders = {(seed, variant): folder / f"{seed:04d}-{variant}" for seed, variant in keys}
    waiting = {
        # Absolute, since workers of other machines are in another folder.
        _name(*key): (*key, str(path.absolute()))
        for key, path in folders.items()
        if not _is_judged(drawn[key[0]], path, quality)
    }
    told = [counted(log, len(folders) - len(waiting), len(folders), "dives")]
    if shard is not None:
        done = {_name(*key): _name(*key) not in waiting for key in keys}
        told.append(Manifest(folder, shard, total=len(every), done=done).ended)
    work = work or partial(dive_and_judge, quality=quality)
    failures = all_ended(run_many(work, waiting, workers=workers, scheduler=scheduler), *told)
    return [
        ArenaOutcome(
            seed=seed,
            variant=variant,
            factors=drawn[seed].factors,
            folder=path,
            numbers=None if _name(seed, variant) in failures else _numbers(path),
            failure=failures.get(_name(seed, variant)),
        )
        for (seed, variant), path in folders.items()
    ]


def with_loop(drawn: ArenaDive, variant: str) -> Dive:
    """The dive of a seed with a loop."""
    return varied(drawn.dive, variant=variant)


def dive_and_judge(seed: int, variant: str, folder: str, *, quality: LightQuality | None = None) -> None:
    """Dive a seed with a loop into a folder, and write its numbers."""
    dive = with_loop(arena_dive(seed), variant)
    rig = dive.at_frame_rate(arena_rig(dive.rig))
    path = run_dive(dive, folder, rig=rig, quality=quality)
    found = {
        "drawn": drawn_digest(dive, quality),
        "numbers": judged(dive, rig, rig_meshes(rig), read_log(path)) | light_marks(quality),
    }
    write_text(path / NUMBERS_FILE, json_text(found))


def drawn_digest(dive: Dive, quality: LightQuality | None = None) -> str:
    """What says whether a folder's dive is the one that is drawn today, whatever the loop."""
    content = "".join([dive.model_dump_json(exclude={"variant"}), *map(json.dumps, light_identity(quality))])
    return hashlib.sha256(content.encode()).hexdigest()


def _is_judged(drawn: ArenaDive, folder: Path, quality: LightQuality | None) -> bool:
    file = folder / NUMBERS_FILE
    if not file.is_file():
        return False
    if json.loads(file.read_text(encoding="utf-8"))["drawn"] != drawn_digest(drawn.dive, quality):
        raise ValueError(f"{folder}: expected the dive that is drawn for this seed, got another; take a new folder")
    return True


def _name(seed: int, variant: str) -> str:
    return f"seed {seed}, {variant}"


def _numbers(folder: Path) -> dict[str, Any]:
    numbers: dict[str, Any] = json.loads((folder / NUMBERS_FILE).read_text(encoding="utf-8"))["numbers"]
    return numbers
