"""`python -m benchmarks kills`: workers are killed at random, and nothing is lost or handed over twice.

Many short pieces run on processes of this machine while one of these is killed again and again (SIGKILL, as the system
does when memory runs out). In the end each piece has to have been handed over once, with what it returns where nobody
kills.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from optics.workers.run import run_many

PIECE_S = 0.3


def work(folder: str, number: int) -> int:
    """Say which process has the piece, take some time, and return its number squared."""
    (Path(folder) / f"{number}.pid").write_text(str(os.getpid()))
    time.sleep(PIECE_S)
    return number**2


def main(arguments: Sequence[str]) -> int:
    """Print what became of the pieces; 1 when one was lost, handed over twice, or is wrong."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks kills", description=__doc__)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--pieces", type=int, default=200)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(list(arguments))
    killed: list[int] = []
    over = threading.Event()
    with tempfile.TemporaryDirectory() as folder:
        killer = threading.Thread(
            target=_kill, args=(Path(folder), options.kills, random.Random(options.seed), killed, over)
        )
        killer.start()
        pieces = {str(number): (folder, number) for number in range(options.pieces)}
        ends = []
        for ended in run_many(work, pieces, workers=options.workers):
            ends.append(ended)
            print(f"\r{len(ends)} of {len(pieces)}, {len(killed)} killed", end="", file=sys.stderr, flush=True)
        over.set()
        killer.join()
    names = [ended.name for ended in ends]
    lost = len(set(pieces) - set(names))
    twice = len(names) - len(set(names))
    aside = [ended.name for ended in ends if ended.failure is not None]
    wrong = [ended.name for ended in ends if ended.failure is None and ended.value != int(ended.name) ** 2]
    print(
        f"\n{len(killed)} kills, {len(pieces)} pieces: {lost} lost, {twice} twice, {len(wrong)} wrong, "
        f"{len(aside)} set aside since three died at them"
    )
    return int(bool(lost or twice or wrong) or len(killed) < options.kills)


def _kill(folder: Path, kills: int, rng: random.Random, killed: list[int], over: threading.Event) -> None:
    """Kill one of the processes that pieces have told of, at random times, each once."""
    while len(killed) < kills and not over.wait(rng.uniform(0.5, 3.0)):
        told = {int(file.read_text() or 0) for file in folder.glob("*.pid")} - {0, *killed}
        if told:
            pid = rng.choice(sorted(told))
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
                killed.append(pid)
