"""What unfinished and finished work keeps of itself, damaged: nothing damaged counts as whole.

A third each: the journal of a dive that was stopped, the folder of a finished dive, the stages of a design.
"""

from __future__ import annotations

import json
import random
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.attack.mutations import damaged_bytes
from benchmarks.attack.verdicts import LostError

NAME = "journals"
GOAL = 100_000

SEGMENTS = 4
IDENTITY = "5" * 64
FILES = ("video.mkv", "metrics.json", "dive.toml")


def prepare(folder: Path) -> Callable[[random.Random], None]:
    """What the cases share: a journal, a finished dive and a folder of stages, all small."""
    attacks = (_journal(folder / "journal"), _finished(folder / "finished"), _stages(folder / "stages"))

    def case(rng: random.Random) -> None:
        rng.choice(attacks)(rng)

    return case


def _journal(whole: Path) -> Callable[[random.Random], None]:
    """The journal goes on behind the last segment before the first that is damaged."""
    from dives.journal import Journal

    journal = Journal(whole, IDENTITY)
    for segment in range(SEGMENTS):
        files = [journal.path(segment, name) for name in ("rows.parquet", "video.mkv")]
        for file in files:
            file.write_bytes(f"{segment} {file.name}".encode() * 20)
        journal.finish(segment, json.dumps({"segment": segment}), files)
    journal.close()
    contents = _contents(whole)

    def attack(rng: random.Random) -> None:
        folder = whole.with_name("attacked-journal")
        damaged = _damage(folder, contents, rng)
        journal = Journal(folder, IDENTITY)
        finished, state = journal.finished, journal.snapshot()
        journal.close()
        first = min((_segment(name) for name in damaged if name.endswith((".json", ".mkv", ".parquet"))), default=4)
        at_most = 0 if any(name.endswith("identity") for name in damaged) else first
        if finished != at_most or (state or {"segment": -1})["segment"] != finished - 1:
            raise LostError(f"{sorted(damaged)} damaged: goes on behind segment {finished}, expected {at_most}")

    return attack


def _finished(whole: Path) -> Callable[[random.Random], None]:
    """A finished dive of which anything is damaged does not count as finished."""
    import pyarrow as pa

    from dives.files import is_finished
    from rigs.atomic_files import digest_of
    from tracking.log import LOG, read_log, write_table

    whole.mkdir()
    for name in FILES:
        (whole / name).write_bytes(name.encode() * 50)
    digests = json.dumps({name: digest_of(whole / name) for name in FILES})
    table = pa.table({"time_s": [0.0, 1.0], "mode": ["search", "track"]})
    write_table(table, whole / LOG, about={"identity": IDENTITY, "digests": digests})
    contents = _contents(whole)

    def attack(rng: random.Random) -> None:
        folder = whole.with_name("attacked-finished")
        damaged = _damage(folder, contents, rng)
        # Bytes of the log that say nothing, such as which program wrote it, may be others.
        if is_finished(folder, IDENTITY) and (damaged - {LOG} or not read_log(folder).equals(table)):
            raise LostError(f"{sorted(damaged)} damaged, and it counts as finished")

    return attack


def _stages(whole: Path) -> Callable[[random.Random], None]:
    """Stages whose record is damaged are made again."""
    from reports.progress import Stages
    from rigs import Rig

    rig = Rig.load("bench")
    made = Stages.open(whole, rig, _unheard)
    made.run("first", dict, lambda: ({"number": 1}, []))
    made.run("second", dict, lambda: ({"number": 2}, []))
    contents = _contents(whole)

    def attack(rng: random.Random) -> None:
        folder = whole.with_name("attacked-stages")
        damaged = _damage(folder, contents, rng)
        if not any(folder.iterdir()):
            return
        done = Stages.open(folder, rig, _unheard).done
        if done != ({} if damaged else made.done):
            raise LostError(f"a damaged record is taken for one of {sorted(done)}")

    return attack


def _contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def _damage(folder: Path, contents: dict[str, bytes], rng: random.Random) -> set[str]:
    """Write files into a new folder, one or two of them damaged or left out; which really differ."""
    shutil.rmtree(folder, ignore_errors=True)
    damaged = set()
    attacked = rng.sample(sorted(contents), k=min(len(contents), rng.randint(1, 2)))
    for name, content in contents.items():
        path, now = folder / name, content
        path.parent.mkdir(parents=True, exist_ok=True)
        if name in attacked:
            if rng.random() < 0.2:
                damaged.add(name)
                continue
            now = damaged_bytes(content, rng)
        path.write_bytes(now)
        if not _says_the_same(name, now, content):
            damaged.add(name)
    return damaged


def _says_the_same(name: str, now: bytes, content: bytes) -> bool:
    """Whether a file says what it said: JSON may have other spaces, all else has the same bytes."""
    if now == content or not name.endswith(".json"):
        return now == content
    try:
        return bool(json.loads(now) == json.loads(content))
    except ValueError:
        return False


def _segment(name: str) -> int:
    return int(Path(name).name.partition(".")[0])


def _unheard(line: Any) -> None:
    """Progress that nobody reads."""
