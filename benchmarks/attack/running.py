"""Attacks in processes of their own: one that dies or hangs is a case that was lost, and the next one goes on."""

from __future__ import annotations

import ctypes
import importlib
import logging
import os
import random
import resource
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from benchmarks.attack.verdicts import Tally, Verdict, judged

HANG_S = 120.0
"""A case that takes longer by the clock is ended, where its attack has no `HANG_S` of its own."""

MEMORY_BYTES = 8 * 2**30
"""Of a process: what asks for more reads so."""

SCRATCH = Path("/dev/shm") if os.access("/dev/shm", os.W_OK) else Path(tempfile.gettempdir())
"""Where the files are written: in memory, where the system has such a place."""


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Cases of an attack: which, and until when (`time.monotonic`)."""

    name: str
    seed: int
    first: int
    last: int
    ends_s: float

    @property
    def is_over(self) -> bool:
        """Whether there is nothing left to do, or no time."""
        return self.first >= self.last or time.monotonic() > self.ends_s


def attacked(name: str, *, seed: int, cases: int, seconds: float, say: Callable[[str], None]) -> Tally:
    """Run the cases of an attack, until there are as many as asked for or the time is over."""
    tally = Tally(name)
    plan = Plan(name=name, seed=seed, first=0, last=cases, ends_s=time.monotonic() + seconds)
    while not plan.is_over:
        plan = replace(plan, first=_in_a_process(plan, tally))
        say(f"{name}: {tally.tried} tried, {tally.refused} refused, {tally.through} through")
    return tally


def drawn(seed: int, name: str, number: int) -> random.Random:
    """The generator of a case: the same damage in every run."""
    return random.Random(f"{seed} {name} {number}")


def module(name: str) -> Any:
    """Module of an attack."""
    return importlib.import_module(f"benchmarks.attack.{name}")


def _in_a_process(plan: Plan, tally: Tally) -> int:
    """Run cases in a process until it is done or dies, and count them; the number of the next one."""
    context = get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    current = context.Value(ctypes.c_int64, plan.first, lock=False)
    with tempfile.TemporaryDirectory(dir=SCRATCH, prefix="mirrorgaze-attack-", ignore_cleanup_errors=True) as scratch:
        process = context.Process(target=_work, args=(theirs, current, plan, scratch))
        process.start()
        theirs.close()
        hang_s = getattr(module(plan.name), "HANG_S", HANG_S)
        ended = _counted(ours, tally, hang_s)
        if not ended and process.is_alive():
            process.kill()
        process.join()
    if ended:
        return int(current.value)
    story = f"its process ended with {process.exitcode}, or it took more than {hang_s:.0f} s"
    tally.add(str(current.value), Verdict(outcome="lost", spent_s=0.0, story=story))
    return int(current.value) + 1


def _counted(pipe: Connection, tally: Tally, hang_s: float) -> bool:
    """Count what a process reports until it says that it is done; False when it dies or hangs."""
    while pipe.poll(hang_s):
        try:
            report = pipe.recv()
        except (EOFError, OSError):
            return False
        if report is None:
            return True
        tally.add(*report)
    return False


def _work(pipe: Connection, current: Any, plan: Plan, scratch: str) -> None:
    _stand_apart(scratch)
    try:
        case = module(plan.name).prepare(Path(scratch))
    except OSError:
        # Not allowed here: nothing is tried.
        current.value = plan.last
        pipe.send(None)
        return
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    while not plan.is_over:
        current.value = plan.first
        generator = drawn(plan.seed, plan.name, plan.first)
        pipe.send((str(plan.first), judged(partial(case, generator))))
        plan = replace(plan, first=plan.first + 1)
    current.value = plan.first
    pipe.send(None)


def _stand_apart(scratch: str) -> None:
    """Keep the cache, reports of mistakes and all else that is written in the scratch folder."""
    os.environ |= {"MIRRORGAZE_CACHE": f"{scratch}/cache", "TMPDIR": scratch, "MPLCONFIGDIR": f"{scratch}/matplotlib"}
    os.chdir(scratch)
    # One line for each file of the cache that cannot be read would be a hundred thousand.
    logging.disable(logging.WARNING)
    # Libraries tell of what they meet in a damaged file, each in its own words, to nobody here.
    quiet = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(quiet, stream)
