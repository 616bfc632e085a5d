"""A disk that is full at any moment: what is written appears whole or not at all, and a sentence says so.

On a file system of a few hundred kilobytes in memory, which only this process sees; where the system does not allow
that, nothing is tried.
"""

from __future__ import annotations

import ctypes
import json
import os
import random
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.attack.verdicts import LostError

NAME = "disk"
GOAL = 10_000

SIZE_KB = 256
CLONE_NEWNS = 0x00020000
FILL = "fill"

Write = Callable[[Path, random.Random], None]


def prepare(folder: Path) -> Callable[[random.Random], None]:
    """What the cases share: the small disk; `OSError` where the system does not allow one."""
    disk = folder / "disk"
    disk.mkdir()
    _mount(disk)
    writes: tuple[Write, ...] = (_rig(), _files, _journal, _stages(), _cache())

    def case(rng: random.Random) -> None:
        subprocess.run(["/bin/sh", "-c", f"rm -rf {disk}/* {disk}/.[a-z]*"], check=True)
        write = rng.choice(writes)
        room = os.statvfs(disk)
        left = rng.randrange(0, 40_000)
        (disk / FILL).write_bytes(b"x" * max(room.f_bavail * room.f_frsize - left, 0))
        write(disk, rng)

    return case


def _mount(disk: Path) -> None:
    """Mount the disk where no other process sees it: it goes with this one."""
    if ctypes.CDLL(None, use_errno=True).unshare(CLONE_NEWNS):
        raise OSError(ctypes.get_errno(), "expected to be allowed a file system of our own")
    subprocess.run(["mount", "--make-rprivate", "/"], check=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={SIZE_KB}k", "attack", str(disk)], check=True)


def _rig() -> Write:
    from rigs import Rig

    rig = Rig.load("aqua2")

    def write(disk: Path, rng: random.Random) -> None:
        """A rig that is there is saved again with other numbers."""
        file = disk / "rig.toml"
        (disk / FILL).rename(disk / "aside")
        os.truncate(disk / "aside", 0)
        rig.save(file)
        before = file.read_bytes()
        _fill(disk / "aside", rng.randrange(0, 20_000))
        changed = rig.with_(gaze_mirror__width_mm=float(rng.randrange(60, 100)), description="d" * 9000)
        try:
            changed.save(file)
        except OSError:
            _unchanged(file, before)
            raise
        if Rig.load(file).gaze != changed.gaze:
            raise LostError("saved, and it is another rig")

    return write


def _fill(file: Path, left: int) -> None:
    room = os.statvfs(file.parent)
    with file.open("ab") as opened:
        opened.write(b"x" * max(room.f_bavail * room.f_frsize - left, 0))


def _files(disk: Path, rng: random.Random) -> None:
    """Several files that appear together."""
    from rigs.atomic_files import atomic_files

    folder = disk / "out"
    names = [f"{number}.bin" for number in range(5)]
    try:
        with atomic_files(folder) as scratch:
            for name in names:
                (scratch / name).write_bytes(rng.randbytes(rng.randrange(10_000)))
    except OSError:
        if folder.exists() and any(folder.iterdir()):
            raise LostError("some of several files are there") from None
        _nothing_hidden(disk)
        raise
    if sorted(path.name for path in folder.iterdir()) != names:
        raise LostError("not all of several files are there")


def _journal(disk: Path, rng: random.Random) -> None:
    """A dive's journal that is gone on with after the disk was full."""
    from dives.journal import Journal

    folder, finished, identity = disk / "dive", 0, "5" * 64
    try:
        journal = Journal(folder, identity)
        try:
            for segment in range(6):
                file = journal.path(segment, "rows.parquet")
                file.write_bytes(rng.randbytes(4000))
                journal.finish(segment, json.dumps({"segment": segment}), [file])
                finished = segment + 1
        finally:
            journal.close()
    except OSError:
        os.truncate(disk / FILL, 0)
        again = Journal(folder, identity)
        again.close()
        if again.finished != finished:
            raise LostError(f"{finished} segments were finished, {again.finished} are known") from None
        raise


def _stages() -> Write:
    from reports.progress import Stages
    from rigs import Rig
    from rigs.atomic_files import write_text

    rig = Rig.load("bench")

    def write(disk: Path, rng: random.Random) -> None:
        """Stages of long work."""
        folder, done = disk / "work", []

        def work(name: str) -> tuple[dict[str, str], list[Path]]:
            file = folder / f"{name}.csv"
            write_text(file, "x" * rng.randrange(10_000))
            return {"name": name}, [file]

        try:
            stages = Stages.open(folder, rig, _unheard)
            for name in ("one", "two", "three"):
                stages.run(name, dict, lambda name=name: work(name))
                done.append(name)
        except OSError:
            os.truncate(disk / FILL, 0)
            again = Stages.open(folder, rig, _unheard)
            if any(again.recall(name, dict) != {"name": name} for name in done):
                raise LostError(f"{done} were done, {sorted(again.done)} are known") from None
            raise

    return write


def _cache() -> Write:
    from optics.kernels.cache import load_or_make, result_key

    def write(disk: Path, rng: random.Random) -> None:
        """Results that cannot be kept are made."""
        os.environ["MIRRORGAZE_CACHE"] = str(disk / "cache")
        values = np.array([rng.random() for _ in range(rng.randrange(3000))])
        key = result_key("attack", 1, values)
        for _ in range(2):
            found: dict[str, Any] = load_or_make("attack", key, lambda: {"v": values}, pack=dict, unpack=dict)
            if not np.array_equal(found["v"], values):
                raise LostError("another result where it could not be kept")
        _nothing_hidden(disk)

    return write


def _unchanged(file: Path, before: bytes) -> None:
    if file.read_bytes() != before:
        raise LostError(f"{file.name} changed, though it could not be written")
    _nothing_hidden(file.parent)


def _nothing_hidden(disk: Path) -> None:
    left = [path.name for path in disk.rglob(".*")]
    if left:
        raise LostError(f"left behind: {left}")


def _unheard(line: Any) -> None:
    """Progress that nobody reads."""
